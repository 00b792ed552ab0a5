// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/script/commands.h"
#include "ui/authoring_actions.h"

namespace docent::app {

// What a person asks for in the author's window, as far as it is one command. On the window's thread.
class CommandActions : public ui::AuthoringActions {
 public:
  // `emit` queues a command for the frame on the screen.
  explicit CommandActions(std::function<void(Command)> emit) : emit_(std::move(emit)) {}

  void NewMap(const std::string& name) override;
  void StopMap() override;
  void UseMap(const std::string& name) override;
  void RenameMap(const std::string& name, const std::string& new_name) override;
  void RemoveMap(const std::string& name) override;
  void JoinMap(const std::string& name) override;
  void Unbend(const std::string& name) override;
  void SetPolicy(const std::string& name, const std::string& policy) override;
  void Undo() override;
  void Redo() override;
  void Save() override;
  void Rename(const std::string& name, const std::string& new_name) override;
  void SetText(const std::string& name, const std::string& text, const std::string& language) override;
  void SetOffset(const std::string& name, const Eigen::Vector3d& offset) override;
  void ShortenTrail(const std::string& name) override;
  void SetOccluderSize(const std::string& name, const Eigen::Vector3d& size) override;
  void SetTarget(const std::string& name, const std::string& to_map) override;
  void SetDirection(const std::string& name, const std::optional<Eigen::Vector3d>& direction) override;
  void PointAhead(const std::string& name) override;
  void SetLocked(const std::vector<std::string>& names, bool locked) override;
  void SetHidden(const std::vector<std::string>& names, bool hidden) override;
  void Ungroup(const std::vector<std::string>& names) override;
  void Transform(const std::vector<ui::NewPose>& poses) override;
  void ForgetUp() override;
  void ForgetScale() override;
  void SetEntrance(bool here) override;

 private:
  const std::function<void(Command)> emit_;
};

}  // namespace docent::app
