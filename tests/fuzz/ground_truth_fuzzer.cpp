// SPDX-License-Identifier: Apache-2.0
// Parses any bytes as ground truth and as labels of segments: the result must be a docent::Error, or poses
// and labels in the order of their times, which can be looked up at any time that an image may have.
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "app/evaluation/ground_truth.h"
#include "engine/base/error.h"

namespace {

// Of an image; the lists of images have the same limit.
constexpr docent::Timestamp kFarthest = std::chrono::seconds(3'000'000'000);

template <typename Item>
void CheckTimes(const std::vector<Item>& items) {
  for (std::size_t i = 1; i < items.size(); ++i) {
    if (items[i].time <= items[i - 1].time) __builtin_trap();
  }
}

void CheckGroundTruth(std::string_view text) {
  const auto poses = docent::app::ParseGroundTruth(text, "fuzz");
  if (poses.empty()) __builtin_trap();
  CheckTimes(poses);
  for (const docent::app::TimedPose& pose : poses) {
    if (!pose.truth_from_camera.translation.allFinite()) __builtin_trap();
    if (docent::app::FindPose(poses, pose.time, docent::Timestamp{}) != &pose) __builtin_trap();
  }
  for (const docent::Timestamp time : {-kFarthest, docent::Timestamp{}, kFarthest}) {
    const auto pose = docent::app::InterpolatePose(poses, time, 2 * kFarthest);
    if (!pose || !pose->translation.allFinite()) __builtin_trap();
  }
}

void CheckSegments(std::string_view text) {
  const auto labels = docent::app::ParseSegments(text, "fuzz");
  CheckTimes(labels);
  for (const docent::app::TimedLabel& label : labels) {
    if (docent::app::FindLabel(labels, label.time) != &label) __builtin_trap();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  for (const auto check : {CheckGroundTruth, CheckSegments}) {
    try {
      check({reinterpret_cast<const char*>(data), size});
    } catch (const docent::Error&) {
    }
  }
  return 0;
}
