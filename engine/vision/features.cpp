// SPDX-License-Identifier: Apache-2.0
#include "engine/vision/features.h"

#include <algorithm>
#include <cmath>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

namespace docent::engine {

namespace {

constexpr double kReferenceArea = 640.0 * 480.0;
// The patch border: a corner nearer to the edge could not be matched.
constexpr int kBorder = 6;

void DetectCorners(const cv::Mat& image, int threshold, std::vector<cv::KeyPoint>* scratch,
                   std::vector<Corner>* corners, std::vector<int>* row_begin) {
  cv::FAST(image, *scratch, threshold, true, cv::FastFeatureDetector::TYPE_9_16);
  corners->clear();
  row_begin->assign(static_cast<std::size_t>(image.rows) + 1, 0);
  // OpenCV reports corners row by row, which the row index relies on.
  for (const cv::KeyPoint& keypoint : *scratch) {
    const Corner corner{static_cast<std::int16_t>(keypoint.pt.x), static_cast<std::int16_t>(keypoint.pt.y)};
    if (corner.x < kBorder || corner.y < kBorder || corner.x >= image.cols - kBorder ||
        corner.y >= image.rows - kBorder) {
      continue;
    }
    corners->push_back(corner);
    ++(*row_begin)[static_cast<std::size_t>(corner.y) + 1];
  }
  for (std::size_t row = 1; row < row_begin->size(); ++row) (*row_begin)[row] += (*row_begin)[row - 1];
}

// A step towards the threshold that gives the wanted count; counts fall roughly as exp(-threshold / 8).
int NextThreshold(int threshold, std::size_t found, double wanted, const FeatureOptions& options) {
  const double ratio = (static_cast<double>(found) + 1.0) / (wanted + 1.0);
  int step = static_cast<int>(std::lround(std::clamp(6.0 * std::log(ratio), -6.0, 10.0)));
  return std::clamp(threshold + step, options.min_threshold, options.max_threshold);
}

double WantedCorners(const FeatureOptions& options, const cv::Mat& gray, int level) {
  return options.wanted_corners[static_cast<std::size_t>(level)] *
         (static_cast<double>(gray.total()) / kReferenceArea);
}

}  // namespace

void ExtractFeatures(const cv::Mat& gray, const FeatureOptions& options,
                     const std::array<int, kPyramidLevels>& threshold_hint, ImageFeatures* features) {
  static thread_local std::vector<cv::KeyPoint> scratch;
  features->levels[0] = gray;
  for (std::size_t level = 0; level < kPyramidLevels; ++level) {
    if (level > 0) {
      const cv::Mat& finer = features->levels[level - 1];
      const cv::Size half(finer.cols / 2, finer.rows / 2);
      // Whole blocks only: an odd last row or column would stretch every pixel a little beyond 2x2.
      cv::resize(finer(cv::Rect(cv::Point(), half * 2)), features->levels[level], half, 0, 0, cv::INTER_AREA);
    }
    const double wanted = WantedCorners(options, gray, static_cast<int>(level));
    int threshold = threshold_hint[level] > 0 ? threshold_hint[level] : 15;
    DetectCorners(features->levels[level], threshold, &scratch, &features->corners[level],
                  &features->row_begin[level]);
    const std::size_t found = features->corners[level].size();
    const int next = NextThreshold(threshold, found, wanted, options);
    // A picture that suddenly blurs or clears is detected again at once; otherwise the next one profits.
    if (static_cast<double>(found) < 0.4 * wanted && next < threshold) {
      DetectCorners(features->levels[level], next, &scratch, &features->corners[level],
                    &features->row_begin[level]);
    }
    features->fast_threshold[level] = next;
  }
  features->small_blurry = MakeSmallBlurryImage(gray);
}

std::shared_ptr<const ImageFeatures> MakeFeatures(const cv::Mat& gray, const FeatureOptions& options) {
  auto features = std::make_shared<ImageFeatures>();
  std::array<int, kPyramidLevels> hint{};
  for (int round = 0; round < 3; ++round) {
    ExtractFeatures(gray, options, hint, features.get());
    hint = features->fast_threshold;
  }
  return features;
}

}  // namespace docent::engine
