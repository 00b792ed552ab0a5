// SPDX-License-Identifier: Apache-2.0
#include "ui/image_degradation.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "engine/base/time.h"
#include "ui/gray_level.h"

namespace docent::ui {
namespace {

// Noise: 432 blocks of 8 x 8 pixels. Blocks without texture vary by a tenth, so that the tenth of the blocks
// with the least variation is below the true deviation by about 12 %, where an image has no texture at all.
constexpr int kBlocksAcross = 24, kBlocksDown = 18, kBlockPx = 8;
constexpr double kSmoothestShare = 0.1, kSmoothestBias = 1.12;
constexpr double kOperatorGain = 6;  // Of Immerkaer's operator: the root of the sum of its squares.
constexpr int kDarkest = 16, kBrightest = 240;  // Mean of a block; beyond, noise is clipped.
constexpr double kNoiseSmoothing = 0.1;         // A third of a second at 30 images/s.

// Motion: with fewer points, or after a longer pause, it is not known.
constexpr std::size_t kLeastPoints = 20;
constexpr double kLongestInterval_s = 0.15;

// Exposure: shorter motions blur less than the noise of the estimate.
constexpr float kLeastMotion_px = 4, kGreatestMotion_px = 24;
constexpr int kMaxPatches = 16, kLeastPatches = 6, kPatchRadius = 5;
// The share of the interval between two images, of which the blur is tried.
constexpr std::array<double, 5> kShares = {0, 0.25, 0.5, 0.75, 1};

// Sums of squared differences of grey levels along a direction and across it.
struct Variation {
  double along = 0, across = 0;

  double Ratio() const { return across > 0 ? along / across : 1; }
};

// The mean of the image over a line of this length about a pixel.
double MeanAlong(const cv::Mat& image, int x, int y, const Eigen::Vector2f& direction, double length_px) {
  const double half = std::max(0.5, 0.5 * length_px);
  const int last = static_cast<int>(std::ceil(half - 0.5));
  double sum = 0;
  for (int step = -last; step <= last; ++step) {
    const double weight = std::min(1.0, half + 0.5 - std::abs(step));  // The part of the step on the line.
    sum +=
        weight * GrayLevel(image, x + static_cast<int>(std::lround(static_cast<float>(step) * direction.x())),
                           y + static_cast<int>(std::lround(static_cast<float>(step) * direction.y())));
  }
  return sum / (2 * half);
}

// Adds the variation of the patch about a pixel after a blur of this length. The image must contain it.
void AddVariation(const cv::Mat& image, const Eigen::Vector2i& middle, const Eigen::Vector2f& direction,
                  double blur_px, Variation* variation) {
  constexpr int kSide = 2 * kPatchRadius + 3;
  std::array<std::array<double, kSide>, kSide> levels{};
  for (int v = 0; v < kSide; ++v) {
    for (int u = 0; u < kSide; ++u) {
      levels[static_cast<std::size_t>(v)][static_cast<std::size_t>(u)] = MeanAlong(
          image, middle.x() + u - kPatchRadius - 1, middle.y() + v - kPatchRadius - 1, direction, blur_px);
    }
  }
  for (std::size_t v = 1; v + 1 < kSide; ++v) {
    for (std::size_t u = 1; u + 1 < kSide; ++u) {
      const double dx = 0.5 * (levels[v][u + 1] - levels[v][u - 1]),
                   dy = 0.5 * (levels[v + 1][u] - levels[v - 1][u]);
      const double along = dx * direction.x() + dy * direction.y(),
                   across = dy * direction.x() - dx * direction.y();
      variation->along += along * along;
      variation->across += across * across;
    }
  }
}

bool Contains(const cv::Mat& image, const Eigen::Vector2i& middle, int margin) {
  return middle.x() >= margin && middle.y() >= margin && middle.x() + margin < image.cols &&
         middle.y() + margin < image.rows;
}

// The share at which the ratio of the blurred keyframes, which falls, is that of the live image.
double ShareOf(const std::array<Variation, kShares.size()>& blurred, double live_ratio) {
  double before = std::log(blurred[0].Ratio());
  const double wanted = std::log(live_ratio);
  if (!(wanted < before)) return 0;
  for (std::size_t i = 1; i < kShares.size(); ++i) {
    const double after = std::log(blurred[i].Ratio());
    if (wanted >= after && before > after)
      return std::lerp(kShares[i - 1], kShares[i], (before - wanted) / (before - after));
    before = std::min(before, after);
  }
  return 1;
}

}  // namespace

void DegradationEstimator::EstimateNoise(const cv::Mat& image) {
  std::array<double, static_cast<std::size_t>(kBlocksAcross * kBlocksDown)> variances{};
  std::size_t count = 0;
  const int free_x = image.cols - kBlockPx - 2, free_y = image.rows - kBlockPx - 2;
  if (free_x < kBlocksAcross || free_y < kBlocksDown) return;
  for (int block = 0; block < kBlocksAcross * kBlocksDown; ++block) {
    const int left = 1 + block % kBlocksAcross * free_x / kBlocksAcross,
              top = 1 + block / kBlocksAcross * free_y / kBlocksDown;
    std::array<std::array<int, kBlockPx + 2>, kBlockPx + 2> levels{};
    int sum = 0;
    for (int v = 0; v < kBlockPx + 2; ++v) {
      for (int u = 0; u < kBlockPx + 2; ++u) {
        const int level = GrayLevel(image, left + u - 1, top + v - 1);
        levels[static_cast<std::size_t>(v)][static_cast<std::size_t>(u)] = level;
        sum += level;
      }
    }
    const int mean = sum / ((kBlockPx + 2) * (kBlockPx + 2));
    if (mean < kDarkest || mean > kBrightest) continue;
    double squares = 0;
    for (std::size_t v = 1; v <= kBlockPx; ++v) {
      for (std::size_t u = 1; u <= kBlockPx; ++u) {
        const auto& above = levels[v - 1];
        const auto& row = levels[v];
        const auto& below = levels[v + 1];
        const int response = above[u - 1] - 2 * above[u] + above[u + 1] - 2 * row[u - 1] + 4 * row[u] -
                             2 * row[u + 1] + below[u - 1] - 2 * below[u] + below[u + 1];
        squares += response * response;
      }
    }
    variances[count++] = squares / (kBlockPx * kBlockPx);
  }
  if (count < kLeastPoints) return;
  const auto end = variances.begin() + static_cast<std::ptrdiff_t>(count);
  const auto chosen =
      variances.begin() + static_cast<std::ptrdiff_t>(kSmoothestShare * static_cast<double>(count));
  std::nth_element(variances.begin(), chosen, end);
  const auto noise = static_cast<float>(kSmoothestBias * std::sqrt(*chosen) / kOperatorGain / 255);
  degradation_.noise =
      knows_noise_ ? std::lerp(degradation_.noise, noise, static_cast<float>(kNoiseSmoothing)) : noise;
  knows_noise_ = true;
}

bool DegradationEstimator::EstimateMotion(const engine::TrackedFrame& tracked) {
  now_count_ = 0;
  for (const engine::PointMatch& match : tracked.matches) {
    if (!match.inlier || now_count_ == kMaxPoints) continue;
    now_[now_count_++] = {match.point, {match.pixel.x(), match.pixel.y()}};
  }
  const auto by_point = [](const Seen& a, const Seen& b) { return a.point < b.point; };
  std::sort(now_.begin(), now_.begin() + static_cast<std::ptrdiff_t>(now_count_), by_point);
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Matrix<double, 3, 2> right = Eigen::Matrix<double, 3, 2>::Zero();
  std::size_t common = 0;
  for (std::size_t i = 0, j = 0; i < before_count_ && j < now_count_;) {
    if (before_[i].point < now_[j].point) {
      ++i;
    } else if (now_[j].point < before_[i].point) {
      ++j;
    } else {
      const Eigen::Vector3d place(now_[j].pixel.x, now_[j].pixel.y, 1);
      const glm::vec2 flow = now_[j].pixel - before_[i].pixel;
      normal += place * place.transpose();
      right += place * Eigen::RowVector2d(flow.x, flow.y);
      ++common, ++i, ++j;
    }
  }
  if (common < kLeastPoints) return false;
  // A pixel of deviation keeps points on a line from giving any slope across it.
  normal(0, 0) += static_cast<double>(common);
  normal(1, 1) += static_cast<double>(common);
  const Eigen::Matrix<double, 3, 2> affine = normal.ldlt().solve(right);
  if (!affine.allFinite()) return false;
  for (int column = 0; column < 3; ++column)
    flow_per_frame_[column] = glm::vec2(affine(column, 0), affine(column, 1));
  return true;
}

void DegradationEstimator::EstimateExposure(const engine::TrackedFrame& tracked, double interval_s) {
  const cv::Mat& image = tracked.frame.image;
  std::array<Variation, kShares.size()> blurred{};
  Variation live;
  int patches = 0;
  const std::size_t stride = std::max<std::size_t>(1, tracked.matches.size() / (8 * kMaxPatches));
  for (std::size_t i = 0; i < tracked.matches.size() && patches < kMaxPatches; i += stride) {
    const engine::PointMatch& match = tracked.matches[i];
    if (!match.inlier || match.level != 0) continue;
    const engine::MapPoint* const point = tracked.map->FindPoint(match.point);
    if (point == nullptr || point->source_level != 0) continue;
    const engine::KeyFrame* const source = tracked.map->FindKeyFrame(point->source_keyframe);
    if (source == nullptr) continue;
    const glm::vec2 flow = flow_per_frame_ * glm::vec3(match.pixel.x(), match.pixel.y(), 1.0f);
    const float length_px = glm::length(flow);
    if (length_px < kLeastMotion_px || length_px > kGreatestMotion_px) continue;
    const Eigen::Vector2f direction(flow.x / length_px, flow.y / length_px);
    source->features->MarkInUse();
    const cv::Mat& then = source->features->levels[0];
    const Eigen::Vector2i in_then = point->source_pixel.array().round().cast<int>(),
                          in_now = match.pixel.array().round().cast<int>();
    const int margin = kPatchRadius + 2;
    if (!Contains(image, in_now, margin) ||
        !Contains(then, in_then, margin + static_cast<int>(std::ceil(0.5f * length_px))))
      continue;
    AddVariation(image, in_now, direction, 0, &live);
    for (std::size_t k = 0; k < kShares.size(); ++k)
      AddVariation(then, in_then, direction, kShares[k] * length_px, &blurred[k]);
    ++patches;
  }
  if (patches < kLeastPatches) return;
  // Half the variance of the noise is in each squared difference.
  constexpr int kPatchPixels = (2 * kPatchRadius + 1) * (2 * kPatchRadius + 1);
  const double noise = 255.0 * degradation_.noise;
  const double by_noise = 0.5 * noise * noise * kPatchPixels * patches;
  live.along = std::max(live.along - by_noise, 0.1 * by_noise);
  live.across -= by_noise;
  if (!(live.across > by_noise && live.along > 0)) return;  // There is nothing but noise.
  const double exposure_s = ShareOf(blurred, live.Ratio()) * interval_s;
  exposures_s_[exposure_count_++ % kRememberedExposures] = exposure_s;
  std::array<double, kRememberedExposures> sorted = exposures_s_;
  const auto count = static_cast<std::ptrdiff_t>(std::min(exposure_count_, kRememberedExposures));
  std::nth_element(sorted.begin(), sorted.begin() + count / 2, sorted.begin() + count);
  exposure_s_ = sorted[static_cast<std::size_t>(count / 2)];
}

const ImageDegradation& DegradationEstimator::Update(const engine::TrackedFrame* tracked) {
  degradation_.motion = glm::mat3x2(0.0f);
  if (tracked == nullptr || tracked->frame.image.empty()) return degradation_;
  EstimateNoise(tracked->frame.image);
  ++degradation_.noise_seed;
  if (tracked->map == nullptr || !engine::HasPose(tracked->state)) {
    before_count_ = 0;
    return degradation_;
  }
  const double now_s = ToSeconds(tracked->frame.time), interval_s = now_s - before_s_;
  if (tracked->map_key != map_key_) before_count_ = 0;
  map_key_ = tracked->map_key;
  const bool moves = EstimateMotion(*tracked) && interval_s > 0 && interval_s < kLongestInterval_s;
  if (moves) {
    EstimateExposure(*tracked, interval_s);
    degradation_.motion = flow_per_frame_ * static_cast<float>(std::min(1.0, exposure_s_ / interval_s));
  }
  std::copy_n(now_.begin(), now_count_, before_.begin());
  before_count_ = now_count_;
  before_s_ = now_s;
  return degradation_;
}

}  // namespace docent::ui
