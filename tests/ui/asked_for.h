// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "ui/authoring_actions.h"

// Shared by the tests of the author's interface.
namespace docent::ui {

// What was asked for, in words.
class AskedFor : public AuthoringActions {
 public:
  void NewMap(const std::string& name) override { words.push_back("new map " + name); }
  void StopMap() override { words.push_back("stop"); }
  void UseMap(const std::string& name) override { words.push_back("use map " + name); }
  void RenameMap(const std::string& name, const std::string& new_name) override {
    words.push_back("rename map " + name + " to " + new_name);
  }
  void RemoveMap(const std::string& name) override { words.push_back("remove map " + name); }
  void JoinMap(const std::string& name) override { words.push_back("join map " + name); }
  void Fit(FitStep step) override { words.push_back("fit " + std::to_string(static_cast<int>(step))); }
  void Unbend(const std::string& name) override { words.push_back("unbend " + name); }
  void SetPolicy(const std::string& name, const std::string& policy) override {
    words.push_back("policy of " + name + ": " + policy);
  }
  void Undo() override { words.push_back("undo"); }
  void Redo() override { words.push_back("redo"); }
  void Save() override { words.push_back("save"); }
  void Quit(bool save) override { words.push_back(save ? "save and quit" : "quit without saving"); }
  void ChooseFile(content::AssetKind kind) override {
    words.push_back(kind == content::AssetKind::kModel ? "choose" : "choose another file");
  }
  void Select(const std::string& name, bool add) override {
    words.push_back((add ? "add " : "select ") + name);
  }
  void RemoveSelected() override { words.push_back("remove"); }
  void DuplicateSelected() override { words.push_back("duplicate"); }
  void CopySelected() override { words.push_back("copy"); }
  void Paste() override { words.push_back("paste"); }
  void Rename(const std::string& name, const std::string& new_name) override {
    words.push_back("rename " + name + " " + new_name);
  }
  void SetText(const std::string& name, const std::string& text, const std::string& language) override {
    words.push_back("text " + name + " " + text + (language.empty() ? "" : " in " + language));
  }
  void SetOffset(const std::string& name, const Eigen::Vector3d&) override {
    words.push_back("offset " + name);
  }
  void ShortenTrail(const std::string& name) override { words.push_back("shorten " + name); }
  void SetOccluderSize(const std::string& name, const Eigen::Vector3d&) override {
    words.push_back("resize " + name);
  }
  void SetTarget(const std::string& name, const std::string& to_map) override {
    words.push_back("target " + name + " " + to_map);
  }
  void SetDirection(const std::string& name, const std::optional<Eigen::Vector3d>& direction) override {
    words.push_back(direction ? "direction " + name : "no direction " + name);
  }
  void PointAhead(const std::string& name) override { words.push_back("point ahead " + name); }
  void SetLocked(const std::vector<std::string>&, bool locked) override {
    words.push_back(locked ? "lock" : "unlock");
  }
  void SetHidden(const std::vector<std::string>&, bool hidden) override {
    words.push_back(hidden ? "hide" : "show");
  }
  void Group(const std::vector<std::string>&) override { words.push_back("group"); }
  void Ungroup(const std::vector<std::string>&) override { words.push_back("ungroup"); }
  void Transform(const std::vector<NewPose>& poses) override {
    for (const NewPose& pose : poses) words.push_back("transform " + pose.name);
  }
  void ForgetUp() override { words.push_back("forget up"); }
  void ForgetScale() override { words.push_back("forget scale"); }
  void SetEntrance(bool here) override { words.push_back(here ? "entrance here" : "first entrance"); }
  void ToggleFullScreen() override { words.push_back("full screen"); }

  std::vector<std::string> words;
};

}  // namespace docent::ui
