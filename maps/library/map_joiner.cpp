// SPDX-License-Identifier: Apache-2.0
#include "maps/library/map_joiner.h"

#include <optional>
#include <vector>

#include "maps/library/policy_refusal.h"
#include "maps/library/scene_storage.h"
#include "maps/library/structure_storage.h"
#include "maps/storage/history_rows.h"
#include "maps/storage/rows.h"
#include "maps/storage/tour_rows.h"

namespace docent::maps {

void MapJoiner::Join(const JoinRecord& record) const {
  for (const MapInfo& info : {record.into, record.from}) {
    WithMapContext(database_, info, [&] {
      if (!MayChangeStructure(info.policy)) Refuse(info.policy, "it cannot be joined with another map");
    });
  }
  signposts_.Redirect(
      record.from, {record.into.key, record.into.name}, {record.into.key, record.from.key},
      "its signposts to '" + record.from.name + "' cannot point to '" + record.into.name + "' instead");
  ReplaceStop(database_, record.from.key, record.into.key);
  MapInfo info = record.into;
  RemoveHistory(database_, info.key);  // It belongs to the scene before.
  const MapParts parts = PartsOf(*record.snapshot);
  const std::vector<StoredKeyFrame> stored_before = ReadParts(database_, info).keyframes;
  WriteStructure(database_, *record.snapshot, parts, stored_before, &info);
  WriteImages(database_, info.key, *record.snapshot, parts.keyframes, stored_before);
  WriteScene(database_, info.key, *record.scene);
  info.policy = Stricter(record.into.policy, record.from.policy);
  info.bounds = record.bounds;
  info.modified = clock_();
  WriteMapRow(database_, info);
  Remove(record.from.key);
}

bool MapJoiner::RemoveJoined(std::uint64_t key, const SignpostTarget& into) const {
  const std::optional<MapInfo> info = ReadMapRow(database_, key);
  if (!info) return false;
  WithMapContext(database_, *info, [&] {
    if (!MayRemove(info->policy)) Refuse(info->policy, "it cannot be joined into another map");
  });
  signposts_.Redirect(*info, into, {key}, "");
  ReplaceStop(database_, key, into.key);
  Remove(key);
  return true;
}

void MapJoiner::Remove(std::uint64_t key) const {
  RemoveMapRows(database_, key);
  ReplaceStop(database_, key, std::nullopt);
  LibraryRow library = ReadLibraryRow(database_);
  --library.map_count;
  WriteLibraryRow(database_, library);
  RemoveUnusedAssets(database_);
}

}  // namespace docent::maps
