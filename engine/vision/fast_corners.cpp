// SPDX-License-Identifier: Apache-2.0
#include "engine/vision/fast_corners.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <opencv2/core.hpp>

#include "engine/vision/lanes.h"

namespace docent::engine {

namespace {

constexpr int kByteLanesAtOnce = kByteLanes;
constexpr std::size_t kRing = 16;
constexpr int kCircleRadius = 3;

using Lanes = ByteLanes;
using RingOffsets = std::array<std::ptrdiff_t, kRing>;

// The circle of radius three around a pixel, in order.
RingOffsets MakeRing(std::ptrdiff_t step) {
  constexpr std::array<std::array<int, 2>, kRing> kCircle = {{{0, 3},
                                                              {1, 3},
                                                              {2, 2},
                                                              {3, 1},
                                                              {3, 0},
                                                              {3, -1},
                                                              {2, -2},
                                                              {1, -3},
                                                              {0, -3},
                                                              {-1, -3},
                                                              {-2, -2},
                                                              {-3, -1},
                                                              {-3, 0},
                                                              {-3, 1},
                                                              {-2, 2},
                                                              {-1, 3}}};
  RingOffsets offsets;
  for (std::size_t i = 0; i < kRing; ++i) offsets[i] = kCircle[i][0] + kCircle[i][1] * step;
  return offsets;
}

struct Brighter {
  static Lanes Weaker(const Lanes& a, const Lanes& b) { return cv::v_min(a, b); }
  static Lanes Stronger(const Lanes& a, const Lanes& b) { return cv::v_max(a, b); }
};
struct Darker {
  static Lanes Weaker(const Lanes& a, const Lanes& b) { return cv::v_max(a, b); }
  static Lanes Stronger(const Lanes& a, const Lanes& b) { return cv::v_min(a, b); }
};

// The strength of the strongest arc of nine pixels; the strength of an arc is that of its weakest pixel. Arcs
// that differ by one step share eight pixels.
template <typename Kind>
Lanes StrongestArc(const Lanes (&ring)[kRing]) {
  Lanes pairs[kRing / 2];
  for (std::size_t i = 0; i < kRing / 2; ++i)
    pairs[i] = Kind::Weaker(ring[2 * i + 1], ring[(2 * i + 2) % kRing]);
  Lanes fours[kRing / 2];
  for (std::size_t i = 0; i < kRing / 2; ++i) fours[i] = Kind::Weaker(pairs[i], pairs[(i + 1) % 8]);
  Lanes strongest{};
  for (std::size_t i = 0; i < kRing / 2; ++i) {
    const Lanes eight = Kind::Weaker(fours[i], fours[(i + 2) % 8]);
    const Lanes arc = Kind::Weaker(eight, Kind::Stronger(ring[2 * i], ring[(2 * i + 9) % kRing]));
    strongest = i == 0 ? arc : Kind::Stronger(strongest, arc);
  }
  return strongest;
}

// The largest difference for which the pixel is a corner, minus one; 0 if it is none at this threshold.
Lanes Scores(const std::uint8_t* pixel, const RingOffsets& offsets, const Lanes& threshold) {
  const Lanes center = LoadBytes(pixel);
  Lanes ring[kRing];
  for (const std::size_t i : {0, 4, 8, 12}) ring[i] = LoadBytes(pixel + offsets[i]);
  // Every arc of nine contains one of each two opposite pixels. Differences saturate at 0.
  const Lanes bright = cv::v_min(cv::v_max(ring[0], ring[8]), cv::v_max(ring[4], ring[12])) - center;
  const Lanes dark = center - cv::v_max(cv::v_min(ring[0], ring[8]), cv::v_min(ring[4], ring[12]));
  if (!cv::v_check_any(cv::v_max(bright, dark) > threshold)) return AllBytes(0);
  for (const std::size_t i : {1, 2, 3, 5, 6, 7, 9, 10, 11, 13, 14, 15})
    ring[i] = LoadBytes(pixel + offsets[i]);
  const Lanes best = cv::v_max(StrongestArc<Brighter>(ring) - center, center - StrongestArc<Darker>(ring));
  return (best - AllBytes(1)) & (best > threshold);
}

// Scores of the columns first to end - 1; writes up to one block more behind them.
void ScoreRow(const std::uint8_t* row, int columns, int first, int end, const RingOffsets& offsets,
              const Lanes& threshold, std::uint8_t* scores) {
  for (int x = first; x < end; x += kByteLanesAtOnce) {
    // Overlaps the previous block instead of exceeding the row.
    const int at = std::min(x, columns - kCircleRadius - kByteLanesAtOnce);
    cv::v_store(scores + at, Scores(row + at, offsets, threshold));
  }
}

// Corners of one row: pixels that score more than all eight neighbours.
void TakePeaks(const std::uint8_t* above, const std::uint8_t* scores, const std::uint8_t* below, int first,
               int end, int y, std::vector<Corner>* corners) {
  for (int x = first; x < end; x += kByteLanesAtOnce) {
    const Lanes score = LoadBytes(scores + x);
    if (!cv::v_check_any(score > AllBytes(0))) continue;
    Lanes competitor = cv::v_max(LoadBytes(scores + x - 1), LoadBytes(scores + x + 1));
    for (const std::uint8_t* other : {above, below}) {
      competitor = cv::v_max(competitor, LoadBytes(other + x));
      competitor = cv::v_max(competitor, cv::v_max(LoadBytes(other + x - 1), LoadBytes(other + x + 1)));
    }
    auto peaks = static_cast<std::uint32_t>(cv::v_signmask(score > competitor));
    if (end - x < kByteLanesAtOnce) peaks &= (std::uint32_t{1} << (end - x)) - 1;
    for (; peaks != 0; peaks &= peaks - 1)
      corners->push_back(
          {static_cast<std::int16_t>(x + std::countr_zero(peaks)), static_cast<std::int16_t>(y)});
  }
}

}  // namespace

void DetectFastCorners(const cv::Mat& image, int threshold, int border, std::vector<Corner>* corners,
                       std::vector<int>* row_begin) {
  CV_Assert(image.type() == CV_8UC1 && border > kCircleRadius);
  corners->clear();
  row_begin->assign(static_cast<std::size_t>(image.rows) + 1, 0);
  if (image.rows <= 2 * border || image.cols <= 2 * border) return;
  cv::Mat pixels = image;
  // A whole block must fit between the margins; additional columns are never neighbours of a corner.
  const int least = border + kByteLanesAtOnce + kCircleRadius;
  thread_local std::vector<std::uint8_t> widened;
  if (image.cols < least) {
    widened.assign(static_cast<std::size_t>(image.rows) * static_cast<std::size_t>(least), 0);
    pixels = cv::Mat(image.rows, least, CV_8UC1, widened.data());
    image.copyTo(pixels.colRange(0, image.cols));
  }

  const auto width = static_cast<std::size_t>(pixels.cols + 2 * kByteLanesAtOnce);
  thread_local std::vector<std::uint8_t> memory;
  memory.assign(3 * width, 0);
  std::uint8_t* above = memory.data();
  std::uint8_t* scores = above + width;
  std::uint8_t* below = scores + width;
  const RingOffsets offsets = MakeRing(static_cast<std::ptrdiff_t>(pixels.step[0]));
  const Lanes lanes = AllBytes(static_cast<std::uint8_t>(std::clamp(threshold, 0, 255)));
  const int first = border, end = image.cols - border;
  for (int y = border - 1; y <= image.rows - border; ++y) {
    ScoreRow(pixels.ptr<std::uint8_t>(y), pixels.cols, first - 1, end + 1, offsets, lanes, below);
    if (y > border) {
      TakePeaks(above, scores, below, first, end, y - 1, corners);
      (*row_begin)[static_cast<std::size_t>(y)] = static_cast<int>(corners->size());
    }
    std::swap(above, scores);
    std::swap(scores, below);
  }
  const auto filled = static_cast<std::size_t>(image.rows - border);
  std::fill(row_begin->begin() + static_cast<std::ptrdiff_t>(filled), row_begin->end(),
            static_cast<int>(corners->size()));
}

}  // namespace docent::engine
