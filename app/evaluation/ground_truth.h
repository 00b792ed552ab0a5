// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/time.h"
#include "engine/geometry/rigid3.h"

// Ground truth of recorded sequences.
namespace docent::app {

struct TimedPose {
  Timestamp time{};
  engine::Rigid3 truth_from_camera;  // Metres.
};

// Label for the time from `time` until the next label.
struct TimedLabel {
  Timestamp time{};
  std::string label;
};

// Reads lines `timestamp tx ty tz qx qy qz qw` (camera to world); '#' begins a comment; timestamps must
// increase and be at most 95 years away from 0, as those of images. Throws Error with file and line. The
// Parse functions read from text; `name` is the name in error messages.
std::vector<TimedPose> ReadGroundTruth(const std::filesystem::path& path);
std::vector<TimedPose> ParseGroundTruth(std::string_view text, const std::string& name);
// Reads lines `timestamp label` with the same rules.
std::vector<TimedLabel> ReadSegments(const std::filesystem::path& path);
std::vector<TimedLabel> ParseSegments(std::string_view text, const std::string& name);

// The pose nearest in time, or null if it is more than max_difference away. O(log n).
const TimedPose* FindPose(const std::vector<TimedPose>& poses, Timestamp time, Timestamp max_difference);
// Interpolates the pose at this time between its neighbours (centres linearly, orientations by spherical
// linear interpolation) if both are at most max_difference away; else as FindPose.
std::optional<engine::Rigid3> InterpolatePose(const std::vector<TimedPose>& poses, Timestamp time,
                                              Timestamp max_difference);
// The label at this time; null before the first label.
const TimedLabel* FindLabel(const std::vector<TimedLabel>& labels, Timestamp time);

}  // namespace docent::app
