// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/time.h"
#include "engine/geometry/rigid3.h"

// The truth that comes with a sequence.
namespace docent::app {

struct TimedPose {
  Timestamp time{};
  engine::Rigid3 truth_from_camera;  // metres
};

// What the camera is doing from this time on, until the next label.
struct TimedLabel {
  Timestamp time{};
  std::string label;
};

// `timestamp tx ty tz qx qy qz qw` (camera to world), '#' comments; times must grow. Throws Error with file
// and line. The Parse functions take the text; `name` stands in the sentences.
std::vector<TimedPose> ReadGroundTruth(const std::filesystem::path& path);
std::vector<TimedPose> ParseGroundTruth(std::string_view text, const std::string& name);
// `timestamp label`, '#' comments; times must grow.
std::vector<TimedLabel> ReadSegments(const std::filesystem::path& path);
std::vector<TimedLabel> ParseSegments(std::string_view text, const std::string& name);

// The pose nearest in time, if it is at most max_difference away. O(log n).
const TimedPose* FindPose(const std::vector<TimedPose>& poses, Timestamp time, Timestamp max_difference);
// The pose at this time, between its neighbours (centres linearly, orientations by the shortest way), where
// both are at most max_difference away; else as FindPose.
std::optional<engine::Rigid3> InterpolatePose(const std::vector<TimedPose>& poses, Timestamp time,
                                              Timestamp max_difference);
// The label that holds at this time; null before the first one.
const TimedLabel* FindLabel(const std::vector<TimedLabel>& labels, Timestamp time);

}  // namespace docent::app
