// SPDX-License-Identifier: Apache-2.0
#include "engine/initialization/corner_tracks.h"

#include <algorithm>
#include <cmath>

#include "engine/base/median.h"
#include "engine/base/option_check.h"
#include "engine/vision/patch.h"
#include "engine/vision/rotation_alignment.h"

namespace docent::engine {

namespace {

constexpr float kMinCorrelation = 0.8f;
constexpr float kMaxRoundTripPx = 0.7f;  // of the corner's level, tracked forwards and backwards
constexpr float kMaxStepPx = 4.0f;       // of each level: how far the alignment may move from the prediction

// Tracks one patch of `from` into `to`, from coarse levels to the corner's own level.
std::optional<Eigen::Vector2f> TrackPatch(const ImageFeatures& from, const Eigen::Vector2f& pixel,
                                          const ImageFeatures& to, const Eigen::Vector2f& prediction,
                                          int level) {
  Eigen::Vector2d guess = prediction.cast<double>();
  PatchTemplate patch;
  for (int l = kPyramidLevels - 1; l >= level; --l) {
    const auto index = static_cast<std::size_t>(l);
    const Eigen::Vector2f source = LevelFromLevelZero(pixel.cast<double>(), l).cast<float>();
    const bool finest = l == level;
    const bool cut = CutPatch(from.levels[index], source, Eigen::Matrix2f::Identity(), &patch);
    std::optional<PatchAlignment> aligned;
    if (cut) {
      aligned =
          AlignPatch(patch, to.levels[index], LevelFromLevelZero(guess, l).cast<float>(), kMaxStepPx, 12);
    }
    if (aligned && aligned->correlation > kMinCorrelation) {
      guess = LevelZeroFromLevel(aligned->pixel.cast<double>(), l);
    } else if (finest) {
      return std::nullopt;
    }
  }
  return guess.cast<float>();
}

// The best corners of a level, at most `count`, one per grid cell so that they cover the image. density: by
// which the edge of a cell is divided.
std::vector<Corner> SpreadCorners(const ImageFeatures& features, std::size_t level, int count,
                                  double density) {
  const cv::Mat& image = features.levels[level];
  const double cell = std::max(8.0, std::sqrt(static_cast<double>(image.total()) / (1.3 * count)) / density);
  const int columns = static_cast<int>(image.cols / cell) + 1, rows = static_cast<int>(image.rows / cell) + 1;
  struct Best {
    float score = 0;
    Corner corner;
  };
  std::vector<Best> best(static_cast<std::size_t>(columns * rows));
  for (const Corner& corner : features.corners[level]) {
    if (!PatchFits(image, corner.x, corner.y, 3.0f)) continue;
    const float score = ShiTomasiScore(image, corner.x, corner.y);
    Best& place = best[static_cast<std::size_t>(static_cast<int>(corner.y / cell) * columns +
                                                static_cast<int>(corner.x / cell))];
    if (score > place.score) place = {score, corner};
  }
  std::erase_if(best, [](const Best& place) { return place.score < 30.0f; });
  std::stable_sort(best.begin(), best.end(), [](const Best& a, const Best& b) { return a.score > b.score; });
  std::vector<Corner> corners;
  for (const Best& place : best) {
    if (static_cast<int>(corners.size()) >= count) break;
    corners.push_back(place.corner);
  }
  return corners;
}

}  // namespace

std::optional<std::string> CornerTracksOptions::Validate() const {
  return OptionCheck()
      .That(std::ranges::all_of(corners, [](int count) { return count >= 0; }),
            "The number of corners of a level must be at least 0.")
      .AtLeast(plain_scene_corners, 0, "number of corners in a plain scene")
      .Ratio(min_alive_ratio, "ratio of tracked corners")
      .AtLeast(min_alive, 0, "number of tracked corners")
      .AtLeast(max_age_frames, 1, "age of the first view")
      .fault();
}

Rotation3 AlignedRotation(const ImageFeatures& previous, const ImageFeatures& now,
                          const CameraModel& camera) {
  const auto rotation = AlignRotation(previous.small_blurry, camera, now.small_blurry, camera);
  return rotation && rotation->converged ? rotation->b_from_a : Rotation3();
}

CornerTracks::CornerTracks(const CornerTracksOptions& options) : options_(Checked(options)) {}

void CornerTracks::Reset() {
  trails_.clear();
  first_.reset();
  previous_.reset();
}

void CornerTracks::AddCorners(const ImageFeatures& features, double density) {
  for (std::size_t level = 0; level < options_.corners.size(); ++level) {
    for (const Corner& corner : SpreadCorners(features, level, options_.corners[level], density)) {
      const Eigen::Vector2f pixel =
          LevelZeroFromLevel(Eigen::Vector2d(corner.x, corner.y), static_cast<int>(level)).cast<float>();
      trails_.push_back({pixel, pixel, static_cast<int>(level), static_cast<std::uint32_t>(trails_.size())});
    }
  }
}

void CornerTracks::Start(Timestamp time, const std::shared_ptr<const ImageFeatures>& features) {
  trails_.clear();
  AddCorners(*features, 1);
  if (static_cast<int>(trails_.size()) < options_.plain_scene_corners) {
    trails_.clear();
    AddCorners(*features, 2);
  }
  trails_at_start_ = trails_.size();
  age_frames_ = 0;
  first_time_ = previous_time_ = time;
  first_ = previous_ = features;
}

void CornerTracks::Track(Timestamp time, const std::shared_ptr<const ImageFeatures>& features,
                         const CameraModel& camera, const Rotation3& now_from_previous) {
  ++age_frames_;
  const Eigen::Vector3d rate = now_from_previous.Log() / std::max(ToSeconds(time - previous_time_), 1e-3);
  last_rates_ = {age_frames_ == 1 ? rate : last_rates_[1], rate};
  if (age_frames_ == 1) first_rates_ = last_rates_;
  if (age_frames_ == 2) first_rates_[1] = rate;
  std::erase_if(trails_, [&](Trail& trail) {
    const auto ray = camera.Unproject(trail.now.cast<double>());
    if (!ray) return true;
    const auto prediction = camera.Project(now_from_previous * *ray);
    if (!prediction || !camera.IsInside(*prediction, 6)) return true;
    const auto now = TrackPatch(*previous_, trail.now, *features, prediction->cast<float>(), trail.level);
    if (!now || !camera.IsInside(now->cast<double>(), 6)) return true;
    const auto back = TrackPatch(*features, *now, *previous_, trail.now, trail.level);
    if (!back || (*back - trail.now).norm() > kMaxRoundTripPx * static_cast<float>(1 << trail.level))
      return true;
    trail.step = *now - trail.now;
    if (age_frames_ == 1) trail.first_step = trail.step;
    trail.now = *now;
    return false;
  });
  previous_ = features;
  previous_time_ = time;
}

bool CornerTracks::ended() const {
  const bool too_few = !has_enough() || static_cast<double>(trails_.size()) <
                                            options_.min_alive_ratio * static_cast<double>(trails_at_start_);
  return too_few || age_frames_ > options_.max_age_frames;
}

double CornerTracks::MedianMotionPx() const {
  std::vector<double> motion;
  motion.reserve(trails_.size());
  for (const Trail& trail : trails_) motion.push_back((trail.now - trail.first).norm());
  return Median(std::move(motion));
}

double CornerTracks::MedianSpeedChangePx() const {
  std::vector<double> changes;
  changes.reserve(trails_.size());
  for (const Trail& trail : trails_) changes.push_back((trail.step - trail.first_step).norm());
  return Median(std::move(changes));
}

}  // namespace docent::engine
