// SPDX-License-Identifier: Apache-2.0
#include "maps/library/scene_storage.h"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "engine/base/error.h"
#include "maps/library/policy_refusal.h"
#include "maps/storage/checksum.h"
#include "maps/storage/history_rows.h"
#include "maps/storage/map_codec.h"
#include "maps/storage/rows.h"

namespace docent::maps {

namespace {

ScenePart PartOf(const SceneRecord& scene) {
  ScenePart part{scene.text, {}};
  for (const AssetRecord& asset : scene.assets) {
    // Several entities of a scene may use the same asset.
    if (std::find(part.asset_ids.begin(), part.asset_ids.end(), asset.id) == part.asset_ids.end()) {
      part.asset_ids.push_back(asset.id);
    }
  }
  return part;
}

std::uint64_t SceneChecksum(const Database& database, std::uint64_t key) {
  return SceneTextChecksum(ReadScenePart(database, key).text);
}

}  // namespace

SceneRecord ReadScene(const Database& database, std::uint64_t key) {
  ScenePart part = ReadScenePart(database, key);
  SceneRecord scene{std::move(part.text), {}};
  for (const std::string& id : part.asset_ids) scene.assets.push_back(ReadAsset(database, id));
  return scene;
}

SceneRecord ReadUndamagedScene(const Database& database, std::uint64_t key,
                               std::vector<std::string>* problems) {
  SceneRecord scene;
  try {
    ScenePart part = ReadScenePart(database, key);
    scene.text = std::move(part.text);
    for (const std::string& id : part.asset_ids) {
      try {
        scene.assets.push_back(ReadAsset(database, id));
      } catch (const Error& error) {
        problems->emplace_back(error.what());
      }
    }
  } catch (const Error& error) {
    problems->emplace_back(error.what());
  }
  return scene;
}

std::uint64_t ReadableSceneChecksum(const Database& database, std::uint64_t key) {
  std::string text;
  try {
    text = ReadScenePart(database, key).text;
  } catch (const Error&) {
    text.clear();  // Verify reports it.
  }
  return SceneTextChecksum(text);
}

void WriteScene(const Database& database, std::uint64_t key, const SceneRecord& scene) {
  for (const AssetRecord& asset : scene.assets) WriteAsset(database, asset);
  WriteScenePart(database, key, PartOf(scene));
}

void WriteSceneText(const Database& database, std::uint64_t key, const std::string& text) {
  ScenePart scene = ReadScenePart(database, key);
  std::optional<HistoryPart> history;
  try {
    history = ReadHistory(database, key);
  } catch (const Error&) {
    history.reset();  // It stays as it is, and Verify reports it.
  }
  const bool fits = history && history->scene == SceneTextChecksum(scene.text);
  scene.text = text;
  WriteScenePart(database, key, scene);
  if (!fits) return;
  history->scene = SceneTextChecksum(text);
  WriteHistory(database, key, *history);
}

bool UpdateScene(const Database& database, const SceneRecord& scene, const MapInfo& info) {
  if (ReadScenePart(database, info.key) == PartOf(scene)) return false;
  if (!MayChangeContent(info.policy)) Refuse(info.policy, "its content cannot be changed");
  WriteScene(database, info.key, scene);
  RemoveHistory(database, info.key);  // It belongs to the scene before.
  RemoveUnusedAssets(database);
  return true;
}

std::optional<SceneRecord> ReadSceneHistory(const Database& database, std::uint64_t key) {
  std::optional<HistoryPart> part = ReadHistory(database, key);
  if (!part || part->scene != SceneChecksum(database, key)) return std::nullopt;
  SceneRecord history{std::move(part->changes.text), {}};
  for (const std::string& id : part->changes.asset_ids) history.assets.push_back(ReadAsset(database, id));
  return history;
}

std::optional<std::string> FindHistoryText(const Database& database, std::uint64_t key) {
  try {
    const std::optional<HistoryPart> part = ReadHistory(database, key);
    if (part && part->scene == SceneChecksum(database, key)) return part->changes.text;
  } catch (const Error&) {
    return std::nullopt;  // Verify reports it.
  }
  return std::nullopt;
}

void WriteHistoryText(const Database& database, std::uint64_t key, const std::string& text) {
  if (text.empty()) {
    RemoveHistory(database, key);
    RemoveUnusedAssets(database);
    return;
  }
  HistoryPart history = ReadHistory(database, key).value();
  history.changes.text = text;
  WriteHistory(database, key, history);
}

void WriteSceneHistory(const Database& database, std::uint64_t key, const SceneRecord& history) {
  const std::vector<std::string> of_scene = ReadScenePart(database, key).asset_ids;
  std::size_t bytes = 0;
  for (const AssetRecord& asset : history.assets) {
    const bool shared = std::find(of_scene.begin(), of_scene.end(), asset.id) != of_scene.end();
    if (!shared && asset.bytes) bytes += asset.bytes->size();
  }
  if (bytes > kMaxHistoryAssetBytes)
    throw Error("the models of its undo history have more than " +
                std::to_string(kMaxHistoryAssetBytes >> 20) + " MiB");
  for (const AssetRecord& asset : history.assets) WriteAsset(database, asset);
  WriteHistory(database, key, {SceneChecksum(database, key), PartOf(history)});
}

bool UpdateSceneHistory(const Database& database, const SceneRecord& history, const MapInfo& info) {
  std::optional<HistoryPart> stored;
  try {
    stored = ReadHistory(database, info.key);
  } catch (const Error&) {
    stored.emplace();  // A damaged one is replaced or removed.
  }
  const ScenePart changes = PartOf(history);
  if (stored ? stored->changes == changes && stored->scene == SceneChecksum(database, info.key)
             : changes.text.empty())
    return false;
  if (!MayChangeContent(info.policy)) Refuse(info.policy, "its undo history cannot be changed");
  if (changes.text.empty()) {
    RemoveHistory(database, info.key);
  } else {
    WriteSceneHistory(database, info.key, history);
  }
  RemoveUnusedAssets(database);
  return true;
}

}  // namespace docent::maps
