// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/stored_scene.h"

#include <algorithm>
#include <cstdio>
#include <iterator>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "app/session/library_scene.h"
#include "content/scene_codec.h"
#include "engine/base/error.h"

namespace docent::app {

namespace {

content::Scene DecodeNames(const maps::SceneRecord& record, const std::string& where,
                           std::vector<std::string>* problems) {
  if (record.text.empty()) return {};
  const auto lookup = [&](const std::string& id) {
    const auto found = std::find_if(record.assets.begin(), record.assets.end(),
                                    [&](const maps::AssetRecord& asset) { return asset.id == id; });
    if (found == record.assets.end()) return std::shared_ptr<const content::Asset>();
    auto asset = std::make_shared<content::Asset>();
    asset->id = found->id;
    asset->name = found->name;
    return std::shared_ptr<const content::Asset>(std::move(asset));
  };
  return content::ReadScene(record.text, where, lookup, problems);
}

void Warn(const std::vector<std::string>& problems) {
  for (const std::string& problem : problems) std::fprintf(stderr, "Warning: %s\n", problem.c_str());
}

// The changes of earlier sessions. A damaged history costs nothing but itself.
content::EditHistory StoredHistory(const maps::Library& library, const maps::MapInfo& map, AssetCache* assets,
                                   std::vector<std::string>* problems) {
  const std::string where = WhereStored(library, map);
  try {
    if (const std::optional<maps::SceneRecord> record = library.LoadHistory(map.key))
      return HistoryFromRecord(*record, where, assets);
  } catch (const Error& error) {
    problems->push_back(where + ": earlier changes cannot be undone: " + error.what());
  }
  return {};
}

// The edits as one change: "move 'fox' and more".
content::SceneChange Combined(const content::Scene& scene, std::span<const MakeEdit> edits) {
  content::SceneChange combined;
  content::Scene edited = scene;
  for (const MakeEdit& edit : edits) {
    content::SceneChange change = edit(edited);
    content::ApplyChange(change, &edited);
    if (combined.label.empty()) combined.label = change.label + (edits.size() > 1 ? " and more" : "");
    std::move(change.entities.begin(), change.entities.end(), std::back_inserter(combined.entities));
  }
  return combined;
}

}  // namespace

std::string WhereStored(const maps::Library& library, const maps::MapInfo& map) {
  return library.file() + ", map '" + map.name + "'";
}

content::Scene StoredNames(const maps::Library& library, const maps::MapInfo& map) {
  std::vector<std::string> problems;
  const maps::SceneRecord record = library.LoadScene(map.key, &problems);
  content::Scene scene = DecodeNames(record, WhereStored(library, map), &problems);
  Warn(problems);
  return scene;
}

void EditStoredScene(maps::Library* library, const maps::MapInfo& map, std::span<const MakeEdit> edits) {
  const std::string where = WhereStored(*library, map);
  std::vector<std::string> problems;
  const maps::SceneRecord stored = library->LoadScene(map.key, &problems);
  AssetCache assets;
  content::Scene scene = ReadableScene(stored, where, &assets, &problems);
  // The changes of a history would not fit a scene that lacks entities.
  content::EditHistory history;
  if (problems.empty()) history = StoredHistory(*library, map, &assets, &problems);
  try {
    history.Do(Combined(scene, edits), &scene);
  } catch (const Error& error) {
    throw Error(where + ": " + error.what());
  }
  maps::MapRecord record;
  record.key = map.key;
  record.name = map.name;
  record.policy = map.policy;
  record.scene = std::make_shared<const maps::SceneRecord>(RecordFromScene(scene));
  record.history = std::make_shared<const maps::SceneRecord>(RecordFromHistory(history, scene));
  record.expected = map;
  if (!library->Save(record))
    throw Error(where + ": it was changed by another program meanwhile, and nothing was saved; try again.");
  Warn(problems);
}

}  // namespace docent::app
