// SPDX-License-Identifier: Apache-2.0
#include "content/entity_codec.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "content/object_reader.h"
#include "content/occluder.h"
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

Json PoseToJson(const engine::Sim3& pose) {
  const Eigen::Quaterniond& q = pose.rotation.quaternion();
  return {{"rotation_xyzw", {q.x(), q.y(), q.z(), q.w()}},
          {"translation_m", VectorToJson(pose.translation)},
          {"scale", pose.scale}};
}

engine::Sim3 ReadPose(std::string_view where, const std::string& place, const Json& json) {
  CheckMembers(where, place, json, {"rotation_xyzw", "translation_m", "scale"});
  const ObjectReader reader(where, place, json);
  const Eigen::Vector4d xyzw = reader.UnitVector<4>("rotation_xyzw");
  const Eigen::Quaterniond q(xyzw);
  // What was written is read to the bit; only what a person or another program wrote is normalized.
  constexpr double kRounding = 1e-12;
  const bool is_unit = std::abs(q.squaredNorm() - 1) < kRounding;
  engine::Sim3 pose;
  pose.rotation = is_unit ? engine::Rotation3::FromUnit(q) : engine::Rotation3(q);
  pose.translation = reader.Vector<3>("translation_m", kMaxCoordinate);
  pose.scale = reader.Number("scale", kMinModelScale, kMaxModelScale);
  return pose;
}

std::shared_ptr<const Asset> ReadAsset(std::string_view where, const std::string& place,
                                       const ObjectReader& reader, const AssetLookup& find_asset) {
  const std::string id = reader.Text("asset");
  auto asset = find_asset(id);
  if (!asset) Refuse(where, place, "uses the asset " + id.substr(0, 64) + ", which does not exist.");
  return asset;
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
  entity->model.asset = ReadAsset(where, place, reader, find_asset);
  const double animation = reader.Number("animation", -1, kMaxAnimation);
  if (animation != std::floor(animation)) Refuse(where, place + ".animation", "is not an integer.");
  entity->model.animation = static_cast<int>(animation);
  entity->model.map_from_model = ReadPose(where, place + ".map_from_model", reader.Member("map_from_model"));
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
  } else if (version == 3) {
    CheckMembers(where, place, json,
                 {"kind", "name", "text", "translations", "anchor_m", "up", "height_m", "to_map", "to_key",
                  "locked", "hidden", "group"});
  } else {
    CheckMembers(where, place, json,
                 {"kind", "name", "text", "translations", "anchor_m", "up", "height_m", "to_map", "to_key",
                  "direction", "locked", "hidden", "group"});
  }
  const ObjectReader reader(where, place, json);
  entity->signpost.text = reader.Text("text");
  entity->signpost.anchor = reader.Vector<3>("anchor_m", kMaxCoordinate);
  entity->signpost.up = reader.UnitVector<3>("up");
  entity->signpost.height = reader.Number("height_m", kMinBoardHeight, kMaxBoardHeight);
  entity->signpost.to_map = reader.Text("to_map");
  if (version > 1) entity->signpost.to_key = reader.Key("to_key");
  if (version > 2) entity->signpost.translations = reader.TextByLanguage("translations");
  if (json.contains("direction")) entity->signpost.direction = reader.UnitVector<3>("direction");
}

void ReadLabel(std::string_view where, const std::string& place, const Json& json, Entity* entity) {
  CheckMembers(where, place, json,
               {"kind", "name", "text", "translations", "anchor_m", "offset_m", "up", "text_height_m",
                "locked", "hidden", "group"});
  const ObjectReader reader(where, place, json);
  Label& label = entity->label;
  label.text = reader.Text("text");
  label.translations = reader.TextByLanguage("translations");
  label.anchor = reader.Vector<3>("anchor_m", kMaxCoordinate);
  label.offset = reader.Vector<3>("offset_m", kMaxCoordinate);
  label.up = reader.UnitVector<3>("up");
  label.text_height = reader.Number("text_height_m", kMinBoardHeight, kMaxBoardHeight);
}

void ReadImage(std::string_view where, const std::string& place, const Json& json,
               const AssetLookup& find_asset, Entity* entity) {
  CheckMembers(where, place, json, {"kind", "name", "asset", "map_from_image", "locked", "hidden", "group"});
  const ObjectReader reader(where, place, json);
  entity->model.asset = ReadAsset(where, place, reader, find_asset);
  entity->model.map_from_model = ReadPose(where, place + ".map_from_image", reader.Member("map_from_image"));
}

void ReadSound(std::string_view where, const std::string& place, const Json& json,
               const AssetLookup& find_asset, Entity* entity) {
  CheckMembers(where, place, json,
               {"kind", "name", "asset", "caption", "translations", "position_m", "range_m", "locked",
                "hidden", "group"});
  const ObjectReader reader(where, place, json);
  Sound& sound = entity->sound;
  sound.asset = ReadAsset(where, place, reader, find_asset);
  sound.caption = reader.Text("caption");
  sound.translations = reader.TextByLanguage("translations");
  sound.position = reader.Vector<3>("position_m", kMaxCoordinate);
  sound.range = reader.Number("range_m", kMinSoundRange, kMaxSoundRange);
}

void ReadTrail(std::string_view where, const std::string& place, const Json& json, Entity* entity) {
  CheckMembers(where, place, json,
               {"kind", "name", "points_m", "up", "width_m", "locked", "hidden", "group"});
  const ObjectReader reader(where, place, json);
  Trail& trail = entity->trail;
  trail.points = reader.Vectors("points_m", kMaxTrailPoints, kMaxCoordinate);
  trail.up = reader.UnitVector<3>("up");
  trail.width = reader.Number("width_m", kMinTrailWidth, kMaxTrailWidth);
}

Occluder::Shape ReadShape(std::string_view where, const std::string& place, const std::string& name) {
  using Shape = Occluder::Shape;
  for (const Shape known : {Shape::kPlane, Shape::kBox, Shape::kCylinder, Shape::kPolygon}) {
    if (name == NameOf(known)) return known;
  }
  Refuse(where, place + ".shape", "is neither plane, box, cylinder nor polygon.");
}

void ReadOccluder(std::string_view where, const std::string& place, const Json& json, Entity* entity) {
  const ObjectReader reader(where, place, json);
  Occluder& occluder = entity->occluder;
  occluder.shape = ReadShape(where, place, reader.Text("shape"));
  const bool is_polygon = occluder.shape == Occluder::Shape::kPolygon;
  CheckMembers(where, place, json,
               {"kind", "name", "shape", is_polygon ? "outline" : "size", "map_from_shape", "locked",
                "hidden", "group"});
  occluder.map_from_shape = ReadPose(where, place + ".map_from_shape", reader.Member("map_from_shape"));
  if (is_polygon) {
    occluder.size.setZero();
    occluder.outline = reader.Vectors<2>("outline", kMaxOutlinePoints, kMaxCoordinate);
  } else {
    occluder.size = reader.Vector<3>("size", kMaxOccluderSide);
  }
}

// The kind of an entity; signposts and models are the only kinds before version 3, and there are no occluders
// before version 6.
Entity::Kind ReadKind(std::string_view where, const std::string& place, const Json& json, int version) {
  using Kind = Entity::Kind;
  const auto kind = json.is_object() ? json.find("kind") : json.end();
  if (json.is_object() && kind != json.end()) {
    for (const Kind known : {Kind::kModel, Kind::kSignpost, Kind::kLabel, Kind::kImage, Kind::kSound,
                             Kind::kTrail, Kind::kOccluder}) {
      const bool is_old = known == Kind::kModel || known == Kind::kSignpost;
      const int first_version = is_old ? 1 : known == Kind::kOccluder ? 6 : 3;
      if (version >= first_version && *kind == NameOf(known)) return known;
    }
  }
  Refuse(where, place, "is neither a model nor of another kind that can be placed.");
}

Json KindToJson(const Signpost& signpost) {
  Json json{{"text", signpost.text},           {"anchor_m", VectorToJson(signpost.anchor)},
            {"up", VectorToJson(signpost.up)}, {"height_m", signpost.height},
            {"to_map", signpost.to_map},       {"to_key", signpost.to_key}};
  if (signpost.direction) json["direction"] = VectorToJson(*signpost.direction);
  return json;
}

Json KindToJson(const Label& label) {
  return {{"text", label.text},
          {"anchor_m", VectorToJson(label.anchor)},
          {"offset_m", VectorToJson(label.offset)},
          {"up", VectorToJson(label.up)},
          {"text_height_m", label.text_height}};
}

Json KindToJson(const Sound& sound) {
  return {{"asset", sound.asset ? sound.asset->id : ""},
          {"caption", sound.caption},
          {"position_m", VectorToJson(sound.position)},
          {"range_m", sound.range}};
}

Json KindToJson(const Trail& trail) {
  Json points = Json::array();
  for (const Eigen::Vector3d& point : trail.points) points.push_back(VectorToJson(point));
  return {{"points_m", points}, {"up", VectorToJson(trail.up)}, {"width_m", trail.width}};
}

Json KindToJson(const Occluder& occluder) {
  Json json{{"shape", NameOf(occluder.shape)}, {"map_from_shape", PoseToJson(occluder.map_from_shape)}};
  if (occluder.shape != Occluder::Shape::kPolygon) {
    json["size"] = VectorToJson(occluder.size);
    return json;
  }
  json["outline"] = Json::array();
  for (const Eigen::Vector2d& point : occluder.outline) json["outline"].push_back({point.x(), point.y()});
  return json;
}

Json KindToJson(const PlacedModel& model, bool is_image) {
  Json json{{"asset", model.asset ? model.asset->id : ""},
            {is_image ? "map_from_image" : "map_from_model", PoseToJson(model.map_from_model)}};
  if (!is_image) json["animation"] = model.animation;
  if (model.warp) json["warp"] = WarpToJson(*model.warp);
  return json;
}

Json KindToJson(const Entity& entity) {
  switch (entity.kind) {
    case Entity::Kind::kModel:
      return KindToJson(entity.model, false);
    case Entity::Kind::kSignpost:
      return KindToJson(entity.signpost);
    case Entity::Kind::kLabel:
      return KindToJson(entity.label);
    case Entity::Kind::kImage:
      return KindToJson(entity.model, true);
    case Entity::Kind::kSound:
      return KindToJson(entity.sound);
    case Entity::Kind::kTrail:
      return KindToJson(entity.trail);
    case Entity::Kind::kOccluder:
      return KindToJson(entity.occluder);
  }
  return {};
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
  Json json{{"kind", NameOf(entity.kind)},
            {"name", entity.name},
            {"locked", entity.locked},
            {"hidden", entity.hidden},
            {"group", entity.group}};
  json.update(KindToJson(entity));
  const Translations* const translations = TranslationsOf(entity);
  if (translations != nullptr && !translations->empty()) json["translations"] = *translations;
  return json;
}

Entity EntityFromJson(std::string_view where, const std::string& place, const Json& json, int version,
                      const AssetLookup& find_asset) {
  Entity entity;
  entity.kind = ReadKind(where, place, json, version);
  switch (entity.kind) {
    case Entity::Kind::kModel:
      ReadModel(where, place, json, version, find_asset, &entity);
      break;
    case Entity::Kind::kSignpost:
      ReadSignpost(where, place, json, version, &entity);
      break;
    case Entity::Kind::kLabel:
      ReadLabel(where, place, json, &entity);
      break;
    case Entity::Kind::kImage:
      ReadImage(where, place, json, find_asset, &entity);
      break;
    case Entity::Kind::kSound:
      ReadSound(where, place, json, find_asset, &entity);
      break;
    case Entity::Kind::kTrail:
      ReadTrail(where, place, json, &entity);
      break;
    case Entity::Kind::kOccluder:
      ReadOccluder(where, place, json, &entity);
      break;
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
