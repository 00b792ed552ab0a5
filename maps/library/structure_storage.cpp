// SPDX-License-Identifier: Apache-2.0
#include "maps/library/structure_storage.h"

#include <string>
#include <unordered_set>

#include "engine/base/error.h"
#include "maps/index/thumbnail_rows.h"
#include "maps/index/word_rows.h"
#include "maps/library/policy_refusal.h"
#include "maps/storage/mesh_rows.h"
#include "maps/storage/rows.h"

namespace docent::maps {

namespace {

// Bundle adjustment may move a keyframe slightly after it was accepted inside the bounds and before it is
// saved.
constexpr double kBoundsSlack = 0.05;  // Ratio of the bounds' diagonal.

void CheckNewKeyFramesInside(const MapInfo& info, const MapParts& stored, const MapParts& wanted) {
  if (!info.bounds) throw Error("its policy is bounded but it has no bounds; set the policy again");
  std::unordered_set<engine::KeyFrameId> known;
  for (const StoredKeyFrame& keyframe : stored.keyframes) known.insert(keyframe.keyframe.id);
  const Bounds allowed = Expanded(*info.bounds, kBoundsSlack);
  for (const StoredKeyFrame& keyframe : wanted.keyframes) {
    if (known.contains(keyframe.keyframe.id) ||
        KeyFrameAllowed(Policy::kBounded, allowed, keyframe.keyframe.camera_from_map.OriginInSource())) {
      continue;
    }
    throw Error("its policy is bounded, and keyframe " + std::to_string(keyframe.keyframe.id) +
                " lies outside its bounds; nothing was saved");
  }
}

}  // namespace

MapParts PartsOf(const engine::MapSnapshot& snapshot) {
  return {MakeStoredKeyFrames(snapshot), snapshot.points, snapshot.observations, snapshot.panoramas,
          snapshot.next_panorama};
}

Bounds BoundsOf(const MapParts& parts) {
  engine::MapSnapshot map;
  for (const StoredKeyFrame& stored : parts.keyframes) map.keyframes.push_back(stored.keyframe);
  map.points = parts.points;
  const std::optional<Bounds> bounds = ComputeBounds(map);
  if (!bounds) throw Error("a map without keyframes cannot be bounded; build the map first");
  return *bounds;
}

void WriteStructure(const Database& database, const engine::MapSnapshot& snapshot, const MapParts& parts,
                    const std::vector<StoredKeyFrame>& stored_before, MapInfo* info) {
  WriteParts(database, info->key, parts);
  WriteThumbnails(database, info->key, MakeThumbnails(snapshot));
  WriteWords(database, info->key,
             engine::MakeWords(snapshot, UnchangedWords(database, *info, stored_before, parts.keyframes)));
  info->revision = snapshot.revision;
  info->next_keyframe = snapshot.next_keyframe;
  info->next_point = snapshot.next_point;
  info->keyframes = parts.keyframes.size();
  info->points = parts.points.size();
  info->observations = parts.observations.size();
  RemoveMeshUnlessRight(database, info->key, snapshot);
}

bool UpdateStructure(const Database& database, const engine::MapSnapshot& snapshot, MapInfo* info) {
  const MapParts stored = ReadParts(database, *info);
  const MapParts wanted = PartsOf(snapshot);
  if (SameStructure(stored, wanted)) {
    const bool same_ids =
        info->next_keyframe == snapshot.next_keyframe && info->next_point == snapshot.next_point;
    if (same_ids || !MayChangeStructure(info->policy)) return false;
  }
  if (!MayChangeStructure(info->policy)) Refuse(info->policy, "its keyframes and points cannot be changed");
  if (info->policy == Policy::kBounded) CheckNewKeyFramesInside(*info, stored, wanted);
  WriteStructure(database, snapshot, wanted, stored.keyframes, info);
  WriteImages(database, info->key, snapshot, wanted.keyframes, stored.keyframes);
  return true;
}

}  // namespace docent::maps
