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

inline Entity LabelEntity(const std::string& name) {
  Entity entity;
  entity.name = name;
  entity.kind = Entity::Kind::kLabel;
  entity.label.text = "Löwe";
  entity.label.translations = {{"es", "león"}};
  entity.label.anchor = {1, 0.1, 3};
  entity.label.offset = {0.1, -0.4, 1.0 / 3};
  entity.label.up = Eigen::Vector3d(0.1, -1, 0.2).normalized();
  entity.label.text_height = 0.07;
  return entity;
}

inline Entity ImageEntity(const std::string& name) {
  Entity entity = ModelEntity(name);
  entity.kind = Entity::Kind::kImage;
  entity.model.asset = AssetNamed("plan");
  entity.model.map_from_model.rotation = engine::Rotation3::Exp({0.3, -0.2, 0.9});
  return entity;
}

inline Entity SoundEntity(const std::string& name) {
  Entity entity;
  entity.name = name;
  entity.kind = Entity::Kind::kSound;
  entity.sound.asset = AssetNamed("roar");
  entity.sound.caption = "The lion roars.";
  entity.sound.translations = {{"de", "Der Löwe brüllt."}};
  entity.sound.position = {-2, 0.3, 1};
  entity.sound.range = 1.7;
  return entity;
}

inline Entity TrailEntity(const std::string& name) {
  Entity entity;
  entity.name = name;
  entity.kind = Entity::Kind::kTrail;
  entity.trail.points = {{0, 1, 0}, {0.5, 1, 1.0 / 3}, {1, 1.1, 2}};
  entity.trail.up = Eigen::Vector3d(0, -1, 0.1).normalized();
  entity.trail.width = 0.2;
  return entity;
}

inline Entity OccluderEntity(const std::string& name, Occluder::Shape shape = Occluder::Shape::kBox) {
  Entity entity;
  entity.name = name;
  entity.kind = Entity::Kind::kOccluder;
  entity.occluder.shape = shape;
  entity.occluder.map_from_shape = {engine::Rotation3::Exp({0.1, 0.7, -0.3}), {0.2, 1.0 / 3, 2}, 1.1};
  entity.occluder.size = {1, 0.7, 0.6};
  if (shape == Occluder::Shape::kPlane) entity.occluder.size.z() = 0;
  if (shape == Occluder::Shape::kCylinder) entity.occluder.size.z() = entity.occluder.size.x();
  if (shape == Occluder::Shape::kPolygon) {
    entity.occluder.size.setZero();
    entity.occluder.outline = {{0, 0}, {1, 0}, {1, 1.0 / 3}, {0.5, 0.1}, {0, 1}};
  }
  return entity;
}

// One entity of each kind; of an occluder, two.
inline Scene AllKinds() {
  Scene scene;
  scene.entities = {ModelEntity("helmet"),        SignEntity("sign-1"),
                    LabelEntity("label-1"),       ImageEntity("plan"),
                    SoundEntity("roar"),          TrailEntity("trail-1"),
                    OccluderEntity("occluder-1"), OccluderEntity("occluder-2", Occluder::Shape::kPolygon)};
  return scene;
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
