// SPDX-License-Identifier: Apache-2.0
#include "content/scene_codec.h"

#include <set>

#include "engine/base/error.h"
#include "engine/base/utf8.h"

namespace docent::content {
namespace {

// With keys: 38 for each entity, 13 at most for each point that bends a model, 4 for each point of a trail
// or polygon, and 2 for each translation.
constexpr std::size_t kMaxSceneValues =
    100 + 38 * kMaxEntities + 14 * kMaxSceneWarpPoints + 4 * kMaxSceneTrailPoints + 2 * kMaxSceneTranslations;

struct ParsedScene {
  Json json;
  int version = 0;
};

// Returns the parsed text after checking its version and the types of its two lists.
ParsedScene ParseScene(std::string_view text, std::string_view where) {
  LoadLimits limits;
  limits.max_json_values = kMaxSceneValues;
  ParsedScene parsed{ParseGltfJson(where, text, limits)};
  const Json& json = parsed.json;
  CheckMembers(where, "the scene", json, {"docent_scene", "assets", "entities", "settings"});
  for (const char* name : {"docent_scene", "assets", "entities"}) {
    if (!json.contains(name)) Refuse(where, "the scene", "has no " + std::string(name) + ".");
  }
  const Json& version = json["docent_scene"];
  if (!version.is_number_unsigned() || version.get<std::uint64_t>() == 0)
    Refuse(where, "", "the scene has no valid version.");
  if (version.get<std::uint64_t>() > kSceneVersion)
    Refuse(where, "", "the scene was written by a newer version of Docent.");
  parsed.version = version.get<int>();
  if (!json["assets"].is_array() || !json["entities"].is_array()) {
    Refuse(where, "", "the scene's assets and entities are not lists.");
  }
  if (json["entities"].size() > kMaxEntities) Refuse(where, "", "the scene has too many entities.");
  if (parsed.version < 3 && json.contains("settings"))
    Refuse(where, "", "the scene has settings, which its version does not know.");
  return parsed;
}

}  // namespace

std::string EncodeScene(const Scene& scene) {
  if (const std::string problem = Validate(scene); !problem.empty()) throw Error(problem);
  std::set<std::string> assets;
  Json entities = Json::array();
  for (const Entity& entity : scene.entities) {
    if (const auto asset = AssetOf(entity)) assets.insert(asset->id);
    entities.push_back(EntityToJson(entity));
  }
  Json json{{"docent_scene", kSceneVersion}, {"assets", assets}, {"entities", entities}};
  if (scene.settings != MapSettings()) json["settings"] = SettingsToJson(scene.settings);
  return json.dump();
}

std::vector<std::string> SceneAssetIds(std::string_view text) {
  const ParsedScene parsed = ParseScene(text, "scene");
  std::vector<std::string> ids;
  for (const Json& id : parsed.json["assets"]) {
    if (!id.is_string()) Refuse("scene", "assets", "is not a list of strings.");
    ids.push_back(id.get<std::string>());
  }
  return ids;
}

Scene DecodeScene(std::string_view text, std::string_view where, const AssetLookup& find_asset) {
  const ParsedScene parsed = ParseScene(text, where);
  Scene scene;
  if (parsed.json.contains("settings"))
    scene.settings = SettingsFromJson(where, "settings", parsed.json["settings"]);
  std::set<std::string> names;
  const Json& entities = parsed.json["entities"];
  for (std::size_t i = 0; i < entities.size(); ++i) {
    const std::string place = Place("entities", i);
    Entity entity = EntityFromJson(where, place, entities[i], parsed.version, find_asset);
    if (!names.insert(entity.name).second) Refuse(where, place, "has the name of another entity.");
    scene.entities.push_back(std::move(entity));
  }
  return scene;
}

Scene ReadScene(std::string_view text, std::string_view where, const AssetLookup& find_asset,
                std::vector<std::string>* problems) {
  const ParsedScene parsed = ParseScene(text, where);
  Scene scene;
  try {
    if (parsed.json.contains("settings"))
      scene.settings = SettingsFromJson(where, "settings", parsed.json["settings"]);
  } catch (const Error& error) {
    problems->emplace_back(error.what());
  }
  std::set<std::string> names;
  SceneTally tally;
  const Json& entities = parsed.json["entities"];
  for (std::size_t i = 0; i < entities.size(); ++i) {
    const std::string place = Place("entities", i);
    try {
      Entity entity = EntityFromJson(where, place, entities[i], parsed.version, find_asset);
      if (names.contains(entity.name)) {
        const std::string name = scene.FreeName("entity-" + std::to_string(i + 1));
        problems->push_back(std::string(where) + ": " + place +
                            " has the name of another entity and is now called '" + name + "'.");
        entity.name = name;
      }
      if (const std::string problem = tally.Add(entity); !problem.empty())
        Refuse(where, place, "is left out. " + problem);
      names.insert(entity.name);
      scene.entities.push_back(std::move(entity));
    } catch (const Error& error) {
      const Json& source = entities[i];
      const bool has_name = source.is_object() && source.contains("name") && source["name"].is_string();
      problems->push_back(
          std::string(error.what()) +
          (has_name ? " It was called '" + Shortened(source["name"].get<std::string>(), 80) + "'." : ""));
    }
  }
  return scene;
}

}  // namespace docent::content
