// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "content/model.h"
#include "engine/geometry/sim3.h"

// What stands in one map.
namespace docent::content {

// A glTF file as it is kept in the library: one self-contained GLB, named by the hash of its bytes.
struct Asset {
  std::string id;    // lower-case hex of a 128-bit or longer hash of `glb`
  std::string name;  // the file's name without folder, for people
  std::vector<std::uint8_t> glb;
  std::shared_ptr<const Model> model;
};

// A model standing in a map. map_from_model maps glTF axes (y up) into the map.
struct PlacedModel {
  std::shared_ptr<const Asset> asset;
  engine::Sim3 map_from_model;
  int animation = 0;  // -1: none; out of range: none
};

// A board with text that turns about its `up` axis to face the reader; `anchor` is its foot in the map.
struct Signpost {
  std::string text;
  Eigen::Vector3d anchor = Eigen::Vector3d::Zero();
  Eigen::Vector3d up = -Eigen::Vector3d::UnitY();  // unit, in the map
  double height_m = 0.1;                           // of the board, metres of the map
  std::string to_map;                              // name of the map it points to, empty for none
};

// One thing with a name that is unique in its scene ("helmet", "helmet-2", "sign-1").
struct Entity {
  std::string name;
  enum class Kind { kModel, kSignpost } kind = Kind::kSignpost;
  PlacedModel model;
  Signpost signpost;
};

// The foot that an entity stands on, in the map.
Eigen::Vector3d PlaceOf(const Entity& entity);
// Takes an entity along with its ground, which has moved in the map by `motion`.
void MoveAlong(const engine::Sim3& motion, Entity* entity);

// Value type: copies are cheap (assets are shared), so that edits are made on a copy and swapped in whole.
struct Scene {
  std::vector<Entity> entities;  // in the order they were placed

  const Entity* Find(const std::string& name) const;
  // "base", or "base-2", "base-3" … whichever is free.
  std::string FreeName(const std::string& base) const;
};

}  // namespace docent::content
