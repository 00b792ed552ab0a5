// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Geometry>

#include "content/scene.h"

// PlaceOf, BoardMiddle, LeadNowhere, PoseOf, SetPose, TransformBy and MoveWithAnchor of scene.h.
namespace docent::content {
namespace {

// The axes of a trail: y up, z the direction in which it begins.
engine::Rotation3 TrailRotation(const Trail& trail) {
  const Eigen::Vector3d up = trail.up.normalized();
  Eigen::Vector3d ahead = up.unitOrthogonal();
  for (std::size_t i = 1; i < trail.points.size(); ++i) {
    const Eigen::Vector3d step = trail.points[i] - trail.points.front();
    const Eigen::Vector3d level = step - up * up.dot(step);
    // Of a shorter level part, the direction would be rounding.
    if (!(level.norm() > 1e-6 * step.norm())) continue;
    ahead = level.normalized();
    break;
  }
  Eigen::Matrix3d axes;
  axes << up.cross(ahead), up, ahead;
  return engine::Rotation3(axes);
}

}  // namespace

Eigen::Vector3d PlaceOf(const Entity& entity) {
  switch (entity.kind) {
    case Entity::Kind::kModel:
    case Entity::Kind::kImage:
      return entity.model.map_from_model.translation;
    case Entity::Kind::kSignpost:
      return entity.signpost.anchor;
    case Entity::Kind::kLabel:
      return entity.label.anchor;
    case Entity::Kind::kSound:
      return entity.sound.position;
    case Entity::Kind::kTrail:
      if (!entity.trail.points.empty()) return entity.trail.points.front();
      break;
    case Entity::Kind::kOccluder:
      return entity.occluder.map_from_shape.translation;
  }
  return Eigen::Vector3d::Zero();
}

Eigen::Vector3d BoardMiddle(const Signpost& signpost) {
  return signpost.anchor + (kSignpostPole + 0.5) * signpost.height * signpost.up;
}

void LeadNowhere(Signpost* signpost) {
  signpost->to_key = 0;
  signpost->to_map.clear();
  signpost->direction.reset();
}

engine::Sim3 PoseOf(const Entity& entity) {
  engine::Sim3 pose;
  pose.translation = PlaceOf(entity);
  switch (entity.kind) {
    case Entity::Kind::kModel:
    case Entity::Kind::kImage:
      return entity.model.map_from_model;
    case Entity::Kind::kSignpost:
      pose.scale = entity.signpost.height;
      break;
    case Entity::Kind::kLabel:
      pose.scale = entity.label.text_height;
      break;
    case Entity::Kind::kSound:
      pose.scale = entity.sound.range;
      break;
    case Entity::Kind::kTrail:
      pose.rotation = TrailRotation(entity.trail);
      pose.scale = entity.trail.width;
      break;
    case Entity::Kind::kOccluder:
      return entity.occluder.map_from_shape;
  }
  return pose;
}

void SetPose(const engine::Sim3& pose, Entity* entity) {
  switch (entity->kind) {
    case Entity::Kind::kModel:
    case Entity::Kind::kImage:
      entity->model.map_from_model = pose;
      break;
    case Entity::Kind::kSignpost:
      entity->signpost.anchor = pose.translation;
      entity->signpost.height = pose.scale;
      break;
    case Entity::Kind::kLabel:
      entity->label.anchor = pose.translation;
      entity->label.offset *= pose.scale / entity->label.text_height;
      entity->label.text_height = pose.scale;
      break;
    case Entity::Kind::kSound:
      entity->sound.position = pose.translation;
      entity->sound.range = pose.scale;
      break;
    case Entity::Kind::kTrail:
      TransformBy(pose * PoseOf(*entity).inverse(), entity);
      break;
    case Entity::Kind::kOccluder:
      entity->occluder.map_from_shape = pose;
      break;
  }
}

void TransformBy(const engine::Sim3& motion, Entity* entity) {
  switch (entity->kind) {
    case Entity::Kind::kModel:
    case Entity::Kind::kImage:
      entity->model.map_from_model = motion * entity->model.map_from_model;
      break;
    case Entity::Kind::kSignpost:
      entity->signpost.anchor = motion * entity->signpost.anchor;
      entity->signpost.up = motion.rotation * entity->signpost.up;
      entity->signpost.height *= motion.scale;
      if (entity->signpost.direction)
        entity->signpost.direction = motion.rotation * *entity->signpost.direction;
      break;
    case Entity::Kind::kLabel:
      entity->label.anchor = motion * entity->label.anchor;
      entity->label.offset = motion.scale * (motion.rotation * entity->label.offset);
      entity->label.up = motion.rotation * entity->label.up;
      entity->label.text_height *= motion.scale;
      break;
    case Entity::Kind::kSound:
      entity->sound.position = motion * entity->sound.position;
      entity->sound.range *= motion.scale;
      break;
    case Entity::Kind::kTrail:
      for (Eigen::Vector3d& point : entity->trail.points) point = motion * point;
      entity->trail.up = motion.rotation * entity->trail.up;
      entity->trail.width *= motion.scale;
      break;
    case Entity::Kind::kOccluder:
      entity->occluder.map_from_shape = motion * entity->occluder.map_from_shape;
      break;
  }
}

void MoveWithAnchor(const engine::Sim3& motion, Entity* entity) {
  Entity moved = *entity;
  TransformBy(motion, &moved);
  if (PoseProblem(moved).empty()) *entity = std::move(moved);
}

}  // namespace docent::content
