// SPDX-License-Identifier: Apache-2.0
#include "ui/entity_shapes.h"

#include "ui/label_board.h"
#include "ui/occluder_model.h"
#include "ui/signpost_model.h"
#include "ui/sound_marker.h"
#include "ui/trail_model.h"

namespace docent::ui {
namespace {

// Relative to the first point, so that a trail that is only moved keeps its model.
std::vector<double> TrailKey(const content::Trail& trail) {
  std::vector<double> key = {trail.width, trail.up.x(), trail.up.y(), trail.up.z()};
  for (const Eigen::Vector3d& point : trail.points) {
    for (const double coordinate : point - trail.points.front()) key.push_back(coordinate);
  }
  return key;
}

std::vector<double> OccluderKey(const content::Occluder& occluder) {
  const Eigen::Vector3d& size = occluder.size;
  std::vector<double> key = {static_cast<double>(occluder.shape), size.x(), size.y(), size.z()};
  for (const Eigen::Vector2d& point : occluder.outline) key.insert(key.end(), {point.x(), point.y()});
  return key;
}

}  // namespace

engine::Sim3 TransformOf(const content::Entity& entity, const Eigen::Vector3d& eye_in_map) {
  return entity.kind == content::Entity::Kind::kSignpost ? SignpostPose(entity.signpost, eye_in_map)
                                                         : content::PoseOf(entity);
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

template <typename Key, typename Make>
std::shared_ptr<const content::Model> EntityShapes::Kept(std::map<Key, Shape>* shapes, const Key& key,
                                                         const Make& make) {
  Shape& shape = (*shapes)[key];
  if (!shape.model) shape.model = make();
  shape.last_frame = frame_;
  return shape.model;
}

content::EntityShape EntityShapes::ShapeOf(const content::Entity& entity, const Eigen::Vector3d& eye_in_map) {
  switch (entity.kind) {
    case content::Entity::Kind::kModel:
    case content::Entity::Kind::kImage:
      return {bent_models_.ShapeOf(entity.model), entity.model.map_from_model};
    case content::Entity::Kind::kSignpost: {
      const std::string& text = content::ShownText(entity, language_);
      const auto make = [&] { return MakeSignpostModel(text, entity.signpost.to_map); };
      return {Kept(&signs_, std::pair(text, entity.signpost.to_map), make),
              SignpostPose(entity.signpost, eye_in_map)};
    }
    case content::Entity::Kind::kLabel: {
      const std::string& text = content::ShownText(entity, language_);
      return {Kept(&labels_, text, [&] { return LabelBoardShape(text); }),
              LabelPose(entity.label, eye_in_map)};
    }
    case content::Entity::Kind::kSound:
      return {SoundMarkerModel(), SoundMarkerPose(entity.sound, eye_in_map)};
    case content::Entity::Kind::kTrail: {
      engine::Sim3 pose;
      pose.translation = content::PlaceOf(entity);
      return {Kept(&trails_, TrailKey(entity.trail), [&] { return MakeTrailModel(entity.trail); }), pose};
    }
    case content::Entity::Kind::kOccluder: {
      const auto make = [&] { return MakeOccluderModel(entity.occluder); };
      return {Kept(&occluders_, OccluderKey(entity.occluder), make), entity.occluder.map_from_shape};
    }
  }
  return {};
}

content::EntityShape EntityShapes::ArrowOf(const content::Entity& entity) {
  if (entity.kind != content::Entity::Kind::kSignpost || !entity.signpost.direction) return {};
  return {SignpostArrowModel(), SignpostArrowPose(entity.signpost)};
}

void EntityShapes::EndFrame() {
  constexpr std::uint64_t kLifeFrames = 300;
  bent_models_.EndFrame();
  const auto is_old = [&](const auto& shape) { return shape.second.last_frame + kLifeFrames < frame_; };
  std::erase_if(signs_, is_old);
  std::erase_if(labels_, is_old);
  std::erase_if(trails_, is_old);
  std::erase_if(occluders_, is_old);
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
