// SPDX-License-Identifier: Apache-2.0
#include "app/session/new_entities.h"

#include <utility>

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

}  // namespace docent::app
