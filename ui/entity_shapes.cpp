// SPDX-License-Identifier: Apache-2.0
#include "ui/entity_shapes.h"

#include "ui/signpost_model.h"

namespace docent::ui {

engine::Sim3 TransformOf(const content::Entity& entity, const Eigen::Vector3d& eye_in_map) {
  if (entity.kind == content::Entity::Kind::kModel) return entity.model.map_from_model;
  return SignpostPose(entity.signpost, eye_in_map);
}

void SetTransform(const engine::Sim3& map_from_entity, content::Entity* entity) {
  if (entity->kind == content::Entity::Kind::kModel) {
    entity->model.map_from_model = map_from_entity;
    return;
  }
  entity->signpost.anchor = map_from_entity.translation;
  entity->signpost.height_m = map_from_entity.scale;
}

Eigen::Vector3d PlacedBox::Corner(int bits) const {
  return map_from_box * Eigen::Vector3d((bits & 1) != 0 ? high.x() : low.x(),
                                        (bits & 2) != 0 ? high.y() : low.y(),
                                        (bits & 4) != 0 ? high.z() : low.z());
}

Eigen::Vector3d PlacedBox::Base() const {
  return map_from_box * Eigen::Vector3d(0.5 * (low.x() + high.x()), low.y(), 0.5 * (low.z() + high.z()));
}

Eigen::Vector3d PlacedBox::Top() const {
  return map_from_box * Eigen::Vector3d(0.5 * (low.x() + high.x()), high.y(), 0.5 * (low.z() + high.z()));
}

std::shared_ptr<const content::Model> EntityShapes::ModelOf(const content::Signpost& signpost) {
  constexpr std::size_t kMostSigns = 2000;
  if (signs_.size() > kMostSigns) signs_.clear();
  auto& model = signs_[{signpost.text, signpost.to_map}];
  if (!model) model = MakeSignpostModel(signpost);
  return model;
}

std::optional<PlacedBox> EntityShapes::BoxOf(const content::Entity& entity,
                                             const Eigen::Vector3d& eye_in_map) {
  const bool is_model = entity.kind == content::Entity::Kind::kModel;
  const auto model = is_model ? bent_models_.ShapeOf(entity.model) : ModelOf(entity.signpost);
  if (!model) return std::nullopt;
  PlacedBox box;
  box.map_from_box = TransformOf(entity, eye_in_map);
  for (int axis = 0; axis < 3; ++axis) {
    box.low[axis] = model->bounds_min[axis];
    box.high[axis] = model->bounds_max[axis];
  }
  return box;
}

content::PickOptions EntityShapes::PickOptionsAt(double seconds) {
  content::PickOptions options;
  options.seconds = seconds;
  options.model_shape = [this](const content::PlacedModel& placed) { return bent_models_.ShapeOf(placed); };
  options.signpost_model = [this](const content::Signpost& signpost) { return ModelOf(signpost); };
  options.signpost_pose = SignpostPose;
  return options;
}

}  // namespace docent::ui
