// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "app/command_line/author_view.h"
#include "app/script/commands.h"
#include "content/alignment.h"
#include "ui/authoring_actions.h"
#include "ui/entity_shapes.h"
#include "ui/scene_overlay.h"

namespace docent::app {

// Fits a model to the room by pairs of points (ptamm §6.1): one click on the model, one where that point
// belongs, three times or more. It collects the pairs; commands then align or bend the model. On the window's
// thread.
class FittingTool {
 public:
  // `shapes` must outlive the tool.
  explicit FittingTool(ui::EntityShapes* shapes) : shapes_(shapes) {}

  // Begins with no pairs, for the model of this name.
  void Begin(const std::string& name);
  void End();
  bool is_active() const { return !name_.empty(); }
  // Ends when the model is no longer in the scene.
  void KeepExisting(const content::Scene* scene);

  // A click at a pixel: on the model, or where its last point belongs. Returns why it means nothing, as a
  // sentence; empty if it was taken.
  std::string Click(const AuthorView& view, const Eigen::Vector2d& pixel);
  // Forgets the point that waits for its place, else the last pair.
  void RemoveLast();

  // What the panel shows; empty while it is not active.
  std::optional<ui::FitFacts> Facts(const content::Scene* scene) const;
  AlignEntity AlignCommand() const { return {name_, pairs_}; }
  BendEntity BendCommand() const { return {name_, pairs_}; }
  // The points on the model as it stands, their places, and lines between them.
  void Draw(const AuthorView& view, const content::Scene& scene, ui::SceneOverlay* overlay) const;

 private:
  std::string PickOnModel(const AuthorView& view, const content::Entity& entity,
                          const Eigen::Vector2d& pixel);

  ui::EntityShapes* const shapes_;
  std::string name_;  // Empty while it is not active.
  std::vector<PointPair> pairs_;
  std::optional<Eigen::Vector3d> begun_;  // A point of the model that waits for its place.
};

}  // namespace docent::app
