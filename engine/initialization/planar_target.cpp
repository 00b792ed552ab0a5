// SPDX-License-Identifier: Apache-2.0
#include "engine/initialization/planar_target.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <string>

#include "engine/base/error.h"
#include "engine/base/option_check.h"
#include "engine/recognition/absolute_pose.h"
#include "engine/recognition/vocabulary_tree.h"
#include "engine/vision/features.h"
#include "engine/vision/patch.h"

namespace docent::engine {

namespace {

constexpr int kMinSide = 64;  // pixels, of an image for which features are computed
constexpr std::size_t kMinDescriptors = 100;
constexpr double kDistinct_px = 8;  // of the model: descriptors further apart belong to different points
// A descriptor is stored in several leaves and searched in more; this finds nearly all that an exhaustive
// comparison would.
constexpr std::size_t kStoredLeaves = 4, kSearchedLeaves = 8;
constexpr int kPointsPerLevel = 250;
constexpr float kMinPointScore = 60;  // Shi-Tomasi, grey values squared

// Whole-pixel local maxima of the Shi-Tomasi score on a grid, best first.
std::vector<Corner> SelectPoints(const ImageFeatures& features) {
  const cv::Mat& image = features.levels[0];
  const double cell = std::max(5.0, std::sqrt(static_cast<double>(image.total()) / (1.5 * kPointsPerLevel)));
  const int columns = static_cast<int>(image.cols / cell) + 1, rows = static_cast<int>(image.rows / cell) + 1;
  struct Scored {
    float score = kMinPointScore;
    Corner corner;
  };
  std::vector<Scored> best(static_cast<std::size_t>(columns * rows));
  for (const Corner& corner : features.corners[0]) {
    const float score = ShiTomasiScore(image, corner.x, corner.y);
    Scored& place = best[static_cast<std::size_t>(static_cast<int>(corner.y / cell) * columns +
                                                  static_cast<int>(corner.x / cell))];
    if (score > place.score) place = {score, corner};
  }
  std::erase_if(best, [](const Scored& place) { return place.score <= kMinPointScore; });
  std::stable_sort(best.begin(), best.end(),
                   [](const Scored& a, const Scored& b) { return a.score > b.score; });
  std::vector<Corner> corners;
  for (const Scored& place : best) corners.push_back(place.corner);
  return corners;
}

// Keeps the matches whose rotation agrees with the most common one. True matches differ only by the effect of
// slant.
template <class Match>
void KeepConsistentRotations(std::vector<Match>* matches) {
  constexpr std::size_t kBins = 24;
  constexpr float kFullTurn = 2 * std::numbers::pi_v<float>;
  std::array<int, kBins> votes{};
  const auto bin_of = [](float rotation) {
    const float part = rotation / kFullTurn - std::floor(rotation / kFullTurn);
    return std::min(static_cast<std::size_t>(part * kBins), kBins - 1);
  };
  for (const Match& match : *matches) ++votes[bin_of(match.rotation_rad)];
  std::size_t best = 0;
  int most = -1;
  for (std::size_t i = 0; i < kBins; ++i) {
    const int around = votes[(i + kBins - 1) % kBins] + votes[i] + votes[(i + 1) % kBins];
    if (around > most) {
      most = around;
      best = i;
    }
  }
  std::erase_if(*matches, [&](const Match& match) {
    const std::size_t apart = (bin_of(match.rotation_rad) + kBins - best) % kBins;
    return apart > 3 && apart < kBins - 3;
  });
}

// The second pose from which a distant plane looks nearly the same: tilted to the other side of the line of
// sight (Schweighofer and Pinz 2006).
Rigid3 MirroredPose(const Rigid3& camera_from_target) {
  const Eigen::Vector3d sight = camera_from_target.translation.normalized();
  return {Rotation3::Exp(std::numbers::pi * sight) * camera_from_target.rotation *
              Rotation3::Exp(Eigen::Vector3d(0, 0, std::numbers::pi)),
          camera_from_target.translation};
}

}  // namespace

std::optional<std::string> PlanarTargetOptions::Validate() const {
  return OptionCheck()
      .AtLeast(model_size_px, 64, "size of the image of a planar target")
      .Contained(corners.Validate())
      .AtLeast(max_distance, 1, "distance of descriptors of a planar target")
      .Ratio(max_ratio, "ratio of the distances of two matches")
      .AtLeast(min_matches, 4, "number of matches of a planar target")
      .Positive(consensus_px, "inlier threshold of a planar target")
      .AtLeast(max_points_per_stage, 4, "number of aligned points of a level")
      .Within(min_correlation, -1, 1, "correlation of an aligned patch")
      .Positive(aligned_px, "residual of an aligned point")
      .AtLeast(min_inliers, 4, "number of inliers of a planar target")
      .Ratio(min_inlier_ratio, "inlier ratio of a planar target")
      .fault();
}

PlanarTarget::PlanarTarget(const cv::Mat& gray, double width_m, const PlanarTargetOptions& options)
    : options_(Checked(options)), width_m_(width_m) {
  if (!(width_m > 0) || !std::isfinite(width_m))
    throw Error("The width of the target must be a positive number of metres.");
  if (gray.cols < kMinSide || gray.rows < kMinSide) {
    throw Error("The target image must have at least " + std::to_string(kMinSide) +
                " pixels on each side; this one has " + std::to_string(gray.cols) + " by " +
                std::to_string(gray.rows) + ".");
  }
  height_m_ = width_m * gray.rows / gray.cols;
  const double reduction =
      std::min(1.0, static_cast<double>(options.model_size_px) / std::max(gray.cols, gray.rows));
  cv::resize(gray, levels_[0],
             {std::max(1, static_cast<int>(std::lround(gray.cols * reduction))),
              std::max(1, static_cast<int>(std::lround(gray.rows * reduction)))},
             0, 0, cv::INTER_AREA);
  for (std::size_t level = 1; level < kModelLevels; ++level) {
    const cv::Mat& finer = levels_[level - 1];
    if (finer.cols < 2 * kPatchSize || finer.rows < 2 * kPatchSize) break;
    const cv::Size half(finer.cols / 2, finer.rows / 2);
    cv::resize(finer(cv::Rect(cv::Point(), half * 2)), levels_[level], half, 0, 0, cv::INTER_AREA);
  }
  MakePoints();
  // The levels of a frame are a factor of two apart, and descriptors tolerate a scale change of about a
  // third. Views are therefore described in scale steps of a square root of two down to where the target is
  // small, and also slanted in four directions.
  for (const double scale : {1.0, 0.71, 0.5, 0.35, 0.25}) {
    DescribeView(scale, 1, 0);
    if (scale < 0.3) continue;
    for (int side = 0; side < 4; ++side) DescribeView(scale, 0.6, side * std::numbers::pi / 4);
  }
  if (descriptors_.size() < kMinDescriptors)
    throw Error("This image has too little detail to be detected; choose one with many corners all over.");
  leaves_.resize(VocabularyTree::kLeaves);
  std::array<std::uint32_t, kStoredLeaves> leaves;
  for (std::uint32_t i = 0; i < descriptors_.size(); ++i) {
    const std::size_t count = DefaultVocabulary().NearestLeaves(descriptors_[i].descriptor, leaves);
    for (std::size_t k = 0; k < count; ++k) leaves_[leaves[k]].push_back(i);
  }
}

void PlanarTarget::MakePoints() {
  std::uint32_t id = 0;
  for (std::size_t level = 0; level < kModelLevels; ++level) {
    if (levels_[level].cols < kMinSide || levels_[level].rows < kMinSide) break;
    for (const Corner& corner : SelectPoints(*MakeFeatures(levels_[level]))) {
      points_[level].push_back(
          {id++, LevelZeroFromLevel(Eigen::Vector2d(corner.x, corner.y), static_cast<int>(level))});
    }
  }
}

void PlanarTarget::DescribeView(double scale, double shortening, double shortening_rad) {
  const cv::Mat& model = levels_[0];
  const cv::Size size(static_cast<int>(model.cols * scale), static_cast<int>(model.rows * scale));
  if (size.width < kMinSide || size.height < kMinSide) return;
  cv::Mat view;
  cv::resize(model, view, size, 0, 0, cv::INTER_AREA);
  const Eigen::Array2d scales(static_cast<double>(size.width) / model.cols,
                              static_cast<double>(size.height) / model.rows);
  Eigen::Matrix2d slant = Eigen::Matrix2d::Identity();
  const Eigen::Vector2d middle(0.5 * (size.width - 1), 0.5 * (size.height - 1));
  if (shortening < 1) {
    const Eigen::Vector2d along(std::cos(shortening_rad), std::sin(shortening_rad));
    slant -= (1 - shortening) * along * along.transpose();
    const Eigen::Vector2d offset = middle - slant * middle;
    const cv::Matx23d warp(slant(0, 0), slant(0, 1), offset.x(), slant(1, 0), slant(1, 1), offset.y());
    cv::Mat smooth;
    cv::GaussianBlur(view, smooth, {}, 0.6);  // prevents aliasing in the shortened direction
    cv::warpAffine(smooth, view, warp, size, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  }
  CornerDescriptionOptions corners = options_.corners;
  corners.corners = {static_cast<int>((shortening < 1 ? 280 : 400) * scale) + 40, 0, 0, 0};
  const Eigen::Matrix2d back = slant.inverse();
  for (const DescribedKeypoint& place : DescribeCorners(*MakeFeatures(view), corners)) {
    const Eigen::Vector2d in_scaled = middle + back * (place.pixel.cast<double>() - middle);
    const Eigen::Vector2d pixel = (in_scaled.array() + 0.5) / scales - 0.5;
    // Beyond the edge of the image there are only replicated pixels.
    if (pixel.x() < 4 || pixel.y() < 4 || pixel.x() > model.cols - 5 || pixel.y() > model.rows - 5) continue;
    const double angle = place.oriented.direction_rad;
    const Eigen::Vector2d direction = back * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    descriptors_.push_back(
        {place.oriented.descriptor, pixel, static_cast<float>(std::atan2(direction.y(), direction.x()))});
  }
}

Eigen::Vector3d PlanarTarget::InTarget(const Eigen::Vector2d& model_pixel) const {
  return {((model_pixel.x() + 0.5) / levels_[0].cols - 0.5) * width_m_,
          ((model_pixel.y() + 0.5) / levels_[0].rows - 0.5) * height_m_, 0};
}

std::vector<PlanarTarget::DescriptorMatch> PlanarTarget::MatchDescriptors(
    const ImageFeatures& features) const {
  std::vector<DescriptorMatch> matches;
  std::array<std::uint32_t, kSearchedLeaves> leaves;
  for (const DescribedKeypoint& place : DescribeCorners(features, options_.corners)) {
    int best = std::numeric_limits<int>::max(), second = best;
    const ModelDescriptor* nearest = nullptr;
    const std::size_t count = DefaultVocabulary().NearestLeaves(place.oriented.descriptor, leaves);
    for (std::size_t k = 0; k < count; ++k) {
      for (const std::uint32_t index : leaves_[leaves[k]]) {
        const ModelDescriptor& candidate = descriptors_[index];
        const int distance = SquaredDistance(place.oriented.descriptor, candidate.descriptor);
        if (distance >= second) continue;
        const bool same_place =
            nearest && (candidate.pixel - nearest->pixel).squaredNorm() < kDistinct_px * kDistinct_px;
        if (distance < best) {
          if (!same_place) second = best;
          best = distance;
          nearest = &candidate;
        } else if (!same_place) {
          second = distance;
        }
      }
    }
    if (!nearest || best > options_.max_distance || !(best < options_.max_ratio * second)) continue;
    matches.push_back(
        {place.pixel.cast<double>(), nearest->pixel, place.oriented.direction_rad - nearest->direction_rad});
  }
  KeepConsistentRotations(&matches);
  return matches;
}

std::optional<TargetDetection> PlanarTarget::Detect(const ImageFeatures& features, const CameraModel& camera,
                                                    std::uint64_t seed) const {
  std::vector<Eigen::Vector3d> rays, points;
  for (const DescriptorMatch& match : MatchDescriptors(features)) {
    const auto ray = camera.Unproject(match.pixel);
    if (!ray) continue;
    rays.push_back(*ray);
    points.push_back(InTarget(match.model_pixel));
  }
  AbsolutePoseOptions options;
  options.pixel_angle = camera.PixelAngle();
  options.inlier_px = options_.consensus_px;
  options.max_iterations = 1000;
  options.min_inliers = options_.min_matches;
  options.seed = seed;
  const auto consensus = EstimateAbsolutePose(rays, points, options);
  if (!consensus) return std::nullopt;
  auto detection = Align(features, camera, consensus->camera_from_map);
  // A distant plane has two poses that look nearly alike; alignment from both shows which one fits better.
  const auto other = Align(
      features, camera, MirroredPose(detection ? detection->camera_from_target : consensus->camera_from_map));
  const auto score = [](const std::optional<TargetDetection>& s) {
    return s ? static_cast<double>(s->points.size()) / (0.1 + s->rms_px) : 0.0;
  };
  return score(other) > score(detection) ? other : detection;
}

}  // namespace docent::engine
