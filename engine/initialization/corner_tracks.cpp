// SPDX-License-Identifier: Apache-2.0
#include "engine/initialization/corner_tracks.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "engine/base/median.h"
#include "engine/base/option_check.h"
#include "engine/vision/patch.h"
#include "engine/vision/rotation_alignment.h"

namespace docent::engine {

namespace {

constexpr float kMinCorrelation = 0.8f;
constexpr float kMaxRoundTripPx = 0.7f;  // of the corner's level, tracked forwards and backwards
constexpr double kFineGrid = 2;          // its density, for scenes of low texture
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

// The best corners of a level, one per grid cell so that they cover the image: at most `count` together with
// those that are tracked, whose cells receive none. tracked: pixels of the level. density: by which the edge
// of a cell is divided.
std::vector<Corner> SpreadCorners(const ImageFeatures& features, std::size_t level, int count, double density,
                                  std::span<const Eigen::Vector2d> tracked) {
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
  for (const Eigen::Vector2d& pixel : tracked) {
    const int column = std::clamp(static_cast<int>(pixel.x() / cell), 0, columns - 1),
              row = std::clamp(static_cast<int>(pixel.y() / cell), 0, rows - 1);
    best[static_cast<std::size_t>(row * columns + column)].score = 0;
  }
  std::erase_if(best, [](const Best& place) { return place.score < 30.0f; });
  std::stable_sort(best.begin(), best.end(), [](const Best& a, const Best& b) { return a.score > b.score; });
  std::vector<Corner> corners;
  for (const Best& place : best) {
    if (static_cast<int>(corners.size() + tracked.size()) >= count) break;
    corners.push_back(place.corner);
  }
  return corners;
}

}  // namespace

std::optional<std::string> CornerTracksOptions::Validate() const {
  return OptionCheck()
      .That(std::ranges::all_of(corners, [](int count) { return count >= 0; }),
            "The number of corners of a level must be at least 0.")
      .AtLeast(low_texture_corners, 0, "number of corners in a scene of low texture")
      .Ratio(min_alive_ratio, "ratio of tracked corners")
      .AtLeast(min_alive, 0, "number of tracked corners")
      .AtLeast(max_age_frames, 1, "age of the first view")
      .AtLeast(ToSeconds(max_age), 0, "age of the first view")
      .Ratio(next_view_alive_ratio, "ratio of tracked corners")
      .Within(max_views, 1, static_cast<double>(CornerTracks::kMaxViews), "number of first views")
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
  views_.clear();
  previous_.reset();
}

void CornerTracks::AddCorners(const ImageFeatures& features, double density) {
  std::vector<Eigen::Vector2d> tracked;
  for (std::size_t level = 0; level < options_.corners.size(); ++level) {
    tracked.clear();
    for (const Trail& trail : trails_) {
      if (trail.level == static_cast<int>(level))
        tracked.push_back(LevelFromLevelZero(trail.now.pixel.cast<double>(), trail.level));
    }
    for (const Corner& corner : SpreadCorners(features, level, options_.corners[level], density, tracked)) {
      Trail trail;
      trail.now.pixel =
          LevelZeroFromLevel(Eigen::Vector2d(corner.x, corner.y), static_cast<int>(level)).cast<float>();
      trail.level = static_cast<int>(level);
      trail.id = next_id_++;
      trail.pixels[image_ % kRememberedImages] = trail.now.pixel;
      trails_.push_back(trail);
    }
  }
}

void CornerTracks::AddView(Timestamp time, const std::shared_ptr<const ImageFeatures>& features) {
  FirstView view;
  view.time = time;
  view.features = features;
  view.slot = FreeSlot();
  view.corners_at_start = view.alive = trails_.size();
  for (Trail& trail : trails_) {
    trail.views = static_cast<std::uint8_t>(trail.views | (1U << view.slot));
    trail.first[view.slot] = {trail.now.pixel};
  }
  views_.push_back(std::move(view));
}

std::size_t CornerTracks::FreeSlot() const {
  std::size_t slot = 0;
  while (std::ranges::any_of(views_, [&](const FirstView& view) { return view.slot == slot; })) ++slot;
  return slot;
}

void CornerTracks::Start(Timestamp time, const std::shared_ptr<const ImageFeatures>& features) {
  trails_.clear();
  views_.clear();
  images_[++image_ % kRememberedImages] = {time, Rotation3()};
  AddCorners(*features, 1);
  is_low_texture_ = HasFewCorners();
  if (is_low_texture_) {
    trails_.clear();
    AddCorners(*features, kFineGrid);
  }
  AddView(time, features);
  previous_time_ = time;
  previous_ = features;
}

void CornerTracks::TrackTrails(const ImageFeatures& features, const CameraModel& camera,
                               const Rotation3& now_from_previous) {
  std::erase_if(trails_, [&](Trail& trail) {
    const auto ray = camera.Unproject(trail.now.pixel.cast<double>());
    if (!ray) return true;
    const auto prediction = camera.Project(now_from_previous * *ray);
    if (!prediction || !camera.IsInside(*prediction, 6)) return true;
    const auto now =
        TrackPatch(*previous_, trail.now.pixel, features, prediction->cast<float>(), trail.level);
    if (!now || !camera.IsInside(now->cast<double>(), 6)) return true;
    const auto back = TrackPatch(features, *now, *previous_, trail.now.pixel, trail.level);
    if (!back || (*back - trail.now.pixel).norm() > kMaxRoundTripPx * static_cast<float>(1 << trail.level))
      return true;
    trail.now = {*now, *now - trail.now.pixel};
    trail.pixels[image_ % kRememberedImages] = *now;
    return false;
  });
}

void CornerTracks::Track(Timestamp time, const std::shared_ptr<const ImageFeatures>& features,
                         const CameraModel& camera, const Rotation3& now_from_previous) {
  const Eigen::Vector3d rate = now_from_previous.Log() / std::max(ToSeconds(time - previous_time_), 1e-3);
  images_[++image_ % kRememberedImages] = {time, now_from_previous};
  TrackTrails(*features, camera, now_from_previous);
  last_rates_ = {views_.front().age_frames == 0 ? rate : last_rates_[1], rate};
  for (FirstView& view : views_) {
    view.alive = static_cast<std::size_t>(
        std::ranges::count_if(trails_, [&](const Trail& trail) { return trail.IsIn(view.slot); }));
    ++view.age_frames;
    if (view.age_frames == 1) {
      view.rates = {rate, rate};
      for (Trail& trail : trails_) trail.first[view.slot].step = trail.now.step;
    }
    if (view.age_frames == 2) view.rates[1] = rate;
  }
  previous_ = features;
  previous_time_ = time;
  EndViews();
  if (views_.empty()) {
    Start(time, features);
    return;
  }
  const FirstView& newest_view = views_.back();
  const bool lost_many = static_cast<double>(newest_view.alive) <
                         options_.next_view_alive_ratio * static_cast<double>(newest_view.corners_at_start);
  if (!is_low_texture_ || !lost_many || static_cast<int>(views_.size()) == options_.max_views) return;
  AddCorners(*features, 1);
  if (HasFewCorners()) AddCorners(*features, kFineGrid);
  AddView(time, features);
}

bool CornerTracks::HasFewCorners() const {
  return static_cast<int>(trails_.size()) < options_.low_texture_corners;
}

bool CornerTracks::HasEnough(const FirstView& view) const {
  return static_cast<int>(view.alive) >= options_.min_alive;
}

void CornerTracks::EndViews() {
  std::erase_if(views_, [&](const FirstView& view) {
    const bool too_few =
        !HasEnough(view) || static_cast<double>(view.alive) <
                                options_.min_alive_ratio * static_cast<double>(view.corners_at_start);
    const bool ends = too_few || (view.age_frames > options_.max_age_frames &&
                                  previous_time_ - view.time > options_.max_age);
    if (ends) {
      for (Trail& trail : trails_) trail.views = static_cast<std::uint8_t>(trail.views & ~(1U << view.slot));
    }
    return ends;
  });
  std::erase_if(trails_, [](const Trail& trail) { return trail.views == 0; });
}

void CornerTracks::Matches(const FirstView& view, std::vector<InitialPair::Match>* matches,
                           std::vector<std::uint32_t>* ids) const {
  matches->clear();
  ids->clear();
  for (const Trail& trail : trails_) {
    if (!trail.IsIn(view.slot)) continue;
    matches->push_back(
        {trail.first[view.slot].pixel, trail.now.pixel, static_cast<std::uint8_t>(trail.level)});
    ids->push_back(trail.id);
  }
}

CornerSequence CornerTracks::Sequence(const FirstView& view) const {
  const auto count = std::min(kRememberedImages, static_cast<std::uint32_t>(view.age_frames) + 1);
  CornerSequence sequence;
  for (std::uint32_t i = image_ - count + 1; i != image_ + 1; ++i)
    sequence.images.push_back(images_[i % kRememberedImages]);
  for (const Trail& trail : trails_) {
    if (!trail.IsIn(view.slot)) continue;
    CornerSequence::Corner corner;
    corner.level = static_cast<std::uint8_t>(trail.level);
    for (std::uint32_t i = image_ - count + 1; i != image_ + 1; ++i)
      corner.pixels.push_back(trail.pixels[i % kRememberedImages]);
    sequence.corners.push_back(std::move(corner));
  }
  return sequence;
}

double CornerTracks::MedianMotionPx(const FirstView& view) const {
  std::vector<double> motion;
  motion.reserve(view.alive);
  for (const Trail& trail : trails_) {
    if (trail.IsIn(view.slot)) motion.push_back((trail.now.pixel - trail.first[view.slot].pixel).norm());
  }
  return Median(std::move(motion));
}

double CornerTracks::MedianSpeedChangePx(const FirstView& view) const {
  std::vector<double> changes;
  changes.reserve(view.alive);
  for (const Trail& trail : trails_) {
    if (trail.IsIn(view.slot)) changes.push_back((trail.now.step - trail.first[view.slot].step).norm());
  }
  return Median(std::move(changes));
}

}  // namespace docent::engine
