// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "engine/mapping/loops/map_joining.h"
#include "maps/library/library.h"

// Joins two maps of a library (engine/mapping/loops/map_joining.h describes when this is possible and how):
// keyframes, points, panorama maps, content, signposts and policies, in one transaction. The first map keeps
// its name, key, coordinates and unit; the second is removed. The joined map gets the stricter of the two
// policies. If that is bounded, its bounds are the bounding box of the bounds of both maps; the bounds of an
// open map are computed from its keyframes and points. Both policies must allow changes to keyframes and
// points.
namespace docent::maps {

// Operations on scenes, which only the content library can interpret.
struct SceneJoiner {
  // Returns the scenes of both maps in the coordinates of the joined map.
  std::function<std::shared_ptr<const SceneRecord>(const StoredMap& into, const StoredMap& from,
                                                   const engine::JoinedMap& joined)>
      join;
};

struct JoinResult {
  engine::MapOverlap overlap;
  int points_merged = 0;
  // Why the maps were not joined; then nothing was written.
  engine::JoinRefusal refusal = engine::JoinRefusal::kNone;
  bool changed_meanwhile = false;  // another program changed one of them, so that nothing was written

  bool Joined() const { return refusal == engine::JoinRefusal::kNone && !changed_meanwhile; }
};

// `into` and `from` are the keys of two maps. The library must be opened with full feature computation.
// `interrupt` may be null. Throws docent::Error when a policy forbids the change or the file has an error.
JoinResult JoinMaps(Library* library, std::uint64_t into, std::uint64_t from, const SceneJoiner& scenes,
                    const std::atomic<bool>* interrupt, const engine::MapJoiningOptions& options = {});

// The bounds of the joined map: those of both maps if the stricter policy is bounded, else none.
std::optional<Bounds> JoinedBounds(const StoredMap& into, const StoredMap& from,
                                   const engine::Sim3& into_from_from);

}  // namespace docent::maps
