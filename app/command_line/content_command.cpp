// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>

#include "app/command_line/program.h"
#include "content/scene_codec.h"
#include "engine/base/error.h"
#include "maps/library.h"

namespace docent::app {

namespace {

using Json = nlohmann::ordered_json;

struct ContentOptions {
  std::filesystem::path library;
  std::string map, name;
  bool as_json = false;
};

// Decodes the scene with the names of its assets only, because listing and removing need no meshes.
content::Scene DecodeNames(const maps::SceneRecord& record, const std::string& where) {
  if (record.text.empty()) return {};
  return content::DecodeScene(record.text, where, [&](const std::string& id) {
    const auto found = std::find_if(record.assets.begin(), record.assets.end(),
                                    [&](const maps::AssetRecord& asset) { return asset.id == id; });
    if (found == record.assets.end()) return std::shared_ptr<const content::Asset>();
    auto asset = std::make_shared<content::Asset>();
    asset->id = found->id;
    asset->name = found->name;
    return std::shared_ptr<const content::Asset>(std::move(asset));
  });
}

std::string Where(const maps::Library& library, const maps::MapInfo& map) {
  return library.file() + ", map '" + map.name + "'";
}

Json ToJson(const maps::MapInfo& map, const content::Entity& entity) {
  Json json = {{"map", map.name}, {"name", entity.name}};
  if (entity.kind == content::Entity::Kind::kModel) {
    const Eigen::Vector3d& t = entity.model.map_from_model.translation;
    json["kind"] = "model";
    json["file"] = entity.model.asset ? entity.model.asset->name : std::string();
    json["position_m"] = {t.x(), t.y(), t.z()};
    json["scale"] = entity.model.map_from_model.scale;
  } else {
    const Eigen::Vector3d& anchor = entity.signpost.anchor;
    json["kind"] = "signpost";
    json["text"] = entity.signpost.text;
    json["position_m"] = {anchor.x(), anchor.y(), anchor.z()};
    json["to_map"] = entity.signpost.to_map;
  }
  return json;
}

void List(const ContentOptions& options) {
  const maps::Library library = maps::Library::Open(options.library, maps::Access::kReadOnly);
  std::vector<maps::MapInfo> infos;
  if (options.map.empty()) {
    infos = library.List();
  } else {
    infos.push_back(library.FindByName(options.map));
  }
  Json entries = Json::array();
  for (const maps::MapInfo& map : infos) {
    const content::Scene scene = DecodeNames(library.LoadScene(map.key), Where(library, map));
    for (const content::Entity& entity : scene.entities) entries.push_back(ToJson(map, entity));
  }
  if (options.as_json) {
    std::printf("%s\n",
                Json{{"content", entries}}.dump(2, ' ', false, Json::error_handler_t::replace).c_str());
    return;
  }
  if (entries.empty()) std::puts("The maps hold no models or signposts.");
  for (const Json& entry : entries) {
    const bool model = entry["kind"] == "model";
    std::printf("%-24s %-24s %-9s %s\n", entry["map"].get<std::string>().c_str(),
                entry["name"].get<std::string>().c_str(), entry["kind"].get<std::string>().c_str(),
                entry[model ? "file" : "text"].get<std::string>().c_str());
  }
}

void Remove(const ContentOptions& options) {
  maps::Library library = maps::Library::Open(options.library, maps::Access::kReadWrite);
  const maps::MapInfo map = library.FindByName(options.map);
  const maps::SceneRecord stored = library.LoadScene(map.key);
  content::Scene scene = DecodeNames(stored, Where(library, map));
  const std::size_t removed = std::erase_if(
      scene.entities, [&](const content::Entity& entity) { return entity.name == options.name; });
  if (removed == 0)
    throw Error(Where(library, map) + " has no model or signpost named '" + options.name + "'.");

  auto changed = std::make_shared<maps::SceneRecord>();
  changed->text = content::EncodeScene(scene);
  const std::vector<std::string> ids = content::SceneAssetIds(changed->text);
  const std::set<std::string> used(ids.begin(), ids.end());
  for (const maps::AssetRecord& asset : stored.assets) {
    if (used.contains(asset.id)) changed->assets.push_back(asset);
  }
  maps::MapRecord record;
  record.key = map.key;
  record.name = map.name;
  record.policy = map.policy;
  record.scene = std::move(changed);
  library.Save(record);
}

}  // namespace

void AddContentCommand(CLI::App* program, Invocation* invocation) {
  CLI::App* group = AddSubcommand(program, "content", "List or remove the models and signposts in the maps",
                                  "docent content list --library museum.docent");
  group->require_subcommand(1);
  const auto options = std::make_shared<ContentOptions>();

  CLI::App* list = AddSubcommand(group, "list", "List models and signposts",
                                 "docent content list --library museum.docent --map \"Desk 3\"");
  list->add_option("--library", options->library, "The library's file, NAME.docent")->required();
  list->add_option("--map", options->map, "Only the content of this map");
  list->add_flag("--json", options->as_json, "Print JSON");
  list->callback([=] { invocation->run = [=] { List(*options); }; });

  CLI::App* remove = AddSubcommand(group, "remove", "Remove a model or a signpost",
                                   "docent content remove helmet --map \"Desk 3\" --library museum.docent");
  remove->add_option("NAME", options->name, "Name of the model or signpost")->required();
  remove->add_option("--map", options->map, "The map that contains it")->required();
  remove->add_option("--library", options->library, "The library's file, NAME.docent")->required();
  remove->callback([=] { invocation->run = [=] { Remove(*options); }; });
}

}  // namespace docent::app
