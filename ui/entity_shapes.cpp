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
  Shape& sign = signs_[{signpost.text, signpost.to_map}];
  if (!sign.model) sign.model = MakeSignpostModel(signpost);
  sign.last_frame = frame_;
  return sign.model;
}

content::EntityShape EntityShapes::ShapeOf(const content::Entity& entity, const Eigen::Vector3d& eye_in_map) {
  const bool is_model = entity.kind == content::Entity::Kind::kModel;
  return {is_model ? bent_models_.ShapeOf(entity.model) : ModelOf(entity.signpost),
          TransformOf(entity, eye_in_map)};
}

void EntityShapes::EndFrame() {
  constexpr std::uint64_t kLifeFrames = 300;
  bent_models_.EndFrame();
  std::erase_if(signs_, [&](const auto& sign) { return sign.second.last_frame + kLifeFrames < frame_; });
  ++frame_;
}

std::optional<PlacedBox> EntityShapes::BoxOf(const content::Entity& entity,
                                             const Eigen::Vector3d& eye_in_map) {
  const content::EntityShape shape = ShapeOf(entity, eye_in_map);
  if (!shape.model) return std::nullopt;
  PlacedBox box;
  box.map_from_box = shape.map_from_model;
  for (int axis = 0; axis < 3; ++axis) {
    box.low[axis] = shape.model->bounds_min[axis];
    box.high[axis] = shape.model->bounds_max[axis];
  }
  return box;
}

content::PickOptions EntityShapes::PickOptionsAt(double seconds) {
  content::PickOptions options;
  options.seconds = seconds;
  options.shape = [this](const content::Entity& entity, const Eigen::Vector3d& eye) {
    return ShapeOf(entity, eye);
  };
  return options;
}

}  // namespace docent::ui
