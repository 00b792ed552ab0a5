// SPDX-License-Identifier: Apache-2.0
#include "engine/initialization/initializer.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/base/option_check.h"

namespace docent::engine {

namespace {

// Shares of the progress: the image moves enough, and the parallax is significant; the third view is the
// rest.
constexpr double kMotionShare = 0.2, kParallaxShare = 0.6;

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
      .AtLeast(min_motion_px, 0, "motion between two views")
      .AtLeast(attempt_interval, 1, "interval between two estimates")
      .AtLeast(unknown_readout_s, 0, "unknown readout time")
      .Contained(tracks.Validate())
      .Contained(two_view.Validate())
      .Contained(confirmation.Validate())
      .fault();
}

Initializer::Initializer(const InitializerOptions& options, std::shared_ptr<const CameraModel> camera,
                         std::uint64_t seed)
    : options_(Checked(options)),
      camera_(std::move(camera)),
      random_(seed),
      tracks_(options.tracks),
      confirmations_(CornerTracks::kMaxViews, StartConfirmation(options.confirmation)),
      views_confirmation_(options.confirmation) {}

void Initializer::SetCamera(std::shared_ptr<const CameraModel> camera) {
  camera_ = std::move(camera);
  Reset();
}

void Initializer::Reset() {
  tracks_.Reset();
  for (StartConfirmation& confirmation : confirmations_) confirmation.Reset();
  hint_ = Hint::kNone;
  progress_ = 0;
}

void Initializer::UpdateProgress(double progress) {
  constexpr double kKept = 0.95;  // Per attempt: half is gone after 14 attempts, about a second.
  progress_ = std::max(progress, kKept * progress_);
}

std::optional<InitialPair> Initializer::Track(Timestamp time,
                                              const std::shared_ptr<const ImageFeatures>& features) {
  if (tracks_.started()) {
    tracks_.Track(time, features, *camera_, AlignedRotation(*tracks_.newest(), *features, *camera_));
  } else {
    tracks_.Start(time, features);
  }
  if (tracks_.views().front().time == time) {
    const bool enough = tracks_.HasEnough(tracks_.views().front());
    hint_ = enough ? Hint::kMoveSideways : Hint::kStartWhereThereIsDetail;
  }
  Hint of_oldest = hint_;  // One for each first view would confuse a person.
  double progress = -1;
  for (const CornerTracks::FirstView& first : tracks_.views()) {
    if (first.age_frames == 0) confirmations_[first.slot].Reset();
    if (first.age_frames == 0 || first.age_frames % options_.attempt_interval != 0) continue;
    if (auto pair = Attempt(first, time, features)) {
      Reset();
      return pair;
    }
    if (&first == &tracks_.views().front()) of_oldest = hint_;
    progress = std::max(progress, attempt_progress_);
  }
  hint_ = of_oldest;
  if (progress >= 0) UpdateProgress(progress);
  return std::nullopt;
}

std::shared_ptr<const CameraModel> Initializer::ImageCamera(const Eigen::Vector3d& newest,
                                                            const Eigen::Vector3d& other) const {
  // Rates are means over intervals between frames, half an interval away: they are extrapolated.
  const Eigen::Vector3d rate = newest + 0.5 * (newest - other);
  return std::make_shared<CameraModel>(CameraModel::WithReadout(camera_, {rate, readout_s_}));
}

std::optional<InitialPair> Initializer::Attempt(const CornerTracks::FirstView& first, Timestamp time,
                                                const std::shared_ptr<const ImageFeatures>& features) {
  const double motion_px = tracks_.MedianMotionPx(first),
               min_motion_px = options_.min_motion_px * camera_->width_px() / 640.0;
  if (motion_px < min_motion_px) {
    hint_ = HintFor(TwoViewOutcome::kStill);
    attempt_progress_ = kMotionShare * motion_px / min_motion_px;
    return std::nullopt;
  }
  std::vector<InitialPair::Match> matches;
  std::vector<std::uint32_t> ids;
  tracks_.Matches(first, &matches, &ids);
  const std::array<Eigen::Vector3d, 2>& last_rates = tracks_.last_rates();
  return Solve({first.time, first.features, ImageCamera(first.rates[0], first.rates[1])},
               {time, features, ImageCamera(last_rates[1], last_rates[0])}, std::move(matches), ids,
               tracks_.MedianSpeedChangePx(first), &confirmations_[first.slot]);
}

std::optional<InitialPair> Initializer::TryViews(const InitialPair::View& a, const InitialPair::View& b,
                                                 std::vector<InitialPair::Match> matches,
                                                 std::span<const std::uint32_t> ids, double speed_change_px) {
  auto pair = Solve(a, b, std::move(matches), ids, speed_change_px, &views_confirmation_);
  UpdateProgress(attempt_progress_);
  return pair;
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
  attempt_progress_ = kMotionShare + kParallaxShare * ParallaxProgress(pair.geometry, options) +
                      (1 - kMotionShare - kParallaxShare) * confirmation->GrowthProgress(pair.geometry);
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
