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
// Displacement of the first and the last row by a rolling shutter, pixels.
constexpr double kNegligiblePx = 0.5;

// After a pair, the readout time is estimated from so many images and multiples of it.
constexpr int kImagesBetweenSequences = 8;
constexpr int kMostImages = static_cast<int>(CornerTracks::kRememberedImages);

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
      .Contained(track_readout.Validate())
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
  readout_from_corners_.reset();
  ResetAttempts();
  ended_ = following_ = false;
}

void Initializer::ResetAttempts() {
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
  if (ended_) Reset();
  if (tracks_.started() && AreEqual(*tracks_.newest(), *features)) return std::nullopt;
  if (tracks_.started()) {
    TrackCorners(time, features);
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
      ResetAttempts();
      ended_ = true;
      return pair;
    }
    if (&first == &tracks_.views().front()) of_oldest = hint_;
    progress = std::max(progress, attempt_progress_);
  }
  hint_ = of_oldest;
  if (progress >= 0) UpdateProgress(progress);
  return std::nullopt;
}

void Initializer::TrackCorners(Timestamp time, const std::shared_ptr<const ImageFeatures>& features) {
  readout_from_corners_.reset();
  tracks_.Track(time, features, *camera_, AlignedRotation(*tracks_.newest(), *features, *camera_));
}

void Initializer::EndWith(const InitialPair& pair) {
  const bool may_tell = options_.estimate_readout && !camera_->known_readout_s() && readout_s_.isZero(0) &&
                        !pair.readout && tracks_.started() &&
                        tracks_.views().front().age_frames + 1 < kMostImages;
  if (!may_tell) {
    Reset();
    return;
  }
  ended_ = following_ = true;
}

std::optional<TrackedCorners> Initializer::Follow(Timestamp time,
                                                  const std::shared_ptr<const ImageFeatures>& features) {
  if (AreEqual(*tracks_.newest(), *features)) return std::nullopt;
  const Timestamp first = tracks_.views().front().time;
  TrackCorners(time, features);
  const CornerTracks::FirstView& view = tracks_.views().front();
  if (view.time != first) {
    Reset();
    return std::nullopt;
  }
  const int images = view.age_frames + 1;
  if (images < options_.track_readout.min_images || images % kImagesBetweenSequences != 0)
    return std::nullopt;
  TrackedCorners corners{camera_, tracks_.Sequence(view)};
  if (images == kMostImages) Reset();
  return corners;
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
  MatchedViews views;
  tracks_.Matches(first, &views.matches, &views.ids);
  const std::array<Eigen::Vector3d, 2>& last_rates = tracks_.last_rates();
  views.a = {first.time, first.features, ImageCamera(first.rates[0], first.rates[1])};
  views.b = {time, features, ImageCamera(last_rates[1], last_rates[0])};
  views.options = OptionsFor(tracks_.MedianSpeedChangePx(first));
  return Solve(
      std::move(views), [this] { return ReadoutFromCorners(); }, &confirmations_[first.slot]);
}

std::optional<InitialPair> Initializer::TryViews(const InitialPair::View& a, const InitialPair::View& b,
                                                 std::vector<InitialPair::Match> matches,
                                                 std::span<const std::uint32_t> ids, double speed_change_px,
                                                 const ReadoutSource& readout) {
  MatchedViews views = {a, b, std::move(matches), {ids.begin(), ids.end()}, OptionsFor(speed_change_px), {}};
  auto pair = Solve(std::move(views), readout, &views_confirmation_);
  UpdateProgress(attempt_progress_);
  return pair;
}

TwoViewOptions Initializer::OptionsFor(double speed_change_px) {
  TwoViewOptions options = options_.two_view;
  options.pixel_angle = camera_->PixelAngle();
  options.depth_noise.speed_change_px = speed_change_px;
  options.seed = random_.Next();
  return options;
}

TwoViewResult Initializer::EstimateGeometry(MatchedViews* views) {
  Rays rays_a, rays_b;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < views->matches.size(); ++i) {
    if (!Unproject(views->matches[i], *views->a.camera, *views->b.camera, &rays_a, &rays_b)) continue;
    views->matches[kept] = views->matches[i];
    views->ids[kept++] = views->ids[i];
  }
  views->matches.resize(kept);
  views->ids.resize(kept);
  return EstimateTwoViews(rays_a, rays_b, views->options);
}

double Initializer::DisplacementPx(const InitialPair::View& a, const InitialPair::View& b,
                                   double seconds) const {
  const double rate = std::max(a.camera->readout_motion().rotation_rate.norm(),
                               b.camera->readout_motion().rotation_rate.norm());
  return 0.5 * rate * seconds / camera_->PixelAngle();
}

std::optional<TrackReadout> Initializer::ReadoutFromCorners() {
  if (!options_.estimate_readout || camera_->known_readout_s() || !tracks_.started()) return std::nullopt;
  if (!readout_from_corners_)
    readout_from_corners_ =
        EstimateTrackReadout(options_.track_readout, *camera_, tracks_.Sequence(tracks_.views().front()));
  return *readout_from_corners_;
}

bool Initializer::UseReadout(const TrackReadout& readout, MatchedViews* views) {
  views->readout = SignificantReadout(options_.track_readout, readout);
  if (!views->readout) return false;
  readout_s_ = readout.readout_s;
  for (InitialPair::View* view : {&views->a, &views->b}) {
    const auto image = std::ranges::find(readout.times, view->time);
    const Eigen::Vector3d rate =
        image != readout.times.end()
            ? readout.rotation_rates[static_cast<std::size_t>(image - readout.times.begin())]
            : view->camera->readout_motion().rotation_rate;
    view->camera = std::make_shared<CameraModel>(CameraModel::WithReadout(camera_, {rate, readout_s_}));
  }
  return true;
}

bool Initializer::HasDepthWithAnyReadout(const MatchedViews& views) const {
  // Estimates of 20 ms were 8 to 28 ms, and what an imperfect calibration of the lens leaves of a turn looks
  // like a readout time too: of 20 starts in a simulated museum with a known readout time, one was false.
  constexpr double kRatioOnceKnown = 0.5;
  const bool known = !readout_s_.isZero(0) || camera_->known_readout_s();
  const double deviation_s = (known ? kRatioOnceKnown : 1) * options_.unknown_readout_s;
  if (deviation_s == 0 || DisplacementPx(views.a, views.b, deviation_s) < kNegligiblePx) return true;
  for (const Eigen::Vector2d& direction : {Eigen::Vector2d(0, 1), {0, -1}, {1, 0}, {-1, 0}}) {
    const auto camera = [&](const InitialPair::View& view) {
      const Eigen::Vector3d& rate = view.camera->readout_motion().rotation_rate;
      return CameraModel::WithReadout(camera_, {rate, readout_s_ + deviation_s * direction});
    };
    const CameraModel camera_a = camera(views.a), camera_b = camera(views.b);
    Rays rays_a, rays_b;
    for (const InitialPair::Match& match : views.matches)
      Unproject(match, camera_a, camera_b, &rays_a, &rays_b);
    if (!HasDepth(EstimateTwoViews(rays_a, rays_b, views.options))) return false;
  }
  return true;
}

std::optional<InitialPair> Initializer::Solve(MatchedViews views, const ReadoutSource& readout_source,
                                              StartConfirmation* confirmation) {
  TwoViewResult geometry = EstimateGeometry(&views);
  if (HasDepth(geometry)) {
    const auto readout = readout_source();
    if (readout && UseReadout(*readout, &views)) geometry = EstimateGeometry(&views);
  }
  const bool any_readout = options_.confirmation.with_any_readout || !confirmation->Awaits(views.a.time);
  if (HasDepth(geometry) && any_readout && !HasDepthWithAnyReadout(views))
    geometry.outcome = TwoViewOutcome::kTooLittleParallax;
  hint_ = HintFor(geometry.outcome);
  attempt_progress_ = kMotionShare + kParallaxShare * ParallaxProgress(geometry, views.options) +
                      (1 - kMotionShare - kParallaxShare) * confirmation->GrowthProgress(geometry);
  awaits_confirmation_ = false;
  if (!HasDepth(geometry)) return std::nullopt;
  if (!confirmation->Confirm(views.a.time, views.ids, geometry)) {
    awaits_confirmation_ = true;
    hint_ = HintFor(TwoViewOutcome::kTooLittleParallax);
    return std::nullopt;
  }
  InitialPair pair;
  pair.camera = camera_;
  pair.a = std::move(views.a);
  pair.b = std::move(views.b);
  pair.matches = std::move(views.matches);
  pair.geometry = std::move(geometry);
  pair.readout = views.readout;
  return pair;
}

}  // namespace docent::engine
