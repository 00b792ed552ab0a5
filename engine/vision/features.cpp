// SPDX-License-Identifier: Apache-2.0
#include "engine/vision/features.h"

#include <algorithm>
#include <cmath>

#include "engine/base/option_check.h"
#include "engine/vision/fast_corners.h"

namespace docent::engine {

namespace {

constexpr double kReferenceArea = 640.0 * 480.0;
// Border of the patch: a corner nearer to the image border could not be matched.
constexpr int kBorder = 6;

// A step towards the threshold for the target number; the number falls roughly as exp(-threshold / 8).
int NextThreshold(int threshold, std::size_t found, double target, const FeatureOptions& options) {
  const double ratio = (static_cast<double>(found) + 1.0) / (target + 1.0);
  int step = static_cast<int>(std::lround(std::clamp(6.0 * std::log(ratio), -6.0, 10.0)));
  return std::clamp(threshold + step, options.min_threshold, options.max_threshold);
}

double WantedCorners(const FeatureOptions& options, const cv::Mat& gray, int level) {
  return options.wanted_corners[static_cast<std::size_t>(level)] *
         (static_cast<double>(gray.total()) / kReferenceArea);
}

}  // namespace

std::optional<std::string> FeatureOptions::Validate() const {
  return OptionCheck()
      .That(std::ranges::all_of(wanted_corners, [](int count) { return count >= 0; }),
            "The number of keypoints of a level must be at least 0.")
      .Within(min_threshold, 1, 255, "smallest threshold of a keypoint")
      .Within(max_threshold, min_threshold, 255, "largest threshold of a keypoint")
      .fault();
}

void ExtractFeatures(const cv::Mat& gray, const FeatureOptions& options,
                     const std::array<int, kPyramidLevels>& threshold_hint, ImageFeatures* features) {
  features->levels[0] = gray;
  for (std::size_t level = 0; level < kPyramidLevels; ++level) {
    if (level > 0) HalveImage(features->levels[level - 1], &features->levels[level]);
    const double target = WantedCorners(options, gray, static_cast<int>(level));
    int threshold = threshold_hint[level] > 0 ? threshold_hint[level] : 15;
    DetectFastCorners(features->levels[level], threshold, kBorder, &features->corners[level],
                      &features->row_begin[level]);
    const std::size_t found = features->corners[level].size();
    const int next = NextThreshold(threshold, found, target, options);
    // After a sudden change of sharpness the image is processed again; otherwise the new threshold applies to
    // the next one.
    if (static_cast<double>(found) < 0.4 * target && next < threshold) {
      DetectFastCorners(features->levels[level], next, kBorder, &features->corners[level],
                        &features->row_begin[level]);
    }
    features->fast_threshold[level] = next;
  }
  MakeSmallBlurryImage(gray, kThumbnailBlurPx, &features->small_blurry);
}

std::shared_ptr<const ImageFeatures> MakeFeatures(const cv::Mat& gray, const FeatureOptions& options) {
  Checked(options);
  auto features = std::make_shared<ImageFeatures>();
  std::array<int, kPyramidLevels> hint{};
  for (int round = 0; round < 3; ++round) {
    ExtractFeatures(gray, options, hint, features.get());
    hint = features->fast_threshold;
  }
  return features;
}

bool AreEqual(const ImageFeatures& a, const ImageFeatures& b) {
  const cv::Mat &first = a.levels.back(), &second = b.levels.back();
  if (first.size() != second.size()) return false;
  for (int y = 0; y < first.rows; ++y) {
    if (!std::equal(first.ptr(y), first.ptr(y) + first.cols, second.ptr(y))) return false;
  }
  return true;
}

}  // namespace docent::engine
