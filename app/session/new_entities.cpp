// SPDX-License-Identifier: Apache-2.0
#include "app/session/new_entities.h"

#include <numbers>
#include <utility>

#include "app/session/session_options.h"
#include "content/occluder.h"

namespace docent::app {

namespace {

// Ratios of the distance at placement, design choices: a text of a word fills a tenth of the image, a sound
// plays where it was placed from, and a ribbon leaves the floor beside it visible.
constexpr double kLabelHeight = 0.035, kLabelOffset = 0.14, kSoundRange = 1.5, kTrailWidth = 1.0 / 15;

}  // namespace

content::Entity NewLabel(const std::string& text, const Eigen::Vector3d& point, const Eigen::Vector3d& up,
                         double distance) {
  content::Entity entity;
  entity.kind = content::Entity::Kind::kLabel;
  entity.label.text = text;
  entity.label.anchor = point;
  entity.label.up = up;
  entity.label.offset = kLabelOffset * distance * up;
  entity.label.text_height = kLabelHeight * distance;
  return entity;
}

content::Entity NewImage(const std::shared_ptr<const content::Asset>& image, const content::SurfaceHit& hit,
                         const Eigen::Vector3d& viewer, const Eigen::Vector3d& up, double scale,
                         bool upright) {
  content::Entity entity;
  entity.kind = content::Entity::Kind::kImage;
  entity.model.asset = image;
  entity.model.animation = -1;
  engine::Sim3& pose = entity.model.map_from_model;
  if (upright) {
    pose = content::FacingPose(hit.point, viewer, hit.normal, up, 0, scale);
    pose.translation += hit.point - content::BaseInMap(entity);
  } else {
    pose = content::FlushPose(hit.point, viewer, hit.normal, up, scale);
  }
  return entity;
}

content::Entity NewSound(const std::shared_ptr<const content::Asset>& sound, const Eigen::Vector3d& point,
                         double distance) {
  content::Entity entity;
  entity.kind = content::Entity::Kind::kSound;
  entity.sound.asset = sound;
  entity.sound.position = point;
  entity.sound.range = kSoundRange * distance;
  return entity;
}

content::Entity NewTrail(std::vector<Eigen::Vector3d> points, const Eigen::Vector3d& normals,
                         const Eigen::Vector3d& up, double distance) {
  content::Entity entity;
  entity.kind = content::Entity::Kind::kTrail;
  entity.trail.points = std::move(points);
  entity.trail.up = normals.norm() > 1e-6 ? Eigen::Vector3d(normals.normalized()) : up;
  entity.trail.width = kTrailWidth * distance;
  return entity;
}

content::Entity NewOccluder(const PlaceOccluder& command, std::span<const content::SurfaceHit> places,
                            const Eigen::Vector3d& viewer, const Eigen::Vector3d& up) {
  content::Entity entity;
  entity.kind = content::Entity::Kind::kOccluder;
  content::Occluder& occluder = entity.occluder;
  if (command.shape == content::Occluder::Shape::kPolygon) {
    std::vector<Eigen::Vector3d> corners;
    for (const content::SurfaceHit& place : places) corners.push_back(place.point);
    occluder = content::PolygonThrough(corners);
    return entity;
  }
  const bool is_plane = command.shape == content::Occluder::Shape::kPlane;
  const content::SurfaceHit& place = places.front();
  const double side = SessionOptions().model_side * (place.point - viewer).norm();
  occluder.shape = command.shape;
  occluder.size = command.size.value_or(Eigen::Vector3d(side, side, is_plane ? 0 : side));
  if (is_plane && !command.upright) {
    occluder.map_from_shape = content::FlushPose(place.point, viewer, place.normal, up, 1);
    return entity;
  }
  occluder.map_from_shape =
      content::FacingPose(place.point, viewer, place.normal, up, command.yaw_deg * std::numbers::pi / 180, 1);
  if (is_plane) occluder.map_from_shape.translation += 0.5 * occluder.size.y() * up;
  return entity;
}

}  // namespace docent::app
