// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "engine/mapping/map_joining.h"
#include "maps/library.h"

// Two maps of a library become one (engine/mapping/map_joining.h says when and how): keyframes, points and
// panorama maps, content, signposts and policies, in one transaction. The first keeps its name, key,
// coordinates and unit; the second is gone afterwards. The joined map has the stricter policy of the two;
// where that is bounded, its bounds are the box round the bounds of both (of an open one: round what it
// holds). Both policies must allow that keyframes and points change.
namespace docent::maps {

// What only the content floor can do.
struct SceneJoiner {
  // What stands in both maps, in the coordinates of the joined one.
  std::function<std::shared_ptr<const SceneRecord>(const StoredMap& into, const StoredMap& from,
                                                   const engine::JoinedMap& joined)>
      join;
  // See JoinRecord::redirect.
  std::function<std::optional<std::string>(const std::string& text, const std::string& from,
                                           const std::string& into)>
      redirect;
};

struct JoinResult {
  engine::MapOverlap overlap;
  int points_merged = 0;
  // One sentence without a full stop that says why the maps stay two, and nothing was written; empty when
  // they were joined.
  std::string refusal;
};

// `into` and `from` are keys of two maps. The library makes full features. interrupt may be null. Throws
// docent::Error where a policy does not allow it, and for what the file has wrong.
JoinResult JoinMaps(Library* library, std::uint64_t into, std::uint64_t from, const SceneJoiner& scenes,
                    const std::atomic<bool>* interrupt, const engine::MapJoiningOptions& options = {});

// The bounds of the joined map: of both, where the stricter policy is bounded, else none.
std::optional<Bounds> JoinedBounds(const StoredMap& into, const StoredMap& from,
                                   const engine::Sim3& into_from_from);

}  // namespace docent::maps
