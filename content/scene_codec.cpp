// SPDX-License-Identifier: Apache-2.0
#include "content/scene_codec.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <set>

#include "content/gltf/json.h"
#include "engine/base/error.h"

namespace docent::content {
namespace {

constexpr int kVersion = 1;

Json ToJson(const Eigen::Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}

Json ToJson(const Entity& entity) {
  Json json{{"name", entity.name}};
  if (entity.kind == Entity::Kind::kSignpost) {
    const Signpost& signpost = entity.signpost;
    json.update({{"kind", "signpost"},
                 {"text", signpost.text},
                 {"anchor_m", ToJson(signpost.anchor)},
                 {"up", ToJson(signpost.up)},
                 {"height_m", signpost.height_m},
                 {"to_map", signpost.to_map}});
    return json;
  }
  const engine::Sim3& pose = entity.model.map_from_model;
  const Eigen::Quaterniond& q = pose.rotation.quaternion();
  json.update({{"kind", "model"},
               {"asset", entity.model.asset ? entity.model.asset->id : ""},
               {"animation", entity.model.animation},
               {"map_from_model",
                {{"rotation_xyzw", {q.x(), q.y(), q.z(), q.w()}},
                 {"translation_m", ToJson(pose.translation)},
                 {"scale", pose.scale}}}});
  return json;
}

// Reads the members of one JSON object and rejects unknown members.
class ObjectReader {
 public:
  ObjectReader(std::string_view where, std::string place, const Json& object,
               std::initializer_list<std::string_view> members)
      : where_(where), place_(std::move(place)), object_(object) {
    if (!object.is_object()) Refuse(where_, place_, "is not a JSON object.");
    for (const auto& [name, value] : object.items()) {
      if (std::find(members.begin(), members.end(), name) == members.end()) {
        Refuse(where_, place_,
               "has a member '" + name.substr(0, 40) + "' that this version of Docent does not know.");
      }
    }
  }

  const Json& Member(const char* name) const {
    const auto found = object_.find(name);
    if (found == object_.end()) Refuse(where_, place_, "has no " + std::string(name) + ".");
    return *found;
  }

  std::string Text(const char* name) const {
    const Json& value = Member(name);
    if (!value.is_string() || value.get_ref<const std::string&>().size() > kMaxTextBytes) {
      Refuse(where_, place_ + "." + name,
             "is not a string of at most " + std::to_string(kMaxTextBytes) + " bytes.");
    }
    return value.get<std::string>();
  }

  double Number(const char* name, double least, double most) const {
    return AsNumber(Member(name), place_ + "." + name, least, most);
  }

  template <int N>
  Eigen::Matrix<double, N, 1> Vector(const char* name, double most) const {
    const Json& value = Member(name);
    const std::string place = place_ + "." + name;
    if (!value.is_array() || value.size() != N)
      Refuse(where_, place, "is not a list of " + std::to_string(N) + " numbers.");
    Eigen::Matrix<double, N, 1> vector;
    for (int k = 0; k < N; ++k) vector[k] = AsNumber(value[static_cast<std::size_t>(k)], place, -most, most);
    return vector;
  }

  // Reads a vector that must have length 1, up to rounding.
  template <int N>
  Eigen::Matrix<double, N, 1> UnitVector(const char* name) const {
    const Eigen::Matrix<double, N, 1> vector = Vector<N>(name, 2);
    if (std::abs(vector.norm() - 1) > 1e-3) Refuse(where_, place_ + "." + name, "does not have length 1.");
    return vector;
  }

 private:
  double AsNumber(const Json& value, const std::string& place, double least, double most) const {
    const double number = value.is_number() ? value.get<double>() : std::nan("");
    if (!(number >= least && number <= most)) Refuse(where_, place, "is not a number in its range.");
    return number;
  }

  std::string_view where_;
  std::string place_;
  const Json& object_;
};

Entity ReadModel(std::string_view where, const std::string& place, const Json& json,
                 const AssetLookup& find_asset) {
  const ObjectReader reader(where, place, json, {"kind", "name", "asset", "animation", "map_from_model"});
  Entity entity;
  entity.kind = Entity::Kind::kModel;
  entity.name = reader.Text("name");
  const std::string id = reader.Text("asset");
  entity.model.asset = find_asset(id);
  if (!entity.model.asset)
    Refuse(where, place, "uses the asset " + id.substr(0, 64) + ", which does not exist.");
  const double animation = reader.Number("animation", -1, kMaxAnimation);
  if (animation != std::floor(animation)) Refuse(where, place + ".animation", "is not an integer.");
  entity.model.animation = static_cast<int>(animation);
  const ObjectReader pose(where, place + ".map_from_model", reader.Member("map_from_model"),
                          {"rotation_xyzw", "translation_m", "scale"});
  const Eigen::Vector4d q = pose.UnitVector<4>("rotation_xyzw");
  entity.model.map_from_model.rotation = engine::Rotation3(Eigen::Quaterniond(q[3], q[0], q[1], q[2]));
  entity.model.map_from_model.translation = pose.Vector<3>("translation_m", kMaxCoordinate);
  entity.model.map_from_model.scale = pose.Number("scale", kMinModelScale, kMaxModelScale);
  return entity;
}

Entity ReadSignpost(std::string_view where, const std::string& place, const Json& json) {
  const ObjectReader reader(where, place, json,
                            {"kind", "name", "text", "anchor_m", "up", "height_m", "to_map"});
  Entity entity;
  entity.kind = Entity::Kind::kSignpost;
  entity.name = reader.Text("name");
  entity.signpost.text = reader.Text("text");
  entity.signpost.anchor = reader.Vector<3>("anchor_m", kMaxCoordinate);
  entity.signpost.up = reader.UnitVector<3>("up");
  entity.signpost.height_m = reader.Number("height_m", kMinBoardHeight, kMaxBoardHeight);
  entity.signpost.to_map = reader.Text("to_map");
  return entity;
}

// Returns the parsed text after checking its version and the types of its two lists.
Json ParseScene(std::string_view text, std::string_view where) {
  Json json = ParseGltfJson(where, text, LoadLimits{});
  const ObjectReader reader(where, "the scene", json, {"docent_scene", "assets", "entities"});
  if (reader.Number("docent_scene", 0, 1e6) != kVersion) {
    Refuse(where, "", "the scene was written by a newer version of Docent.");
  }
  if (!reader.Member("assets").is_array() || !reader.Member("entities").is_array()) {
    Refuse(where, "", "the scene's assets and entities are not lists.");
  }
  if (json["entities"].size() > kMaxEntities) Refuse(where, "", "the scene has too many entities.");
  return json;
}

}  // namespace

std::string EncodeScene(const Scene& scene) {
  if (const std::string problem = Validate(scene); !problem.empty()) throw Error(problem);
  std::set<std::string> assets;
  Json entities = Json::array();
  for (const Entity& entity : scene.entities) {
    if (entity.kind == Entity::Kind::kModel && entity.model.asset) assets.insert(entity.model.asset->id);
    entities.push_back(ToJson(entity));
  }
  const Json json{{"docent_scene", kVersion}, {"assets", assets}, {"entities", entities}};
  return json.dump();
}

std::vector<std::string> SceneAssetIds(std::string_view text) {
  const Json json = ParseScene(text, "scene");
  std::vector<std::string> ids;
  for (const Json& id : json["assets"]) {
    if (!id.is_string()) Refuse("scene", "assets", "is not a list of strings.");
    ids.push_back(id.get<std::string>());
  }
  return ids;
}

Scene DecodeScene(std::string_view text, std::string_view where, const AssetLookup& find_asset) {
  const Json json = ParseScene(text, where);
  Scene scene;
  std::set<std::string> names;
  for (std::size_t i = 0; i < json["entities"].size(); ++i) {
    const Json& source = json["entities"][i];
    const std::string place = Place("entities", i);
    const auto kind = source.is_object() ? source.find("kind") : source.end();
    const bool is_model = source.is_object() && kind != source.end() && *kind == "model";
    const bool is_signpost = source.is_object() && kind != source.end() && *kind == "signpost";
    if (!is_model && !is_signpost) Refuse(where, place, "is neither a model nor a signpost.");
    Entity entity =
        is_model ? ReadModel(where, place, source, find_asset) : ReadSignpost(where, place, source);
    if (entity.name.empty()) Refuse(where, place, "has an empty name.");
    if (!names.insert(entity.name).second) Refuse(where, place, "has the name of another entity.");
    scene.entities.push_back(std::move(entity));
  }
  return scene;
}

}  // namespace docent::content
