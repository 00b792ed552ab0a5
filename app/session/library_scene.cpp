// SPDX-License-Identifier: Apache-2.0
#include "app/session/library_scene.h"

#include <algorithm>
#include <set>
#include <utility>

#include "content/asset.h"
#include "content/history_codec.h"
#include "content/scene_codec.h"
#include "content/scene_merge.h"
#include "engine/base/error.h"

namespace docent::app {

namespace {

content::AssetLookup LookupIn(const AssetCache& assets) {
  return [&assets](const std::string& id) {
    const auto found = assets.find(id);
    return found == assets.end() ? nullptr : found->second;
  };
}

void DecodeAsset(const maps::AssetRecord& stored, AssetCache* assets) {
  if (!stored.bytes || assets->contains(stored.id)) return;
  (*assets)[stored.id] =
      std::make_shared<content::Asset>(content::AssetFromBytes(stored.name, *stored.bytes));
}

maps::AssetRecord RecordOf(const std::shared_ptr<const content::Asset>& asset) {
  return {asset->id, asset->name, std::shared_ptr<const maps::Bytes>(asset, &asset->bytes)};
}

// Encoding writes only the ids of assets, so their bytes are not needed.
std::shared_ptr<const content::Asset> AssetWithoutBytes(const std::string& id) {
  auto asset = std::make_shared<content::Asset>();
  asset->id = id;
  return asset;
}

content::Scene SceneWithoutModels(const std::string& text) {
  return content::DecodeScene(text, "its content", AssetWithoutBytes);
}

// Returns whether the signpost leads elsewhere now.
bool RetargetSignpost(const std::string& name, const maps::Retarget& retarget, content::Signpost* signpost) {
  const auto target = retarget(name, {signpost->to_key, signpost->to_map});
  if (!target) return false;
  signpost->to_key = target->key;
  signpost->to_map = target->map;
  if (*target == maps::SignpostTarget()) content::LeadNowhere(signpost);
  return true;
}

std::optional<std::string> RetargetScene(const std::string& text, const maps::Retarget& retarget) {
  if (text.empty()) return std::nullopt;
  content::Scene scene = SceneWithoutModels(text);
  bool changed = false;
  for (content::Entity& entity : scene.entities) {
    if (entity.kind != content::Entity::Kind::kSignpost) continue;
    changed = RetargetSignpost(entity.name, retarget, &entity.signpost) || changed;
  }
  return changed ? std::optional(content::EncodeScene(scene)) : std::nullopt;
}

std::optional<std::string> RetargetHistory(const std::string& text, const maps::Retarget& retarget) {
  content::EditHistory history = content::DecodeHistory(text, "its undo history", AssetWithoutBytes);
  const bool changed = history.RetargetSignposts(
      [&](content::Signpost* signpost) { return RetargetSignpost("", retarget, signpost); });
  return changed ? std::optional(content::EncodeHistory(history, maps::kMaxHistoryTextBytes)) : std::nullopt;
}

maps::SceneRecord ReadScene(const maps::SceneRecord& record, std::vector<std::string>* problems) {
  AssetCache assets;
  std::vector<std::string> found;
  const content::Scene scene = ReadableScene(record, "its content", &assets, &found);
  if (found.empty()) return record;
  problems->insert(problems->end(), found.begin(), found.end());
  const bool is_empty = scene.entities.empty() && scene.settings == content::MapSettings();
  return is_empty ? maps::SceneRecord() : RecordFromScene(scene);
}

// The newest changes whose models, as far as the scene does not use them, fit into the limit.
content::EditHistory WithinAssetLimit(const content::EditHistory& history, const content::Scene& scene) {
  std::set<std::string> counted;
  for (const content::Entity& entity : scene.entities) {
    if (const auto asset = content::AssetOf(entity)) counted.insert(asset->id);
  }
  std::size_t bytes = 0;
  // From the end, for the last change is the next one that is undone or redone.
  const auto newest = [&](const std::vector<content::SceneChange>& changes) {
    auto first = changes.end();
    while (first != changes.begin()) {
      for (const auto& asset : content::EditHistory({*std::prev(first)}, {}).Assets()) {
        if (counted.insert(asset->id).second) bytes += asset->bytes.size();
      }
      if (bytes > maps::kMaxHistoryAssetBytes) break;
      --first;
    }
    return std::vector<content::SceneChange>(first, changes.end());
  };
  std::vector<content::SceneChange> done = newest(history.done());
  if (bytes > maps::kMaxHistoryAssetBytes) return {std::move(done), {}};
  return {std::move(done), newest(history.undone())};
}

}  // namespace

content::Scene SceneFromRecord(const maps::SceneRecord& record, const std::string& where,
                               AssetCache* assets) {
  if (record.text.empty()) return {};
  for (const maps::AssetRecord& stored : record.assets) DecodeAsset(stored, assets);
  return content::DecodeScene(record.text, where, LookupIn(*assets));
}

content::Scene ReadableScene(const maps::SceneRecord& record, const std::string& where, AssetCache* assets,
                             std::vector<std::string>* problems) {
  if (record.text.empty()) return {};
  for (const maps::AssetRecord& stored : record.assets) {
    try {
      DecodeAsset(stored, assets);
    } catch (const Error& error) {
      problems->push_back(where + ": the file '" + stored.name + "' cannot be read: " + error.what());
    }
  }
  try {
    return content::ReadScene(record.text, where, LookupIn(*assets), problems);
  } catch (const Error& error) {
    problems->emplace_back(error.what());
    return {};
  }
}

maps::SceneRecord RecordFromScene(const content::Scene& scene) {
  maps::SceneRecord record;
  record.text = content::EncodeScene(scene);
  std::set<std::string> seen;
  for (const content::Entity& entity : scene.entities) {
    const std::shared_ptr<const content::Asset> asset = content::AssetOf(entity);
    if (asset && seen.insert(asset->id).second) record.assets.push_back(RecordOf(asset));
  }
  return record;
}

maps::SceneRecord RecordFromHistory(const content::EditHistory& history, const content::Scene& scene) {
  const content::EditHistory kept = WithinAssetLimit(history, scene);
  maps::SceneRecord record;
  record.text = content::EncodeHistory(kept, maps::kMaxHistoryTextBytes);
  if (record.text.empty()) return record;
  const std::vector<std::string> ids = content::HistoryAssetIds(record.text);
  for (const std::shared_ptr<const content::Asset>& asset : kept.Assets()) {
    if (std::find(ids.begin(), ids.end(), asset->id) != ids.end()) record.assets.push_back(RecordOf(asset));
  }
  return record;
}

content::EditHistory HistoryFromRecord(const maps::SceneRecord& record, const std::string& where,
                                       AssetCache* assets) {
  for (const maps::AssetRecord& stored : record.assets) {
    try {
      DecodeAsset(stored, assets);
    } catch (const Error&) {
      continue;
    }
  }
  return content::DecodeHistory(record.text, where, LookupIn(*assets));
}

maps::SceneTools LibrarySceneTools() {
  return {ReadScene, RetargetScene, RetargetHistory};
}

maps::MergeScenes LibrarySceneMerger() {
  return [](const std::string& base, const std::string& mine, const std::string& theirs) {
    const auto read = [](const std::string& text) {
      return text.empty() ? content::Scene() : SceneWithoutModels(text);
    };
    const content::SceneMerge merge = content::MergeScenes(read(base), read(mine), read(theirs));
    maps::MergedScene merged;
    merged.text = content::EncodeScene(merge.scene);
    merged.asset_ids = content::SceneAssetIds(merged.text);
    merged.conflicts = merge.conflicts;
    return merged;
  };
}

maps::SyncOptions SyncOptionsOf(const std::string& hub, const std::filesystem::path& library) {
  maps::SyncOptions options;
  options.hub = hub;
  options.library = library;
  options.scenes = LibrarySceneTools();
  options.merge = LibrarySceneMerger();
  return options;
}

maps::Library OpenLibrary(const std::filesystem::path& path, maps::Access access,
                          maps::CreateIfMissing create) {
  maps::LibraryOptions options;
  options.scenes = LibrarySceneTools();
  return maps::Library::Open(path, access, create, std::move(options));
}

}  // namespace docent::app
