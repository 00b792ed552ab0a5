// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "content/bent_models.h"
#include "content/picking.h"
#include "content/scene.h"
#include "engine/geometry/sim3.h"

namespace docent::ui {

// The pose of an entity as commands give it: that of a model; of a signpost its foot and height, with the
// rotation in which a reader at eye_in_map sees it.
engine::Sim3 TransformOf(const content::Entity& entity, const Eigen::Vector3d& eye_in_map);
// Sets it. Of a signpost only foot and height change.
void SetTransform(const engine::Sim3& map_from_entity, content::Entity* entity);

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

// The shapes of entities in the image. It keeps the models of signposts, whose texts take long to lay out, as
// long as they are asked for. One thread.
class EntityShapes {
 public:
  // What is drawn of an entity for a reader at eye_in_map.
  content::EntityShape ShapeOf(const content::Entity& entity, const Eigen::Vector3d& eye_in_map);
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
  std::shared_ptr<const content::Model> ModelOf(const content::Signpost& signpost);

  content::BentModels bent_models_;
  std::map<std::pair<std::string, std::string>, Shape> signs_;  // By text and target map.
  std::uint64_t frame_ = 0;
};

}  // namespace docent::ui
