// SPDX-License-Identifier: Apache-2.0
#include "engine/initialization/initializer.h"

#include <algorithm>
#include <cmath>

#include "engine/base/option_check.h"
#include "engine/vision/rotation_alignment.h"

namespace docent::engine {

namespace {

constexpr float kMinCorrelation = 0.8f;
constexpr float kMaxRoundTripPx = 0.7f;  // of the corner's level, tracked forwards and backwards
// Shares of the progress: the image moves enough, and the parallax is significant; the third view is the
// rest.
constexpr double kMotionShare = 0.2, kParallaxShare = 0.6;
constexpr float kMaxStepPx = 4.0f;  // of each level: how far the alignment may move from the prediction

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

using Rays = std::vector<Eigen::Vector3d>;

// Adds the rays of a match. False if one of the pixels has none.
bool Unproject(const InitialPair::Match& match, const CameraModel& a, const CameraModel& b, Rays* rays_a,
               Rays* rays_b) {
  const auto ray_a = a.Unproject(match.pixel_a.cast<double>()),
             ray_b = b.Unproject(match.pixel_b.cast<double>());
  if (!ray_a || !ray_b) return false;
  rays_a->push_back(*ray_a);
  rays_b->push_back(*ray_b);
  return true;
}

bool HasDepth(const TwoViewResult& geometry) {
  return geometry.outcome == TwoViewOutcome::kGeneral || geometry.outcome == TwoViewOutcome::kPlanar;
}

}  // namespace

std::optional<std::string> InitializerOptions::Validate() const {
  return OptionCheck()
      .That(std::ranges::all_of(corners, [](int count) { return count >= 0; }),
            "The number of corners of a level must be at least 0.")
      .AtLeast(plain_scene_corners, 0, "number of corners in a plain scene")
      .AtLeast(min_motion_px, 0, "motion between two views")
      .Ratio(min_alive_ratio, "ratio of tracked corners")
      .AtLeast(min_alive, 0, "number of tracked corners")
      .AtLeast(max_age_frames, 1, "age of the first view")
      .AtLeast(attempt_interval, 1, "interval between two estimates")
      .AtLeast(unknown_readout_s, 0, "unknown readout time")
      .Contained(two_view.Validate())
      .Contained(confirmation.Validate())
      .fault();
}

Initializer::Initializer(const InitializerOptions& options, std::shared_ptr<const CameraModel> camera,
                         std::uint64_t seed)
    : options_(Checked(options)),
      camera_(std::move(camera)),
      random_(seed),
      confirmation_(options.confirmation),
      views_confirmation_(options.confirmation) {}

void Initializer::SetCamera(std::shared_ptr<const CameraModel> camera) {
  camera_ = std::move(camera);
  Reset();
}

void Initializer::Reset() {
  trails_.clear();
  confirmation_.Reset();
  first_.reset();
  previous_.reset();
  hint_ = Hint::kNone;
  progress_ = 0;
}

void Initializer::UpdateProgress(double progress) {
  constexpr double kKept = 0.95;  // Per attempt: half is gone after 14 attempts, about a second.
  progress_ = std::max(progress, kKept * progress_);
}

void Initializer::AddCorners(const ImageFeatures& features, double density) {
  for (std::size_t level = 0; level < options_.corners.size(); ++level) {
    for (const Corner& corner : SpreadCorners(features, level, options_.corners[level], density)) {
      const Eigen::Vector2f pixel =
          LevelZeroFromLevel(Eigen::Vector2d(corner.x, corner.y), static_cast<int>(level)).cast<float>();
      trails_.push_back({pixel, pixel, static_cast<int>(level), static_cast<std::uint32_t>(trails_.size())});
    }
  }
}

void Initializer::Start(Timestamp time, const std::shared_ptr<const ImageFeatures>& features) {
  trails_.clear();
  confirmation_.Reset();
  AddCorners(*features, 1);
  if (static_cast<int>(trails_.size()) < options_.plain_scene_corners) {
    trails_.clear();
    AddCorners(*features, 2);
  }
  trails_at_start_ = trails_.size();
  age_frames_ = 0;
  first_time_ = previous_time_ = time;
  first_ = previous_ = features;
  const bool enough = static_cast<int>(trails_.size()) >= options_.min_alive;
  hint_ = enough ? Hint::kMoveSideways : Hint::kStartWhereThereIsDetail;
}

void Initializer::TrackCorners(Timestamp time, const ImageFeatures& features) {
  const auto rotation = AlignRotation(previous_->small_blurry, *camera_, features.small_blurry, *camera_);
  const Rotation3 now_from_previous = rotation && rotation->converged ? rotation->b_from_a : Rotation3();
  const Eigen::Vector3d rate = now_from_previous.Log() / std::max(ToSeconds(time - previous_time_), 1e-3);
  last_rates_ = {age_frames_ == 1 ? rate : last_rates_[1], rate};
  if (age_frames_ == 1) first_rates_ = last_rates_;
  if (age_frames_ == 2) first_rates_[1] = rate;
  std::erase_if(trails_, [&](Trail& trail) {
    const auto ray = camera_->Unproject(trail.now.cast<double>());
    if (!ray) return true;
    const auto prediction = camera_->Project(now_from_previous * *ray);
    if (!prediction || !camera_->IsInside(*prediction, 6)) return true;
    const auto now = TrackPatch(*previous_, trail.now, features, prediction->cast<float>(), trail.level);
    if (!now || !camera_->IsInside(now->cast<double>(), 6)) return true;
    const auto back = TrackPatch(features, *now, *previous_, trail.now, trail.level);
    if (!back || (*back - trail.now).norm() > kMaxRoundTripPx * static_cast<float>(1 << trail.level))
      return true;
    trail.step = *now - trail.now;
    if (age_frames_ == 1) trail.first_step = trail.step;
    trail.now = *now;
    return false;
  });
}

std::optional<InitialPair> Initializer::Track(Timestamp time,
                                              const std::shared_ptr<const ImageFeatures>& features) {
  if (!first_) {
    Start(time, features);
    return std::nullopt;
  }
  ++age_frames_;
  TrackCorners(time, *features);
  previous_ = features;
  previous_time_ = time;
  const bool too_few =
      trails_.size() < static_cast<std::size_t>(options_.min_alive) ||
      static_cast<double>(trails_.size()) < options_.min_alive_ratio * static_cast<double>(trails_at_start_);
  if (too_few || age_frames_ > options_.max_age_frames) {
    Start(time, features);
    return std::nullopt;
  }
  if (age_frames_ % options_.attempt_interval != 0) return std::nullopt;
  std::vector<float> motion;
  motion.reserve(trails_.size());
  for (const Trail& trail : trails_) motion.push_back((trail.now - trail.first).norm());
  const auto middle = motion.begin() + static_cast<std::ptrdiff_t>(motion.size() / 2);
  std::nth_element(motion.begin(), middle, motion.end());
  const double min_motion_px = options_.min_motion_px * camera_->width_px() / 640.0;
  if (*middle < min_motion_px) {
    hint_ = HintFor(TwoViewOutcome::kStill);
    UpdateProgress(kMotionShare * *middle / min_motion_px);
    return std::nullopt;
  }
  return Attempt(time, features);
}

// The difference of the image speed between the current and the first view: the median over the keypoints.
double Initializer::SpeedChange() const {
  std::vector<float> changes;
  changes.reserve(trails_.size());
  for (const Trail& trail : trails_) changes.push_back((trail.step - trail.first_step).norm());
  if (changes.empty()) return 0;
  const auto middle = changes.begin() + static_cast<std::ptrdiff_t>(changes.size() / 2);
  std::nth_element(changes.begin(), middle, changes.end());
  return *middle;
}

std::shared_ptr<const CameraModel> Initializer::ImageCamera(const Eigen::Vector3d& newest,
                                                            const Eigen::Vector3d& other) const {
  // Rates are means over intervals between frames, half an interval away: they are extrapolated.
  const Eigen::Vector3d rate = newest + 0.5 * (newest - other);
  return std::make_shared<CameraModel>(CameraModel::WithReadout(camera_, {rate, readout_s_}));
}

std::optional<InitialPair> Initializer::Attempt(Timestamp time,
                                                const std::shared_ptr<const ImageFeatures>& features) {
  std::vector<InitialPair::Match> matches;
  std::vector<std::uint32_t> ids;
  for (const Trail& trail : trails_) {
    matches.push_back({trail.first, trail.now, static_cast<std::uint8_t>(trail.level)});
    ids.push_back(trail.id);
  }
  auto pair = Solve({first_time_, first_, ImageCamera(first_rates_[0], first_rates_[1])},
                    {time, features, ImageCamera(last_rates_[1], last_rates_[0])}, std::move(matches), ids,
                    SpeedChange(), &confirmation_);
  if (pair) Reset();
  return pair;
}

std::optional<InitialPair> Initializer::TryViews(const InitialPair::View& a, const InitialPair::View& b,
                                                 std::vector<InitialPair::Match> matches,
                                                 std::span<const std::uint32_t> ids, double speed_change_px) {
  return Solve(a, b, std::move(matches), ids, speed_change_px, &views_confirmation_);
}

bool Initializer::HasDepthWithAnyReadout(const InitialPair::View& a, const InitialPair::View& b,
                                         std::span<const InitialPair::Match> matches,
                                         const TwoViewOptions& options) const {
  // Estimates of 20 ms were 8 to 28 ms, and what an imperfect calibration of the lens leaves of a turn looks
  // like a readout time too: of 20 starts in a simulated museum with a known readout time, one was false.
  constexpr double kRatioOnceKnown = 0.5;
  const bool known = !readout_s_.isZero(0) || camera_->known_readout_s();
  const double deviation_s = (known ? kRatioOnceKnown : 1) * options_.unknown_readout_s;
  if (deviation_s == 0) return true;
  const ReadoutMotion &motion_a = a.camera->readout_motion(), &motion_b = b.camera->readout_motion();
  const double rate = std::max(motion_a.rotation_rate.norm(), motion_b.rotation_rate.norm());
  // In pixels, of the first and the last row.
  constexpr double kNegligiblePx = 0.5;
  if (0.5 * rate * deviation_s < kNegligiblePx * options.pixel_angle) return true;
  for (const Eigen::Vector2d& direction : {Eigen::Vector2d(0, 1), {0, -1}, {1, 0}, {-1, 0}}) {
    const Eigen::Vector2d readout_s = readout_s_ + deviation_s * direction;
    const CameraModel camera_a = CameraModel::WithReadout(camera_, {motion_a.rotation_rate, readout_s}),
                      camera_b = CameraModel::WithReadout(camera_, {motion_b.rotation_rate, readout_s});
    Rays rays_a, rays_b;
    for (const InitialPair::Match& match : matches) Unproject(match, camera_a, camera_b, &rays_a, &rays_b);
    if (!HasDepth(EstimateTwoViews(rays_a, rays_b, options))) return false;
  }
  return true;
}

std::optional<InitialPair> Initializer::Solve(const InitialPair::View& a, const InitialPair::View& b,
                                              std::vector<InitialPair::Match> matches,
                                              std::span<const std::uint32_t> ids, double speed_change_px,
                                              StartConfirmation* confirmation) {
  std::vector<std::uint32_t> kept;
  InitialPair pair;
  Rays rays_a, rays_b;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (!Unproject(matches[i], *a.camera, *b.camera, &rays_a, &rays_b)) continue;
    kept.push_back(ids[i]);
    pair.matches.push_back(matches[i]);
  }
  TwoViewOptions options = options_.two_view;
  options.pixel_angle = camera_->PixelAngle();
  options.depth_noise.speed_change_px = speed_change_px;
  options.seed = random_.Next();
  pair.geometry = EstimateTwoViews(rays_a, rays_b, options);
  const bool any_readout = options_.confirmation.with_any_readout || !confirmation->Awaits(a.time);
  if (HasDepth(pair.geometry) && any_readout && !HasDepthWithAnyReadout(a, b, pair.matches, options))
    pair.geometry.outcome = TwoViewOutcome::kTooLittleParallax;
  hint_ = HintFor(pair.geometry.outcome);
  UpdateProgress(kMotionShare + kParallaxShare * ParallaxProgress(pair.geometry, options) +
                 (1 - kMotionShare - kParallaxShare) * confirmation->GrowthProgress(pair.geometry));
  awaits_confirmation_ = false;
  if (!HasDepth(pair.geometry)) return std::nullopt;
  if (!confirmation->Confirm(a.time, kept, pair.geometry)) {
    awaits_confirmation_ = true;
    hint_ = HintFor(TwoViewOutcome::kTooLittleParallax);
    return std::nullopt;
  }
  pair.camera = camera_;
  pair.a = a;
  pair.b = b;
  return pair;
}

}  // namespace docent::engine
