// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/geometry/camera_model.h"
#include "maps/storage/database.h"

// Estimated calibrations of cameras in a library, one row per camera, by name (table `lenses`).
namespace docent::maps {

struct StoredLens {
  std::string camera;         // Name of the camera, 1 to 200 bytes.
  engine::CameraModel model;  // Radial-tangential with fx = fy; only k1 and k2 may be nonzero.
  double focal_sigma = 0;     // Relative standard deviation of the focal length; above 0, at most 1.
  bool fixed = false;         // The estimate is final.

  bool operator==(const StoredLens& other) const = default;
};

inline constexpr std::size_t kMaxCameraNameBytes = 200;

// Why the values are invalid, or empty. Invalid values are neither written nor read.
std::string ProblemOf(const StoredLens& lens);

// A lens from the values of its row. Throws Error when they or the checksum are not valid.
StoredLens CheckedLens(const std::string& camera, std::span<const std::uint8_t> data, std::int64_t checksum);

// Reads all lenses by ascending name; none from a format without the table. Checks each row's checksum and
// values and throws Error that begins with the file's name. Like WriteLens, runs in the caller's transaction.
std::vector<StoredLens> ReadLenses(const Database& database);
// Adds or replaces the lens of a camera; false if the same values are stored already. Throws Error.
bool WriteLens(const Database& database, const StoredLens& lens);

}  // namespace docent::maps
