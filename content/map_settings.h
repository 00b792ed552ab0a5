// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "content/gltf/json.h"
#include "engine/geometry/sim3.h"

namespace docent::content {

// Limits of MapSettings::metres_per_unit. A map is as large as a room or a building in any unit.
inline constexpr double kMinMetresPerUnit = 1e-6, kMaxMetresPerUnit = 1e6;

// What an author has said about the space of a map, because images alone cannot tell it. A value type.
struct MapSettings {
  std::optional<Eigen::Vector3d> up;  // Unit vector in the map; empty: estimated from the keyframes.
  double metres_per_unit = 0;         // Length of a map unit in metres; 0 while it is not known.
  // The keyframe whose image stands for the map where visitors choose a place; empty: the map's first one,
  // which also counts if this one is no longer in the map.
  std::optional<std::uint32_t> entrance;

  bool operator==(const MapSettings& other) const {
    return up == other.up && metres_per_unit == other.metres_per_unit && entrance == other.entrance;
  }
};

// A sentence that says why the settings cannot be stored; empty if they can.
std::string Validate(const MapSettings& settings);

// The settings after the coordinates of the map were transformed.
MapSettings Transformed(const engine::Sim3& after_from_before, const MapSettings& settings);

// {"up": [X, Y, Z] or null, "metres_per_unit": M}, and "entrance": KEYFRAME if there is one. The settings
// must be valid.
Json SettingsToJson(const MapSettings& settings);
// Throws Error, which begins with `where` and `place`, for whatever SettingsToJson does not write.
MapSettings SettingsFromJson(std::string_view where, const std::string& place, const Json& json);

}  // namespace docent::content
