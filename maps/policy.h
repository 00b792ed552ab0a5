// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <string_view>

#include "engine/map/map_snapshot.h"

namespace docent::maps {

// What may be done to a stored map. The library enforces it on every write; a mapper asks KeyFrameAllowed
// before it offers a keyframe, so that nothing is built that cannot be kept.
//
//   policy        keyframes, points    new keyframes            content   rename   remove
//   open          yes                  anywhere                 yes       yes      yes
//   bounded       yes                  within original bounds   yes       yes      yes
//   augment-only  no                   no                       yes       yes      no
//   read-only     no                   no                       no        no       no
enum class Policy { kOpen, kBounded, kAugmentOnly, kReadOnly };

// The word of the command line: "open", "bounded", "augment-only", "read-only".
const char* ToString(Policy policy);
// Empty when it is none of the four words.
std::optional<Policy> ParsePolicy(std::string_view text);

bool MayChangeStructure(Policy policy);  // keyframes, points, observations
bool MayChangeContent(Policy policy);    // scene and assets
bool MayRemove(Policy policy);
// Of a map that two maps become (see joining.h).
Policy Stricter(Policy a, Policy b);

// The room that a map filled when it was bounded: a box along the map's axes, metres.
struct Bounds {
  Eigen::Vector3d min = Eigen::Vector3d::Zero();
  Eigen::Vector3d max = Eigen::Vector3d::Zero();

  bool operator==(const Bounds& other) const { return min == other.min && max == other.max; }
};

// The box round all keyframe centres and the middle 98 % of the finite points along each axis, so that a few
// badly triangulated points do not open it to the horizon. Empty for a map without keyframes.
std::optional<Bounds> ComputeBounds(const engine::MapSnapshot& map);

// The same box, wider on every side by `fraction` of its diagonal.
Bounds Grown(const Bounds& bounds, double fraction);

// Whether a map with this policy takes a new keyframe whose centre is at `position` (metres, in the map).
// A bounded map without known bounds takes none.
bool KeyFrameAllowed(Policy policy, const std::optional<Bounds>& bounds, const Eigen::Vector3d& position);

}  // namespace docent::maps
