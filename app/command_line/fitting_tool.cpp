// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/fitting_tool.h"

#include <utility>

#include "app/session/surface_at_pixel.h"
#include "content/picking.h"
#include "content/warp.h"
#include "engine/base/error.h"
#include "ui/strings.h"

namespace docent::app {

namespace {

// Where a point of the original model is drawn. Map coordinates.
Eigen::Vector3d PlaceOnModel(const content::PlacedModel& model, const Eigen::Vector3d& in_model) {
  return model.map_from_model * (model.warp ? (*model.warp)(in_model) : in_model);
}

}  // namespace

void FittingTool::Begin(const std::string& name) {
  End();
  name_ = name;
}

void FittingTool::End() {
  name_.clear();
  pairs_.clear();
  begun_.reset();
}

void FittingTool::KeepExisting(const content::Scene* scene) {
  if (scene == nullptr || scene->Find(name_) == nullptr) End();
}

std::string FittingTool::Click(const AuthorView& view, const Eigen::Vector2d& pixel) {
  const content::Entity* const entity = view.scene ? view.scene->Find(name_) : nullptr;
  if (!view.has_pose() || entity == nullptr) return ui::strings::kNoSurface;
  if (!begun_) return PickOnModel(view, *entity, pixel);
  // The next click may come with another frame, so that the pixels of this one are not kept.
  try {
    const Eigen::Vector3d place = SurfaceAtPixel(view.frame->tracked, view.camera.lens, pixel).point;
    pairs_.push_back({*std::exchange(begun_, std::nullopt), place, std::nullopt});
  } catch (const Error&) {
    return ui::strings::kNoSurface;
  }
  return "";
}

std::string FittingTool::PickOnModel(const AuthorView& view, const content::Entity& entity,
                                     const Eigen::Vector2d& pixel) {
  if (pairs_.size() >= content::kMaxWarpPoints) return ui::strings::kFitFull;
  const auto ray = view.RayAt(pixel);
  const content::EntityShape shape = shapes_->ShapeOf(entity, view.eye());
  if (!ray || !shape.model) return ui::strings::kFitMissed;
  const auto distance = content::IntersectModel(*ray, *shape.model, shape.map_from_model,
                                                entity.model.animation, view.frame->seconds);
  if (!distance) return ui::strings::kFitMissed;
  const Eigen::Vector3d drawn =
      entity.model.map_from_model.inverse() * Eigen::Vector3d(ray->origin + *distance * ray->direction);
  begun_ = entity.model.warp ? content::Unwarped(*entity.model.warp, drawn) : drawn;
  return begun_ ? "" : ui::strings::kFitMissed;
}

void FittingTool::RemoveLast() {
  if (std::exchange(begun_, std::nullopt)) return;
  if (!pairs_.empty()) pairs_.pop_back();
}

std::optional<ui::FitFacts> FittingTool::Facts(const content::Scene* scene) const {
  const content::Entity* const entity = scene != nullptr ? scene->Find(name_) : nullptr;
  if (entity == nullptr) return std::nullopt;
  ui::FitFacts facts;
  facts.name = name_;
  facts.waits_for_place = begun_.has_value();
  facts.pairs = pairs_.size();
  if (pairs_.size() < content::kMinAlignmentPoints) return facts;
  std::vector<content::Correspondence> correspondences;
  for (const PointPair& pair : pairs_) {
    const Eigen::Vector3d& original = pair.in_model;
    correspondences.push_back({entity->model.warp ? (*entity->model.warp)(original) : original, pair.in_map});
  }
  try {
    const content::Alignment alignment = content::AlignModel(correspondences);
    facts.residuals = alignment.residuals;
    facts.used = alignment.inliers;
  } catch (const Error& error) {
    facts.problem = error.what();
  }
  return facts;
}

void FittingTool::Draw(const AuthorView& view, const content::Scene& scene, ui::SceneOverlay* overlay) const {
  const content::Entity* const entity = scene.Find(name_);
  if (entity == nullptr || !view.has_pose()) return;
  for (std::size_t i = 0; i < pairs_.size(); ++i)
    overlay->DrawPair(PlaceOnModel(entity->model, pairs_[i].in_model), pairs_[i].in_map,
                      std::to_string(i + 1));
  if (begun_) {
    const Eigen::Vector3d place = PlaceOnModel(entity->model, *begun_);
    overlay->DrawPair(place, place, std::to_string(pairs_.size() + 1));
  }
}

}  // namespace docent::app
