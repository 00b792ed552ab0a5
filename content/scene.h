// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "content/model.h"
#include "engine/geometry/sim3.h"

// The content of one map.
namespace docent::content {

// A glTF file as the library stores it: one self-contained GLB, identified by the hash of its bytes.
struct Asset {
  std::string id;    // Lower-case hex of a hash of `glb` with at least 128 bits.
  std::string name;  // The file's name without its folder, for display.
  std::vector<std::uint8_t> glb;
  std::shared_ptr<const Model> model;
};

// A model in a map. map_from_model transforms from glTF axes (y up) to the map.
struct PlacedModel {
  std::shared_ptr<const Asset> asset;
  engine::Sim3 map_from_model;
  int animation = 0;  // None if it is -1 or out of range.
};

// A board with text that rotates about its `up` axis to face the reader; `anchor` is its foot in the map.
struct Signpost {
  std::string text;
  Eigen::Vector3d anchor = Eigen::Vector3d::Zero();
  Eigen::Vector3d up = -Eigen::Vector3d::UnitY();  // Unit vector in the map.
  double height_m = 0.1;                           // Height of the board, in map units.
  std::string to_map;                              // Name of the map it leads to, empty for none.
};

// An entity with a name that is unique in its scene ("helmet", "helmet-2", "sign-1").
struct Entity {
  std::string name;
  enum class Kind { kModel, kSignpost } kind = Kind::kSignpost;
  PlacedModel model;
  Signpost signpost;
};

// The position of an entity's foot in the map.
Eigen::Vector3d PlaceOf(const Entity& entity);
// Transforms an entity after its anchor has moved in the map by `motion`.
void MoveWithAnchor(const engine::Sim3& motion, Entity* entity);

// A value type with cheap copies (assets are shared), so that edits change a copy that then replaces the
// original.
struct Scene {
  std::vector<Entity> entities;  // In the order of placement.

  const Entity* Find(const std::string& name) const;
  // Returns the first unused name of "base", "base-2", "base-3" …
  std::string FreeName(const std::string& base) const;
};

}  // namespace docent::content
