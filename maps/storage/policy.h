// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <string_view>

#include "engine/map/map_snapshot.h"

namespace docent::maps {

// What may be changed in a stored map. The library enforces the policy on every write. A mapper calls
// KeyFrameAllowed before it adds a keyframe, so that it never builds what cannot be saved.
//
//   policy        keyframes, points    new keyframes            content   rename   remove
//   open          yes                  anywhere                 yes       yes      yes
//   bounded       yes                  within original bounds   yes       yes      yes
//   augment-only  no                   no                       yes       yes      no
//   read-only     no                   no                       no        no       no
enum class Policy { kOpen, kBounded, kAugmentOnly, kReadOnly };

// The name on the command line: "open", "bounded", "augment-only", "read-only".
const char* ToString(Policy policy);
// Empty if it is none of the four names.
std::optional<Policy> ParsePolicy(std::string_view text);

bool MayChangeStructure(Policy policy);  // Keyframes, points and observations.
bool MayChangeContent(Policy policy);    // Scene and assets.
bool MayRemove(Policy policy);           // The whole map.
// The policy of a map that two maps are joined into (see joining.h).
Policy Stricter(Policy a, Policy b);

// The extent of a map when it became bounded: a box along the map's axes, in map units.
struct Bounds {
  Eigen::Vector3d min = Eigen::Vector3d::Zero();  // The corner with the smallest coordinates.
  Eigen::Vector3d max = Eigen::Vector3d::Zero();  // The corner with the largest coordinates.

  // Whether both corners are equal.
  bool operator==(const Bounds& other) const { return min == other.min && max == other.max; }
};

// The bounding box of all keyframe centres and of the central 98 % of the finite points along each axis, so
// that a few badly triangulated points do not extend it far. Empty for a map without keyframes.
std::optional<Bounds> ComputeBounds(const engine::MapSnapshot& map);

// The box expanded on every side by `fraction` of its diagonal.
Bounds Expanded(const Bounds& bounds, double fraction);

// Whether a map with this policy accepts a new keyframe whose centre is at `position` (map coordinates). A
// bounded map without bounds accepts none.
bool KeyFrameAllowed(Policy policy, const std::optional<Bounds>& bounds, const Eigen::Vector3d& position);

}  // namespace docent::maps
