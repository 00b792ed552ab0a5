// SPDX-License-Identifier: Apache-2.0
#include "content/entity_codec.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "content/object_reader.h"
#include "content/warp.h"
#include "engine/base/error.h"

namespace docent::content {
namespace {

Json VectorToJson(const Eigen::Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}

Json WarpToJson(const Warp& warp) {
  Json controls = Json::array(), weights = Json::array(), affine = Json::array();
  for (const Eigen::Vector3d& control : warp.controls) controls.push_back(VectorToJson(control));
  for (const Eigen::Vector3d& weight : warp.weights) weights.push_back(VectorToJson(weight));
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) affine.push_back(warp.affine(row, column));
  }
  return {{"controls_m", controls}, {"weights", weights}, {"affine", affine}};
}

Warp ReadWarp(std::string_view where, const std::string& place, const Json& json) {
  CheckMembers(where, place, json, {"controls_m", "weights", "affine"});
  const ObjectReader reader(where, place, json);
  Warp warp;
  warp.controls = reader.Vectors("controls_m", kMaxWarpPoints, kMaxWarpNumber);
  warp.weights = reader.Vectors("weights", kMaxWarpPoints, kMaxWarpNumber);
  const Eigen::Matrix<double, 12, 1> affine = reader.Vector<12>("affine", kMaxWarpNumber);
  warp.affine = Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(affine.data());
  if (const std::string problem = Validate(warp); !problem.empty()) Refuse(where, place, problem + ".");
  return warp;
}

void ReadModel(std::string_view where, const std::string& place, const Json& json, int version,
               const AssetLookup& find_asset, Entity* entity) {
  if (version == 1) {
    CheckMembers(where, place, json, {"kind", "name", "asset", "animation", "map_from_model"});
  } else {
    CheckMembers(
        where, place, json,
        {"kind", "name", "asset", "animation", "map_from_model", "warp", "locked", "hidden", "group"});
  }
  const ObjectReader reader(where, place, json);
  entity->kind = Entity::Kind::kModel;
  const std::string id = reader.Text("asset");
  entity->model.asset = find_asset(id);
  if (!entity->model.asset)
    Refuse(where, place, "uses the asset " + id.substr(0, 64) + ", which does not exist.");
  const double animation = reader.Number("animation", -1, kMaxAnimation);
  if (animation != std::floor(animation)) Refuse(where, place + ".animation", "is not an integer.");
  entity->model.animation = static_cast<int>(animation);
  const std::string pose_place = place + ".map_from_model";
  CheckMembers(where, pose_place, reader.Member("map_from_model"),
               {"rotation_xyzw", "translation_m", "scale"});
  const ObjectReader pose(where, pose_place, reader.Member("map_from_model"));
  const Eigen::Vector4d q = pose.UnitVector<4>("rotation_xyzw");
  entity->model.map_from_model.rotation = engine::Rotation3(Eigen::Quaterniond(q[3], q[0], q[1], q[2]));
  entity->model.map_from_model.translation = pose.Vector<3>("translation_m", kMaxCoordinate);
  entity->model.map_from_model.scale = pose.Number("scale", kMinModelScale, kMaxModelScale);
  if (version > 1 && json.contains("warp"))
    entity->model.warp = std::make_shared<Warp>(ReadWarp(where, place + ".warp", json["warp"]));
}

void ReadSignpost(std::string_view where, const std::string& place, const Json& json, int version,
                  Entity* entity) {
  if (version == 1) {
    CheckMembers(where, place, json, {"kind", "name", "text", "anchor_m", "up", "height_m", "to_map"});
  } else if (version == 2) {
    CheckMembers(where, place, json,
                 {"kind", "name", "text", "anchor_m", "up", "height_m", "to_map", "to_key", "locked",
                  "hidden", "group"});
  } else {
    CheckMembers(where, place, json,
                 {"kind", "name", "text", "translations", "anchor_m", "up", "height_m", "to_map", "to_key",
                  "locked", "hidden", "group"});
  }
  const ObjectReader reader(where, place, json);
  entity->kind = Entity::Kind::kSignpost;
  entity->signpost.text = reader.Text("text");
  entity->signpost.anchor = reader.Vector<3>("anchor_m", kMaxCoordinate);
  entity->signpost.up = reader.UnitVector<3>("up");
  entity->signpost.height_m = reader.Number("height_m", kMinBoardHeight, kMaxBoardHeight);
  entity->signpost.to_map = reader.Text("to_map");
  if (version > 1) entity->signpost.to_key = reader.Key("to_key");
  if (version > 2) entity->signpost.translations = reader.TextByLanguage("translations");
}

}  // namespace

void CheckMembers(std::string_view where, std::string_view place, const Json& object,
                  std::initializer_list<std::string_view> members) {
  if (!object.is_object()) Refuse(where, place, "is not a JSON object.");
  for (const auto& [name, value] : object.items()) {
    if (std::find(members.begin(), members.end(), name) == members.end()) {
      Refuse(where, place,
             "has a member '" + name.substr(0, 40) + "' that this version of Docent does not know.");
    }
  }
}

Json EntityToJson(const Entity& entity) {
  Json json{
      {"name", entity.name}, {"locked", entity.locked}, {"hidden", entity.hidden}, {"group", entity.group}};
  if (entity.kind == Entity::Kind::kSignpost) {
    const Signpost& signpost = entity.signpost;
    json.update({{"kind", "signpost"},
                 {"text", signpost.text},
                 {"anchor_m", VectorToJson(signpost.anchor)},
                 {"up", VectorToJson(signpost.up)},
                 {"height_m", signpost.height_m},
                 {"to_map", signpost.to_map},
                 {"to_key", signpost.to_key}});
    if (!signpost.translations.empty()) json["translations"] = signpost.translations;
    return json;
  }
  const engine::Sim3& pose = entity.model.map_from_model;
  const Eigen::Quaterniond& q = pose.rotation.quaternion();
  json.update({{"kind", "model"},
               {"asset", entity.model.asset ? entity.model.asset->id : ""},
               {"animation", entity.model.animation},
               {"map_from_model",
                {{"rotation_xyzw", {q.x(), q.y(), q.z(), q.w()}},
                 {"translation_m", VectorToJson(pose.translation)},
                 {"scale", pose.scale}}}});
  if (entity.model.warp) json["warp"] = WarpToJson(*entity.model.warp);
  return json;
}

Entity EntityFromJson(std::string_view where, const std::string& place, const Json& json, int version,
                      const AssetLookup& find_asset) {
  const auto kind = json.is_object() ? json.find("kind") : json.end();
  const bool has_kind = json.is_object() && kind != json.end();
  const bool is_model = has_kind && *kind == "model";
  if (!is_model && !(has_kind && *kind == "signpost"))
    Refuse(where, place, "is neither a model nor a signpost.");
  Entity entity;
  if (is_model) {
    ReadModel(where, place, json, version, find_asset, &entity);
  } else {
    ReadSignpost(where, place, json, version, &entity);
  }
  const ObjectReader reader(where, place, json);
  entity.name = reader.Text("name");
  if (entity.name.empty()) Refuse(where, place, "has an empty name.");
  if (version > 1) {
    entity.locked = reader.Truth("locked");
    entity.hidden = reader.Truth("hidden");
    entity.group = reader.Text("group");
  }
  if (version > 2) {
    if (const std::string problem = Validate(entity); !problem.empty()) Refuse(where, place, problem + ".");
  }
  return entity;
}

}  // namespace docent::content
