// SPDX-License-Identifier: Apache-2.0
#include "app/session/library_scene.h"

#include <set>
#include <utility>

#include "content/asset.h"
#include "content/scene_codec.h"

namespace docent::app {

content::Scene SceneFromRecord(const maps::SceneRecord& record, const std::string& where,
                               AssetCache* assets) {
  if (record.text.empty()) return {};
  for (const maps::AssetRecord& stored : record.assets) {
    if (!stored.bytes || assets->contains(stored.id)) continue;
    (*assets)[stored.id] =
        std::make_shared<content::Asset>(content::AssetFromGlb(stored.name, *stored.bytes));
  }
  return content::DecodeScene(record.text, where, [&](const std::string& id) {
    const auto found = assets->find(id);
    return found == assets->end() ? nullptr : found->second;
  });
}

maps::SceneRecord RecordFromScene(const content::Scene& scene) {
  maps::SceneRecord record;
  record.text = content::EncodeScene(scene);
  std::set<std::string> seen;
  for (const content::Entity& entity : scene.entities) {
    const std::shared_ptr<const content::Asset>& asset = entity.model.asset;
    if (entity.kind != content::Entity::Kind::kModel || !seen.insert(asset->id).second) continue;
    record.assets.push_back({asset->id, asset->name, std::shared_ptr<const maps::Bytes>(asset, &asset->glb)});
  }
  return record;
}

}  // namespace docent::app
