// SPDX-License-Identifier: Apache-2.0
#include "maps/maintenance/joining.h"

#include <utility>

#include "engine/base/error.h"

namespace docent::maps {

namespace {

// Checked before minutes of computation whose result could not be saved. The library checks it again.
void CheckMayBeJoined(const Library& library, const MapInfo& info) {
  if (MayChangeStructure(info.policy)) return;
  throw Error(library.file() + ": map '" + info.name + "' has the policy " + ToString(info.policy) +
              ", so it cannot be joined with another map; change its policy first");
}

// The axis-aligned bounding box of a transformed box.
Bounds Moved(const engine::Sim3& motion, const Bounds& bounds) {
  Bounds moved;
  for (int corner = 0; corner < 8; ++corner) {
    Eigen::Vector3d at;
    for (int axis = 0; axis < 3; ++axis) at[axis] = ((corner >> axis) & 1 ? bounds.max : bounds.min)[axis];
    at = motion * at;
    moved.min = corner == 0 ? at : moved.min.cwiseMin(at).eval();
    moved.max = corner == 0 ? at : moved.max.cwiseMax(at).eval();
  }
  return moved;
}

}  // namespace

std::optional<Bounds> JoinedBounds(const StoredMap& into, const StoredMap& from,
                                   const engine::Sim3& into_from_from) {
  if (Stricter(into.info.policy, from.info.policy) != Policy::kBounded) return std::nullopt;
  const auto own = [](const StoredMap& map) {
    return map.info.bounds ? map.info.bounds : ComputeBounds(*map.snapshot);
  };
  const std::optional<Bounds> first = own(into), second = own(from);
  if (!first || !second) return first;
  const Bounds moved = Moved(into_from_from, *second);
  return Bounds{first->min.cwiseMin(moved.min), first->max.cwiseMax(moved.max)};
}

JoinResult JoinMaps(Library* library, std::uint64_t into_key, std::uint64_t from_key,
                    const SceneJoiner& scenes, const std::atomic<bool>* interrupt,
                    const engine::MapJoiningOptions& options) {
  if (into_key == from_key) throw Error("a map cannot be joined with itself; choose two different maps");
  for (const std::uint64_t key : {into_key, from_key}) CheckMayBeJoined(*library, library->Find(key));
  const StoredMap into = library->Load(into_key), from = library->Load(from_key);
  engine::MapJoinAttempt attempt = engine::JoinMaps(options, *into.snapshot, *from.snapshot, interrupt);
  JoinResult result;
  result.overlap = std::move(attempt.overlap);
  result.refusal = attempt.refusal;
  if (!attempt.joined) return result;
  const engine::JoinedMap& joined = *attempt.joined;
  result.points_merged = joined.points_merged;
  JoinRecord record;
  record.into = into.info;
  record.from = from.info;
  record.snapshot = joined.map;
  record.scene = scenes.join(into, from, joined);
  record.bounds = JoinedBounds(into, from, joined.a_from_b);
  result.changed_meanwhile = !library->Join(record);
  return result;
}

}  // namespace docent::maps
