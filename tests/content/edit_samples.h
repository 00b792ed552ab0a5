// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "content/scene.h"

// A scene of three entities for tests of edits.
namespace docent::content {

inline std::shared_ptr<const Asset> AssetNamed(const std::string& id) {
  auto asset = std::make_shared<Asset>();
  asset->id = id;
  return asset;
}

inline Entity ModelEntity(const std::string& name) {
  Entity entity;
  entity.name = name;
  entity.kind = Entity::Kind::kModel;
  entity.model.asset = AssetNamed("fox");
  entity.model.map_from_model.translation = {1, 2, 3};
  entity.model.map_from_model.scale = 2;
  return entity;
}

inline Entity SignEntity(const std::string& name) {
  Entity entity;
  entity.name = name;
  entity.signpost.text = "To the \"cat\"";
  entity.signpost.to_map = "Desk 3";
  entity.signpost.to_key = 7;
  return entity;
}

inline Scene ThreeEntities() {
  Scene scene;
  scene.entities = {ModelEntity("helmet"), SignEntity("sign-1"), ModelEntity("old fox")};
  return scene;
}

// A model with a bounding box only, 2 m wide, 1 m high and 4 m deep, whose base is at (1, -1, 2).
inline std::shared_ptr<const Asset> AssetWithBox(const std::string& id) {
  auto model = std::make_shared<Model>();
  model->bounds_min = {0, -1, 0};
  model->bounds_max = {2, 0, 4};
  auto asset = std::make_shared<Asset>();
  asset->id = id;
  asset->model = std::move(model);
  return asset;
}

}  // namespace docent::content
