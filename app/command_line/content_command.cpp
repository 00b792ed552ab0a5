// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "app/command_line/content_add_command.h"
#include "app/command_line/content_edit_command.h"
#include "app/command_line/program.h"
#include "app/command_line/stored_scene.h"
#include "app/command_line/text_table.h"
#include "app/session/library_scene.h"
#include "content/edits.h"
#include "content/occluder.h"
#include "maps/library/library.h"
#include "maps/library/session_lock.h"

namespace docent::app {

namespace {

using Json = nlohmann::ordered_json;

struct ContentOptions {
  std::filesystem::path library;
  std::string map;
  std::vector<std::string> names;
  bool as_json = false;
};

// `languages`: those of all texts of the library.
Json ToJson(const maps::MapInfo& map, const content::Entity& entity, const std::set<std::string>& languages) {
  using Kind = content::Entity::Kind;
  const Eigen::Vector3d place = content::PlaceOf(entity);
  Json json = {{"map", map.name}, {"name", entity.name}, {"kind", content::NameOf(entity.kind)}};
  if (const auto asset = content::AssetOf(entity)) json["file"] = asset->name;
  if (const std::string* const text = content::TextOf(entity)) {
    json["text"] = *text;
    json["translations"] = *content::TranslationsOf(entity);
    json["missing_languages"] = content::MissingLanguages(entity, languages);
  }
  json["position"] = {place.x(), place.y(), place.z()};
  if (content::HasModel(entity)) json["scale"] = entity.model.map_from_model.scale;
  if (entity.kind == Kind::kModel) json["bent"] = entity.model.warp != nullptr;
  if (entity.kind == Kind::kSignpost) {
    json["to_map"] = entity.signpost.to_map;
    json["direction"] = nullptr;
    if (const auto& direction = entity.signpost.direction)
      json["direction"] = {direction->x(), direction->y(), direction->z()};
  }
  if (entity.kind == Kind::kSound) json["range"] = entity.sound.range;
  if (entity.kind == Kind::kTrail) {
    json["width"] = entity.trail.width;
    json["points"] = Json::array();
    for (const Eigen::Vector3d& point : entity.trail.points)
      json["points"].push_back({point.x(), point.y(), point.z()});
  }
  if (entity.kind == Kind::kOccluder) {
    const content::Occluder& occluder = entity.occluder;
    json["shape"] = content::NameOf(occluder.shape);
    json["scale"] = occluder.map_from_shape.scale;
    if (occluder.shape != content::Occluder::Shape::kPolygon)
      json["size"] = {occluder.size.x(), occluder.size.y(), occluder.size.z()};
  }
  json["locked"] = entity.locked;
  json["hidden"] = entity.hidden;
  json["group"] = entity.group;
  return json;
}

// What a line of the list says about an entity beside its name and kind.
std::string Summary(const Json& entry) {
  std::string summary;
  if (entry.contains("text")) summary = entry["text"].get<std::string>();
  if (entry.contains("file"))
    summary = entry["file"].get<std::string>() + (summary.empty() ? "" : ": " + summary);
  if (entry.contains("shape")) summary = entry["shape"].get<std::string>();
  if (entry.contains("points")) summary = std::to_string(entry["points"].size()) + " points";
  return summary;
}

// What else it says: "  (locked, hidden)". A signpost that leads to a map should say in which direction, and
// a text should have a variant in each language of the library.
std::string StateOf(const Json& entry) {
  std::string state;
  const auto add = [&](const char* word) { state += (state.empty() ? "" : ", ") + std::string(word); };
  if (entry["locked"] == true) add("locked");
  if (entry["hidden"] == true) add("hidden");
  if (!entry.value("to_map", "").empty() && entry["direction"].is_null()) add("no direction");
  const Json missing = entry.value("missing_languages", Json::array());
  for (const Json& language : missing) add(("not in " + language.get<std::string>()).c_str());
  return state.empty() ? "" : "  (" + state + ")";
}

void List(const ContentOptions& options) {
  const maps::Library library = OpenLibrary(options.library, maps::Access::kReadOnly);
  const std::uint64_t only = options.map.empty() ? 0 : library.FindByName(options.map).key;
  std::vector<std::pair<maps::MapInfo, content::Scene>> scenes;
  std::set<std::string> languages;
  for (const maps::MapInfo& map : library.List()) {
    scenes.emplace_back(map, StoredNames(library, map));
    languages.merge(content::LanguagesOf(scenes.back().second));
  }
  Json entries = Json::array();
  for (const auto& [map, scene] : scenes) {
    if (only != 0 && map.key != only) continue;
    for (const content::Entity& entity : scene.entities) entries.push_back(ToJson(map, entity, languages));
  }
  if (options.as_json) {
    std::printf("%s\n",
                Json{{"content", entries}}.dump(2, ' ', false, Json::error_handler_t::replace).c_str());
    return;
  }
  if (entries.empty()) std::puts("Nothing is placed in the maps.");
  std::vector<std::vector<std::string>> rows;
  for (const Json& entry : entries) {
    rows.push_back({entry["map"].get<std::string>(), entry["name"].get<std::string>(),
                    entry["kind"].get<std::string>(), Summary(entry) + StateOf(entry)});
  }
  std::fputs(FormatColumns({{24}, {24}, {8}, {}}, rows).c_str(), stdout);
}

void Remove(const ContentOptions& options) {
  maps::Library library = OpenLibrary(options.library, maps::Access::kReadWrite);
  const maps::SessionLock lock(options.library, maps::SessionLockKind::kReplace);
  const MakeEdit edits[] = {
      [&](const content::Scene& stored) { return content::RemoveEdit(stored, options.names); }};
  EditStoredScene(&library, library.FindByName(options.map), edits);
}

}  // namespace

void AddContentCommand(CLI::App* program, Invocation* invocation) {
  CLI::App* group =
      AddSubcommand(program, "content", "List, add, change or remove what is placed in the maps",
                    "docent content list --library museum.docent");
  group->require_subcommand(1);
  const auto options = std::make_shared<ContentOptions>();

  CLI::App* list = AddSubcommand(group, "list", "List what is placed",
                                 "docent content list --library museum.docent --map \"Desk 3\"");
  AddLibraryOption(list, LibraryUse::kRead, &options->library, invocation);
  list->add_option("--map", options->map, "Only the content of this map");
  list->add_flag("--json", options->as_json, "Print JSON");
  list->callback([=] { invocation->run = [=] { List(*options); }; });

  AddContentAddCommand(group, invocation);
  AddContentEditCommand(group, invocation);

  CLI::App* remove = AddSubcommand(group, "remove", "Remove what is placed",
                                   "docent content remove helmet --map \"Desk 3\" --library museum.docent");
  remove->add_option("NAME", options->names, "Names of what is removed")->required();
  remove->add_option("--map", options->map, "The map that contains it")->required();
  AddLibraryOption(remove, LibraryUse::kChange, &options->library, invocation);
  remove->callback([=] { invocation->run = [=] { Remove(*options); }; });
}

}  // namespace docent::app
