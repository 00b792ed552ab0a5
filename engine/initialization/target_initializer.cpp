// SPDX-License-Identifier: Apache-2.0
#include "engine/initialization/target_initializer.h"

#include <algorithm>
#include <limits>
#include <numbers>
#include <utility>

#include "engine/base/median.h"
#include "engine/base/option_check.h"
#include "engine/geometry/triangulation.h"

namespace docent::engine {

namespace {

constexpr double kDegrees = 180 / std::numbers::pi;

CornerTracksOptions TracksBesideTheTarget() {
  CornerTracksOptions options;
  options.max_age_frames = std::numeric_limits<int>::max();
  options.min_alive = 0;  // the points of the target alone suffice
  options.max_views = 1;
  return options;
}

// Adds one match with its point in frame a, in units of the baseline.
void Append(const InitialPair::Match& match, const Eigen::Vector3d& point_in_a, double baseline_m,
            InitialPair* pair) {
  pair->matches.push_back(match);
  pair->geometry.points_in_a.push_back(point_in_a / baseline_m);
  pair->geometry.inlier.push_back(true);
  ++pair->geometry.inlier_count;
}

// Adds the points of the target that both views detect; returns their parallax in degrees.
std::vector<double> AppendTargetPoints(const TargetView& a, const TargetView& b, const Rigid3& b_from_a,
                                       InitialPair* pair) {
  std::vector<double> parallax_deg;
  const double baseline_m = b_from_a.translation.norm();
  auto other = b.detection.points.begin();
  for (const TargetDetection::Point& point : a.detection.points) {
    while (other != b.detection.points.end() && other->id < point.id) ++other;
    if (other == b.detection.points.end()) break;
    if (other->id != point.id) continue;
    const Eigen::Vector3d in_a = a.detection.camera_from_target * point.point_in_target;
    Append({point.pixel.cast<float>(), other->pixel.cast<float>(), 0}, in_a, baseline_m, pair);
    parallax_deg.push_back(ParallaxAngle(Eigen::Vector3d::Zero(), b_from_a.OriginInSource(), in_a) *
                           kDegrees);
  }
  return parallax_deg;
}

// True if the point projects near the pixel.
bool Agrees(const CameraModel& camera, const Eigen::Vector3d& point_in_camera, const Eigen::Vector2f& pixel,
            double max_residual_px) {
  const auto projected = camera.Project(point_in_camera);
  return projected && (projected->cast<float>() - pixel).norm() < max_residual_px;
}

void AppendTrackedCorners(const CameraModel& camera, const std::vector<InitialPair::Match>& tracked,
                          const Rigid3& b_from_a, const TargetStartOptions& options, InitialPair* pair) {
  constexpr float kSamePlace_px = 4;
  const std::size_t on_target = pair->matches.size();
  for (const InitialPair::Match& match : tracked) {
    const bool known = std::any_of(
        pair->matches.begin(), pair->matches.begin() + static_cast<std::ptrdiff_t>(on_target),
        [&](const auto& other) { return (other.pixel_a - match.pixel_a).norm() < kSamePlace_px; });
    if (known) continue;
    const auto ray_a = camera.Unproject(match.pixel_a.cast<double>());
    const auto ray_b = camera.Unproject(match.pixel_b.cast<double>());
    if (!ray_a || !ray_b) continue;
    const auto point = Triangulate(*ray_a, *ray_b, b_from_a);
    if (!point || ParallaxAngle(Eigen::Vector3d::Zero(), b_from_a.OriginInSource(), *point) * kDegrees <
                      options.min_point_parallax_deg) {
      continue;
    }
    const double limit_px = options.max_residual_px * (1 << match.level);
    if (Agrees(camera, *point, match.pixel_a, limit_px) &&
        Agrees(camera, b_from_a * *point, match.pixel_b, limit_px)) {
      Append(match, *point, b_from_a.translation.norm(), pair);
    }
  }
}

}  // namespace

std::optional<std::string> TargetStartOptions::Validate() const {
  return OptionCheck()
      .Positive(min_parallax_deg, "parallax of a planar target")
      .AtLeast(min_matches, 1, "number of matches of a planar target")
      .Positive(max_residual_px, "residual of a planar target")
      .Positive(min_point_parallax_deg, "parallax of a point beside a planar target")
      .fault();
}

std::optional<TargetStart> MakeTargetStart(const std::shared_ptr<const CameraModel>& camera,
                                           const TargetView& a, const TargetView& b,
                                           const std::vector<InitialPair::Match>& tracked,
                                           const TargetStartOptions& options, Hint* hint) {
  TargetStart start;
  start.a_from_target = a.detection.camera_from_target;
  const Rigid3 b_from_a = b.detection.camera_from_target * a.detection.camera_from_target.inverse();
  start.pair.baseline_m = b_from_a.translation.norm();
  // Without motion there is no baseline to serve as unit.
  if (!(start.pair.baseline_m > 1e-9)) {
    *hint = HintFor(TwoViewOutcome::kStill);
    return std::nullopt;
  }
  InitialPair& pair = start.pair;
  pair.camera = camera;
  pair.a = a.view;
  pair.b = b.view;
  const std::vector<double> parallax_deg = AppendTargetPoints(a, b, b_from_a, &pair);
  pair.geometry.median_parallax_deg = Median(parallax_deg);
  if (pair.geometry.median_parallax_deg < options.min_parallax_deg) {
    *hint = HintFor(TwoViewOutcome::kTooLittleParallax);
    return std::nullopt;
  }
  AppendTrackedCorners(*camera, tracked, b_from_a, options, &pair);
  if (pair.geometry.inlier_count < options.min_matches) {
    *hint = HintFor(TwoViewOutcome::kTooFewMatches);
    return std::nullopt;
  }
  // Points beside the target have depth; otherwise the structure is the target's plane alone.
  pair.geometry.outcome =
      pair.matches.size() > parallax_deg.size() ? TwoViewOutcome::kGeneral : TwoViewOutcome::kPlanar;
  pair.geometry.b_from_a = b_from_a;
  pair.geometry.b_from_a.translation /= start.pair.baseline_m;
  *hint = Hint::kNone;
  return start;
}

TargetInitializer::TargetInitializer(std::shared_ptr<const PlanarTarget> target,
                                     const TargetStartOptions& options,
                                     std::shared_ptr<const CameraModel> camera, std::uint64_t seed)
    : target_(std::move(target)),
      options_(Checked(options)),
      camera_(std::move(camera)),
      random_(seed),
      corner_tracks_(TracksBesideTheTarget()) {
  Reset();
}

void TargetInitializer::Reset() {
  corner_tracks_.Reset();
  first_.reset();
  detection_.reset();
  previous_.reset();
  hint_ = Hint::kFindTarget;
}

std::optional<TargetDetection> TargetInitializer::DetectOrAlign(const ImageFeatures& features) {
  if (detection_ && previous_) {
    // The motion of a hand-held camera between two frames is mostly a rotation.
    const Rotation3 now_from_previous = AlignedRotation(*previous_, features, *camera_);
    if (auto tracked = target_->Align(
            features, *camera_,
            Rigid3(now_from_previous, Eigen::Vector3d::Zero()) * detection_->camera_from_target)) {
      return tracked;
    }
    if (auto tracked = target_->Align(features, *camera_, detection_->camera_from_target)) return tracked;
  }
  return target_->Detect(features, *camera_, random_.Next());
}

std::optional<TargetStart> TargetInitializer::Track(Timestamp time,
                                                    const std::shared_ptr<const ImageFeatures>& features) {
  detection_ = DetectOrAlign(*features);
  previous_ = features;
  if (first_) {
    corner_tracks_.Track(time, features, *camera_,
                         AlignedRotation(*corner_tracks_.newest(), *features, *camera_));
    if (corner_tracks_.views().front().time != first_->view.time) first_.reset();
  }
  if (!detection_) {
    hint_ = Hint::kFindTarget;
    return std::nullopt;
  }
  const TargetView now{{time, features}, *detection_};
  if (!first_) {
    corner_tracks_.Start(time, features);
    first_ = now;
    hint_ = HintFor(TwoViewOutcome::kStill);
    return std::nullopt;
  }
  std::vector<InitialPair::Match> tracked;
  std::vector<std::uint32_t> ids;
  corner_tracks_.Matches(corner_tracks_.views().front(), &tracked, &ids);
  auto start = MakeTargetStart(camera_, *first_, now, tracked, options_, &hint_);
  if (start) Reset();
  return start;
}

}  // namespace docent::engine
