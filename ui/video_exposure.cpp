// SPDX-License-Identifier: Apache-2.0
#include "ui/video_exposure.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>
#include <span>

#include "engine/dense/surface_samples.h"
#include "ui/gray_level.h"

namespace docent::ui {
namespace {

// The median of this many ratios of patches, which differ by a tenth with noise and view, is right to 3 %.
constexpr std::size_t kLeastPoints = 20;
// A jump of the exposure is followed at once; smaller changes are mostly noise of the median.
constexpr double kJump = 0.15, kSmoothing = 0.3;
// The balance changes slowly: a second at 30 images/s.
constexpr double kBalanceSmoothing = 0.03;
constexpr double kBelief = 0.5;           // The part of the estimated white balance that counts.
constexpr double kLargestBalance = 0.25;  // As a logarithm: beyond it, it is the colour of things.
constexpr int kDarkest = 6, kBrightest = 250;
// Lens shading: ratios that deviate more are not of the same thing; what was measured counts half as much
// after 140 images. In squared half diagonals, an image of 200 points that fill it weighs about 12, so that
// the estimate is believed after some ten images with differing places, and one lens for both is assumed
// first.
constexpr double kLargestDeviation = 0.5, kShadingMemory = 0.995;
constexpr double kNoShading = 5, kSameShading = 20;
constexpr double kLargestShading = 1.5;  // As a logarithm: a fifth of the light is left in the corners.

const std::array<double, 256>& LinearTable() {
  static const std::array<double, 256> kTable = [] {
    std::array<double, 256> table{};
    for (int level = 0; level < 256; ++level)
      table[static_cast<std::size_t>(level)] = engine::LinearFromLevel(level);
    return table;
  }();
  return kTable;
}

// The mean linear brightness of 3 x 3 pixels that are `step` apart; empty at the border and where one is
// saturated or black.
std::optional<double> Brightness(const cv::Mat& image, const Eigen::Vector2f& pixel, int step) {
  const auto x = static_cast<int>(std::lround(pixel.x())), y = static_cast<int>(std::lround(pixel.y()));
  if (x < step || y < step || x + step >= image.cols || y + step >= image.rows) return std::nullopt;
  double sum = 0;
  for (int v = -step; v <= step; v += step) {
    for (int u = -step; u <= step; u += step) {
      const int level = GrayLevel(image, x + u, y + v);
      if (level < kDarkest || level > kBrightest) return std::nullopt;
      sum += LinearTable()[static_cast<std::size_t>(level)];
    }
  }
  return sum / 9;
}

// The square of the distance from the middle of an image, in half diagonals.
double SquaredRadius(const cv::Size& size, const Eigen::Vector2f& pixel) {
  const Eigen::Vector2d middle(0.5 * (size.width - 1), 0.5 * (size.height - 1));
  return (pixel.cast<double>() - middle).squaredNorm() / std::max(1.0, middle.squaredNorm());
}

}  // namespace

double VideoExposure::GainOf(const engine::TrackedFrame& tracked) {
  const cv::Mat& image = tracked.frame.image;
  const std::size_t stride = std::max<std::size_t>(1, tracked.matches.size() / kMaxPoints);
  std::size_t count = 0;
  for (std::size_t i = 0; i < tracked.matches.size() && count < kMaxPoints; i += stride) {
    const engine::PointMatch& match = tracked.matches[i];
    if (!match.inlier) continue;
    const engine::MapPoint* const point = tracked.map->FindPoint(match.point);
    const engine::KeyFrame* const source =
        point != nullptr ? tracked.map->FindKeyFrame(point->source_keyframe) : nullptr;
    if (source == nullptr) continue;
    source->features->MarkInUse();
    const cv::Mat& level = source->features->levels[point->source_level];
    const auto then = Brightness(level, point->source_pixel, 1);
    const auto now = Brightness(image, match.pixel, 1 << match.level);
    if (!then || !now) continue;
    ratios_[count++] = {*now / *then, SquaredRadius(image.size(), match.pixel),
                        SquaredRadius(level.size(), point->source_pixel)};
  }
  if (count < kLeastPoints) return 0;
  const auto middle = ratios_.begin() + static_cast<std::ptrdiff_t>(count / 2);
  std::nth_element(ratios_.begin(), middle, ratios_.begin() + static_cast<std::ptrdiff_t>(count),
                   [](const Ratio& a, const Ratio& b) { return a.value < b.value; });
  const double gain = middle->value;
  EstimateShading(gain, std::span(ratios_).first(count));
  return gain;
}

// The logarithm of a ratio is that of the gain, plus the shading now, minus the shading of the keyframe.
void VideoExposure::EstimateShading(double gain, std::span<const Ratio> ratios) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  const auto row_of = [&](const Ratio& ratio) {
    return Eigen::Vector3d(ratio.now, -ratio.then, std::log(ratio.value / gain));
  };
  double count = 0;
  for (const Ratio& ratio : ratios) {
    const Eigen::Vector3d row = row_of(ratio);
    if (std::abs(row.z()) > kLargestDeviation) continue;
    mean += row;
    ++count;
  }
  if (count < kLeastPoints) return;
  mean /= count;
  shading_normal_ *= kShadingMemory;
  shading_right_ *= kShadingMemory;
  for (const Ratio& ratio : ratios) {
    Eigen::Vector3d row = row_of(ratio);
    if (std::abs(row.z()) > kLargestDeviation) continue;
    row -= mean;
    shading_normal_ += row.head<2>() * row.head<2>().transpose();
    shading_right_ += row.head<2>() * row.z();
  }
  Eigen::Matrix2d normal = shading_normal_ + kNoShading * Eigen::Matrix2d::Identity();
  normal += kSameShading * Eigen::Vector2d(1, -1) * Eigen::RowVector2d(1, -1);
  const Eigen::Vector2d shading = normal.inverse() * shading_right_;
  shading_ = std::clamp(shading.x(), -kLargestShading, kLargestShading);
  shading_reference_ = mean.x();
}

// The colour of the light by the Minkowski norm of degree 6 of the image (Finlayson and Trezzi, 2004).
void VideoExposure::Balance(const cv::Mat& bgr) {
  if (bgr.type() != CV_8UC3) return;
  constexpr int kSamples = 48;  // Along each side.
  glm::dvec3 sum(0);
  for (int v = 0; v < kSamples; ++v) {
    for (int u = 0; u < kSamples; ++u) {
      const auto& pixel = bgr.at<cv::Vec3b>(v * bgr.rows / kSamples, u * bgr.cols / kSamples);
      if (std::max({pixel[0], pixel[1], pixel[2]}) > kBrightest) continue;
      for (int c = 0; c < 3; ++c) sum[c] += std::pow(LinearTable()[pixel[2 - c]], 6);
    }
  }
  if (!(sum.x > 0 && sum.y > 0 && sum.z > 0)) return;
  glm::dvec3 logs = glm::log(sum) / 6.0;
  logs -= (logs.x + logs.y + logs.z) / 3;
  logs = glm::clamp(kBelief * logs, -kLargestBalance, kLargestBalance);
  log_balance_ = is_known_ ? glm::mix(log_balance_, logs, kBalanceSmoothing) : logs;
}

const glm::vec3& VideoExposure::Update(const engine::TrackedFrame* tracked) {
  if (tracked == nullptr || tracked->map == nullptr || tracked->frame.image.empty()) return exposure_;
  const double gain = GainOf(*tracked);
  if (!(gain > 0)) return exposure_;
  if (tracked->map_key != map_key_) is_known_ = false;
  map_key_ = tracked->map_key;
  const double log_gain = std::log(gain);
  const bool jumps = !is_known_ || std::abs(log_gain - log_gain_) > kJump;
  log_gain_ = jumps ? log_gain : std::lerp(log_gain_, log_gain, kSmoothing);
  Balance(tracked->frame.image);
  is_known_ = true;
  exposure_ = glm::vec3(glm::exp(log_balance_ + log_gain_));
  return exposure_;
}

}  // namespace docent::ui
