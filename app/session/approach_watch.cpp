// SPDX-License-Identifier: Apache-2.0
#include "app/session/approach_watch.h"

#include <cmath>
#include <numbers>

namespace docent::app {

namespace {

// The angle that a model spans, by the sphere around it. From where an author places a model of the usual
// size it spans 11 degrees: a fifth of its distance. The gap keeps one who sways from starting it over and
// over.
constexpr double kNear_rad = 10 * std::numbers::pi / 180, kAway_rad = 7 * std::numbers::pi / 180;

double SpanOf(const content::PlacedModel& placed, const Eigen::Vector3d& eye) {
  const content::Model& model = *placed.asset->model;
  const glm::vec3 middle = 0.5f * (model.bounds_min + model.bounds_max);
  const double radius = placed.map_from_model.scale * 0.5 * glm::length(model.bounds_max - model.bounds_min);
  const double distance =
      (placed.map_from_model * Eigen::Vector3d(middle.x, middle.y, middle.z) - eye).norm();
  return 2 * std::atan2(radius, distance);
}

bool IsAnimated(const content::Entity& entity) {
  return entity.kind == content::Entity::Kind::kModel && !entity.hidden && entity.model.asset->model &&
         !entity.model.asset->model->animations.empty();
}

}  // namespace

std::shared_ptr<const ApproachWatch::Starts> ApproachWatch::Update(
    double seconds, std::uint64_t map_key, const content::Scene& scene,
    const std::optional<Eigen::Vector3d>& camera_in_map) {
  if (!camera_in_map) return starts_;
  const Starts* const before = map_key == map_key_ ? starts_.get() : nullptr;
  Starts now;
  for (const content::Entity& entity : scene.entities) {
    if (!IsAnimated(entity)) continue;
    const auto known = before != nullptr ? before->find(entity.name) : Starts::const_iterator();
    const bool has_begun = before != nullptr && known != before->end();
    if (SpanOf(entity.model, *camera_in_map) < (has_begun ? kAway_rad : kNear_rad)) continue;
    now.emplace(entity.name, has_begun ? known->second : seconds);
  }
  map_key_ = map_key;
  if (now != *starts_) starts_ = std::make_shared<const Starts>(std::move(now));
  return starts_;
}

}  // namespace docent::app
