// SPDX-License-Identifier: Apache-2.0
#include "maps/hub/sync_merge.h"

#include <algorithm>

#include "engine/base/error.h"
#include "maps/hub/sha256.h"

namespace docent::maps {

namespace {

// Moves the content of a map into a resolution.
void TakeContent(const MapFacts& facts, const Manifest& manifest, LocalMap* into) {
  std::erase_if(into->manifest, [](const auto& entry) { return IsContentItem(entry.first); });
  into->facts.asset_names = facts.asset_names;
  for (const auto& [item, hash] : manifest) {
    if (IsContentItem(item)) into->manifest[item] = hash;
  }
}

void TakeStructure(const MapFacts& facts, const Manifest& manifest, LocalMap* into) {
  std::erase_if(into->manifest, [](const auto& entry) { return !IsContentItem(entry.first); });
  for (const auto& [item, hash] : manifest) {
    if (!IsContentItem(item)) into->manifest[item] = hash;
  }
  MapInfo& info = into->facts.info;
  info.revision = facts.info.revision;
  info.next_keyframe = facts.info.next_keyframe;
  info.next_point = facts.info.next_point;
  info.keyframes = facts.info.keyframes;
  info.points = facts.info.points;
  info.observations = facts.info.observations;
}

// Returns false if the scenes cannot be merged.
bool MergeContent(const MapLink& base, const LocalMap& mine, const HubRevision& theirs,
                  const std::string& their_scene, const MergeScenes& merge, Resolution* resolution) {
  const std::string my_scene = SceneOf(mine.items);
  if (my_scene == their_scene || (base.revision > 0 && my_scene == base.scene)) return true;
  if (base.revision > 0 && their_scene == base.scene) {
    TakeContent(mine.facts, mine.manifest, &resolution->map);
    return true;
  }
  if (!merge) return false;
  MergedScene merged;
  try {
    merged = merge(base.scene, my_scene, their_scene);
  } catch (const Error&) {
    return false;
  }
  LocalMap& map = resolution->map;
  std::erase_if(map.manifest, [](const auto& entry) { return IsContentItem(entry.first); });
  map.facts.asset_names.clear();
  map.items["scene"] = Bytes(merged.text.begin(), merged.text.end());
  map.manifest["scene"] = HashOf(merged.text);
  for (const std::string& id : merged.asset_ids) {
    const bool is_theirs = theirs.manifest.contains("asset/" + id);
    const Manifest& source = is_theirs ? theirs.manifest : mine.manifest;
    const MapFacts& facts = is_theirs ? theirs.facts : mine.facts;
    if (!source.contains("asset/" + id) || !facts.asset_names.contains(id)) return false;
    map.manifest["asset/" + id] = source.at("asset/" + id);
    map.facts.asset_names[id] = facts.asset_names.at(id);
  }
  resolution->conflicts = merged.conflicts;
  return true;
}

}  // namespace

std::string SceneOf(const ItemBytes& items) {
  const auto scene = items.find("scene");
  return scene == items.end() ? "" : std::string(scene->second.begin(), scene->second.end());
}

Resolution Resolve(const MapLink& base, const LocalMap& mine, const HubRevision& theirs,
                   const std::string& their_scene, const MergeScenes& merge) {
  Resolution resolution;
  LocalMap& map = resolution.map;
  map.facts = theirs.facts;
  map.manifest = theirs.manifest;
  map.items = mine.items;
  map.facts.info.key = mine.facts.info.key;
  const std::string ours = StructureDigest(mine.facts, mine.manifest);
  const std::string hubs = StructureDigest(theirs.facts, theirs.manifest);
  if (ours != hubs && ours != base.structure) {
    if (hubs != base.structure) {
      resolution.needs_two_maps = true;
      return resolution;
    }
    TakeStructure(mine.facts, mine.manifest, &map);
  }
  if (!MergeContent(base, mine, theirs, their_scene, merge, &resolution)) {
    resolution.needs_two_maps = true;
    return resolution;
  }
  if (base.revision > 0 && theirs.facts.info.name == base.name) map.facts.info.name = mine.facts.info.name;
  if (base.revision > 0 && ToString(theirs.facts.info.policy) == base.policy) {
    map.facts.info.policy = mine.facts.info.policy;
    map.facts.info.bounds = mine.facts.info.bounds;
  }
  map.facts.info.modified = std::max(mine.facts.info.modified, theirs.facts.info.modified);
  return resolution;
}

}  // namespace docent::maps
