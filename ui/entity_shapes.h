// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "content/bent_models.h"
#include "content/picking.h"
#include "content/scene.h"
#include "engine/geometry/sim3.h"

namespace docent::ui {

// The pose of an entity as commands give it (content::PoseOf); of a signpost with the rotation in which a
// reader at eye_in_map sees it. content::SetPose sets it.
engine::Sim3 TransformOf(const content::Entity& entity, const Eigen::Vector3d& eye_in_map);

// A box with its pose in the map.
struct PlacedBox {
  engine::Sim3 map_from_box;
  Eigen::Vector3d low = Eigen::Vector3d::Zero(), high = Eigen::Vector3d::Zero();

  // The corner whose bits say for x, y and z whether it is the high side. Map coordinates.
  Eigen::Vector3d Corner(int bits) const;
  // The middles of the lower and the upper side. Map coordinates.
  Eigen::Vector3d Base() const;
  Eigen::Vector3d Top() const;
};

// The shapes of entities in the image. It keeps what takes long to make, as long as it is asked for: models
// of signposts and labels, whose texts are laid out, and of trails. One thread.
class EntityShapes {
 public:
  // `language`: that of the reader, for texts that have variants (content::TextFor).
  explicit EntityShapes(std::string language = {}) : language_(std::move(language)) {}

  // What is drawn of an entity for a reader at eye_in_map: of a label its board, of a sound and an
  // occluder what authors see of them.
  content::EntityShape ShapeOf(const content::Entity& entity, const Eigen::Vector3d& eye_in_map);
  // The arrow of a signpost with a direction, which is drawn beside its shape; without a model for what has
  // none.
  static content::EntityShape ArrowOf(const content::Entity& entity);
  // The bounding box in the rest pose, as a reader at eye_in_map sees it; empty without a model.
  std::optional<PlacedBox> BoxOf(const content::Entity& entity, const Eigen::Vector3d& eye_in_map);
  // Refers to this object.
  content::PickOptions PickOptionsAt(double seconds);
  // Forgets the shapes of bent models that were not asked for since the last call, and other shapes that were
  // not asked for since many calls.
  void EndFrame();

 private:
  struct Shape {
    std::shared_ptr<const content::Model> model;
    std::uint64_t last_frame = 0;
  };
  // The model under this key, which `make` makes if there is none.
  template <typename Key, typename Make>
  std::shared_ptr<const content::Model> Kept(std::map<Key, Shape>* shapes, const Key& key, const Make& make);

  const std::string language_;

  content::BentModels bent_models_;
  std::map<std::pair<std::string, std::string>, Shape> signs_;  // By text and target map.
  std::map<std::string, Shape> labels_;                         // By text.
  std::map<std::vector<double>, Shape> trails_, occluders_;     // By all numbers of their shape.
  std::uint64_t frame_ = 0;
};

}  // namespace docent::ui
