// SPDX-License-Identifier: Apache-2.0
#include "engine/recognition/thumbnail_array.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace docent::engine {

namespace {

constexpr double kShadingSigma = 1.0 / 8;  // Ratio of the width. Coarser shading is removed.
constexpr float kMinDeviation = 2;         // Grey values. Below it the normalization would amplify noise.
constexpr std::size_t kBlock = 16;         // Coarse vectors are padded to whole registers of 16-bit numbers.
// Shifts that the coarse search scores together, so that each loaded number is used four times.
constexpr int kShiftsAtOnce = 4;
constexpr float kCoarseScale = 32;  // Root mean square of a coarse vector's values.
constexpr int kReachFraction = 6;   // The largest shift is the image size divided by this.

int ReachOf(int size_px) {
  // An even number, so that the shift steps reach it; 0 for images that are too small to shift.
  return size_px < 4 * kReachFraction ? 0 : (size_px / kReachFraction) & ~1;
}

std::int8_t ToByte(float value) {
  return static_cast<std::int8_t>(std::clamp(std::lround(value), -127L, 127L));
}

// The means of the cells at a shift, with their mean removed and normalized to one length; zeros for a
// uniform image.
template <typename Number>
void MakeCoarse(const ThumbnailShape& shape, const std::int8_t* fine, int shift_x, int shift_y,
                std::span<Number> coarse) {
  constexpr int kCell = ThumbnailShape::kCell;
  const int left = (shape.width - shape.columns * kCell) / 2 + shift_x;
  const int top = (shape.height - shape.rows * kCell) / 2 + shift_y;
  const auto count = static_cast<std::size_t>(shape.columns * shape.rows);
  std::array<std::int32_t, 1024> sums;
  std::fill_n(sums.begin(), count, 0);
  for (int y = 0; y < shape.rows * kCell; ++y) {
    const std::int8_t* row = fine + (top + y) * shape.width + left;
    std::int32_t* cells = sums.data() + y / kCell * shape.columns;
    for (int x = 0; x < shape.columns; ++x) {
      for (int i = 0; i < kCell; ++i) cells[x] += row[x * kCell + i];
    }
  }
  double total = 0, squares = 0;
  for (std::size_t i = 0; i < count; ++i) {
    total += sums[i];
    squares += static_cast<double>(sums[i]) * sums[i];
  }
  const double mean = total / static_cast<double>(count);
  const double variance = squares / static_cast<double>(count) - mean * mean;
  const float scale = variance > 1 ? kCoarseScale / static_cast<float>(std::sqrt(variance)) : 0.0f;
  std::fill(coarse.begin(), coarse.end(), Number{0});
  for (std::size_t i = 0; i < count; ++i) {
    coarse[i] = ToByte((static_cast<float>(sums[i]) - static_cast<float>(mean)) * scale);
  }
}

// The query thumbnail's coarse vectors at all shifts.
struct CoarseQuery {
  std::vector<cv::Point> shifts;  // Offset of the stored thumbnail's centre in the query.
  std::vector<std::int16_t> vectors;
  std::size_t padded_shifts = 0;

  // The shift at which a stored coarse vector has the highest score; the zero shift if none is positive.
  cv::Point BestShift(const std::int8_t* coarse, std::size_t length) const {
    if (length == 0) return {};
    std::int32_t best = 0;
    cv::Point shift;
    for (std::size_t i = 0; i < shifts.size(); ++i) {
      const std::int16_t* const vector = vectors.data() + i * length;
      std::int32_t score = 0;
      for (std::size_t j = 0; j < length; ++j) score += coarse[j] * vector[j];
      if (score <= best) continue;
      best = score;
      shift = shifts[i];
    }
    return shift;
  }

  CoarseQuery(const ThumbnailShape& shape, const PackedThumbnail& wanted) {
    if (shape.coarse_bytes == 0) return;
    for (int y = -shape.reach_y; y <= shape.reach_y; y += ThumbnailShape::kShiftStep) {
      for (int x = -shape.reach_x; x <= shape.reach_x; x += ThumbnailShape::kShiftStep)
        shifts.emplace_back(x, y);
    }
    padded_shifts = (shifts.size() + kShiftsAtOnce - 1) / kShiftsAtOnce * kShiftsAtOnce;
    vectors.resize(padded_shifts * shape.coarse_bytes);
    for (std::size_t i = 0; i < padded_shifts; ++i) {
      const cv::Point shift = shifts[std::min(i, shifts.size() - 1)];
      MakeCoarse(shape, wanted.pixels.data(), shift.x, shift.y,
                 std::span(vectors).subspan(i * shape.coarse_bytes, shape.coarse_bytes));
    }
  }
};

// Scores two stored vectors with four query vectors at once. The loop is written as sums of products of
// 16-bit numbers, for which every processor since 1999 has a SIMD instruction.
template <std::size_t kLength>
void ScorePair(const std::int16_t* stored, const std::int16_t* wanted, std::size_t shifts, std::size_t length,
               std::int32_t* first, std::int32_t* second) {
  const std::size_t count = kLength > 0 ? kLength : length;
  const std::int16_t* const stored_a = stored;
  const std::int16_t* const stored_b = stored + count;
  std::int32_t best_a = std::numeric_limits<std::int32_t>::min(), best_b = best_a;
  for (std::size_t shift = 0; shift < shifts; shift += kShiftsAtOnce) {
    const std::int16_t *w0 = wanted + shift * count, *w1 = w0 + count, *w2 = w1 + count, *w3 = w2 + count;
    std::int32_t a0 = 0, a1 = 0, a2 = 0, a3 = 0, b0 = 0, b1 = 0, b2 = 0, b3 = 0;
    for (std::size_t i = 0; i < count; ++i) {
      a0 += stored_a[i] * w0[i];
      a1 += stored_a[i] * w1[i];
      a2 += stored_a[i] * w2[i];
      a3 += stored_a[i] * w3[i];
      b0 += stored_b[i] * w0[i];
      b1 += stored_b[i] * w1[i];
      b2 += stored_b[i] * w2[i];
      b3 += stored_b[i] * w3[i];
    }
    best_a = std::max(best_a, std::max(std::max(a0, a1), std::max(a2, a3)));
    best_b = std::max(best_b, std::max(std::max(b0, b1), std::max(b2, b3)));
  }
  *first = best_a;
  *second = best_b;
}

// The best score of each of `size` coarse vectors over all shifts. *scores needs room for one more if `size`
// is odd.
template <std::size_t kLength>
void ScoreAll(const CoarseQuery& query, const std::int8_t* coarse, std::size_t length, std::size_t size,
              std::int32_t* scores) {
  std::vector<std::int16_t> pair(2 * length, 0);
  for (std::size_t slot = 0; slot < size; slot += 2) {
    const std::size_t present = std::min<std::size_t>(2, size - slot);
    const std::int8_t* const source = coarse + slot * length;
    for (std::size_t i = 0; i < present * length; ++i) pair[i] = source[i];
    ScorePair<kLength>(pair.data(), query.vectors.data(), query.padded_shifts, length, scores + slot,
                       scores + slot + 1);
  }
}

// Sums over the overlapping pixels of two thumbnails.
struct Overlap {
  std::int32_t count = 0, sum_a = 0, sum_b = 0, square_a = 0, square_b = 0, product = 0;
};

void AddRow(const std::int8_t* a, const std::int8_t* b, int count, Overlap* overlap) {
  std::int32_t sum_a = 0, sum_b = 0, square_a = 0, square_b = 0, product = 0;
  for (int i = 0; i < count; ++i) {
    const std::int16_t value_a = a[i], value_b = b[i];
    sum_a += value_a;
    sum_b += value_b;
    square_a += value_a * value_a;
    square_b += value_b * value_b;
    product += value_a * value_b;
  }
  overlap->count += count;
  overlap->sum_a += sum_a;
  overlap->sum_b += sum_b;
  overlap->square_a += square_a;
  overlap->square_b += square_b;
  overlap->product += product;
}

// See ThumbnailArray::Hit. Pixel p of a corresponds to pixel p + shift of b.
double DifferenceAt(const ThumbnailShape& shape, const std::int8_t* a, const std::int8_t* b, int shift_x,
                    int shift_y) {
  const int width = shape.width - std::abs(shift_x), height = shape.height - std::abs(shift_y);
  if (width <= 0 || height <= 0) return std::numeric_limits<double>::infinity();
  const int left_a = std::max(0, -shift_x), left_b = std::max(0, shift_x);
  const int top_a = std::max(0, -shift_y), top_b = std::max(0, shift_y);
  Overlap sums;
  for (int y = 0; y < height; ++y) {
    AddRow(a + (top_a + y) * shape.width + left_a, b + (top_b + y) * shape.width + left_b, width, &sums);
  }
  const double count = sums.count, mean_a = sums.sum_a / count, mean_b = sums.sum_b / count;
  const double variance_a = std::max(1.0, sums.square_a / count - mean_a * mean_a);
  const double variance_b = std::max(1.0, sums.square_b / count - mean_b * mean_b);
  const double covariance = sums.product / count - mean_a * mean_b;
  const double correlation = covariance / std::sqrt(variance_a * variance_b);
  const double part = count / (shape.width * shape.height);
  return 2 * kThumbnailContrast * kThumbnailContrast * std::max(0.0, 1 - correlation) / part;
}

// Refines the shift of the coarse search, pixel by pixel.
double BestDifference(const ThumbnailShape& shape, const std::int8_t* stored, const std::int8_t* wanted,
                      cv::Point start) {
  double best = std::numeric_limits<double>::infinity();
  for (int y = -1; y <= 1; ++y) {
    for (int x = -1; x <= 1; ++x) {
      best = std::min(best, DifferenceAt(shape, stored, wanted, start.x + x, start.y + y));
    }
  }
  return best;
}

void SortHits(std::vector<ThumbnailArray::Hit>* hits) {
  std::sort(hits->begin(), hits->end(), [](const auto& a, const auto& b) {
    return a.difference != b.difference ? a.difference < b.difference : a.slot < b.slot;
  });
}

}  // namespace

PackedThumbnail Pack(const SmallBlurryImage& image) {
  const cv::Mat& pixels = image.pixels;
  PackedThumbnail packed;
  if (pixels.type() != CV_32FC1 || pixels.empty()) return packed;
  const cv::Size size(std::max(1, pixels.cols / 2), std::max(1, pixels.rows / 2));
  cv::Mat half;
  cv::resize(pixels, half, size, 0, 0, cv::INTER_AREA);
  // Window light and vignetting are similar in many places, unlike the objects there.
  cv::Mat shading;
  cv::GaussianBlur(half, shading, {}, kShadingSigma * size.width);
  half -= shading;
  cv::Scalar mean, deviation;
  cv::meanStdDev(half, mean, deviation);
  const float scale = kThumbnailContrast / std::max(kMinDeviation, static_cast<float>(deviation[0]));
  packed.width = static_cast<std::uint16_t>(size.width);
  packed.height = static_cast<std::uint16_t>(size.height);
  packed.pixels.reserve(half.total());
  for (int y = 0; y < half.rows; ++y) {
    for (int x = 0; x < half.cols; ++x)
      packed.pixels.push_back(ToByte((half.at<float>(y, x) - static_cast<float>(mean[0])) * scale));
  }
  return packed;
}

ThumbnailShape::ThumbnailShape(int width_px, int height_px)
    : width(width_px),
      height(height_px),
      reach_x(ReachOf(width_px)),
      reach_y(ReachOf(height_px)),
      columns(std::clamp((width_px - 2 * reach_x) / kCell, 0, 32)),
      rows(std::clamp((height_px - 2 * reach_y) / kCell, 0, 32)),
      fine_bytes(static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px)),
      coarse_bytes((static_cast<std::size_t>(columns * rows) + kBlock - 1) / kBlock * kBlock) {}

ThumbnailArray::ThumbnailArray(int width, int height, std::size_t capacity)
    : shape_(width, height),
      capacity_(capacity),
      coarse_(new std::int8_t[capacity * shape_.coarse_bytes]),
      fine_(new std::int8_t[capacity * shape_.fine_bytes]),
      owners_(new Owner[capacity]) {}

std::size_t ThumbnailArray::Append(const PackedThumbnail& thumbnail, Owner owner) {
  CV_Assert(size_ < capacity_ && thumbnail.pixels.size() == shape_.fine_bytes);
  const std::size_t slot = size_++;
  std::int8_t* const fine = fine_.get() + slot * shape_.fine_bytes;
  std::memcpy(fine, thumbnail.pixels.data(), shape_.fine_bytes);
  if (shape_.coarse_bytes > 0) {
    MakeCoarse(shape_, fine, 0, 0,
               std::span(coarse_.get() + slot * shape_.coarse_bytes, shape_.coarse_bytes));
  }
  owners_[slot] = owner;
  return slot;
}

std::size_t ThumbnailArray::Append(const ThumbnailArray& from, std::size_t slot) {
  CV_Assert(size_ < capacity_ && from.shape_.fine_bytes == shape_.fine_bytes);
  std::memcpy(fine_.get() + size_ * shape_.fine_bytes, from.fine_.get() + slot * shape_.fine_bytes,
              shape_.fine_bytes);
  std::memcpy(coarse_.get() + size_ * shape_.coarse_bytes, from.coarse_.get() + slot * shape_.coarse_bytes,
              shape_.coarse_bytes);
  owners_[size_] = from.owners_[slot];
  return size_++;
}

bool ThumbnailArray::Holds(std::size_t slot, const PackedThumbnail& thumbnail) const {
  return thumbnail.pixels.size() == shape_.fine_bytes &&
         std::memcmp(fine_.get() + slot * shape_.fine_bytes, thumbnail.pixels.data(), shape_.fine_bytes) == 0;
}

std::vector<ThumbnailArray::Hit> ThumbnailArray::Search(const PackedThumbnail& wanted, std::size_t size,
                                                        std::size_t count) const {
  std::vector<std::size_t> slots;
  if (size <= count || shape_.coarse_bytes == 0) {
    slots.resize(size);
    for (std::size_t slot = 0; slot < size; ++slot) slots[slot] = slot;
  } else {
    const CoarseQuery query(shape_, wanted);
    std::vector<std::int32_t> scores(size + 1);
    constexpr std::size_t kTypicalLength = 64;  // For images with an aspect ratio of 4:3.
    const auto score = shape_.coarse_bytes == kTypicalLength ? ScoreAll<kTypicalLength> : ScoreAll<0>;
    score(query, coarse_.get(), shape_.coarse_bytes, size, scores.data());
    scores.resize(size);
    std::vector<std::int32_t> ranked = scores;
    const auto last = ranked.begin() + static_cast<std::ptrdiff_t>(count - 1);
    std::nth_element(ranked.begin(), last, ranked.end(), std::greater<>());
    // Among those that tie with the last one, the earlier slots are taken.
    auto ties = static_cast<std::size_t>(std::count(ranked.begin(), last + 1, *last));
    for (std::size_t slot = 0; slot < size; ++slot) {
      if (scores[slot] > *last) slots.push_back(slot);
      if (scores[slot] == *last && ties > 0) {
        slots.push_back(slot);
        --ties;
      }
    }
  }
  return Search(wanted, slots);
}

std::vector<ThumbnailArray::Hit> ThumbnailArray::Search(const PackedThumbnail& wanted,
                                                        std::span<const std::size_t> slots) const {
  const CoarseQuery query(shape_, wanted);
  std::vector<Hit> hits;
  hits.reserve(slots.size());
  for (const std::size_t slot : slots) {
    const std::int8_t* const stored = fine_.get() + slot * shape_.fine_bytes;
    const cv::Point start = query.BestShift(coarse_.get() + slot * shape_.coarse_bytes, shape_.coarse_bytes);
    hits.push_back({slot, BestDifference(shape_, stored, wanted.pixels.data(), start)});
  }
  SortHits(&hits);
  return hits;
}

}  // namespace docent::engine
