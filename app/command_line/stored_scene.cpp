// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/stored_scene.h"

#include <algorithm>
#include <set>
#include <utility>
#include <vector>

#include "app/session/library_scene.h"
#include "content/scene_codec.h"
#include "engine/base/error.h"

namespace docent::app {

namespace {

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

}  // namespace

std::string WhereStored(const maps::Library& library, const maps::MapInfo& map) {
  return library.file() + ", map '" + map.name + "'";
}

content::Scene StoredNames(const maps::Library& library, const maps::MapInfo& map) {
  return DecodeNames(library.LoadScene(map.key), WhereStored(library, map));
}

void EditStoredScene(maps::Library* library, const maps::MapInfo& map, std::span<const MakeEdit> edits,
                     ModelsNeeded needed, const std::shared_ptr<const content::Asset>& added) {
  const maps::SceneRecord stored = library->LoadScene(map.key);
  const std::string where = WhereStored(*library, map);
  AssetCache assets;
  content::Scene scene =
      needed == ModelsNeeded::kYes ? SceneFromRecord(stored, where, &assets) : DecodeNames(stored, where);
  try {
    for (const MakeEdit& edit : edits) content::ApplyChange(edit(scene), &scene);
  } catch (const Error& error) {
    throw Error(where + ": " + error.what());
  }
  auto changed = std::make_shared<maps::SceneRecord>();
  changed->text = content::EncodeScene(scene);
  const std::vector<std::string> ids = content::SceneAssetIds(changed->text);
  const std::set<std::string> used(ids.begin(), ids.end());
  std::set<std::string> kept;
  for (const maps::AssetRecord& asset : stored.assets) {
    if (used.contains(asset.id) && kept.insert(asset.id).second) changed->assets.push_back(asset);
  }
  if (added && kept.insert(added->id).second)
    changed->assets.push_back({added->id, added->name, {added, &added->bytes}});
  maps::MapRecord record;
  record.key = map.key;
  record.name = map.name;
  record.policy = map.policy;
  record.scene = std::move(changed);
  library->Save(record);
}

}  // namespace docent::app
