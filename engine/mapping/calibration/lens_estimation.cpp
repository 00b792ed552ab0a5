// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/calibration/lens_estimation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "engine/base/median.h"
#include "engine/base/option_check.h"
#include "engine/mapping/panorama/panorama_registration.h"

namespace docent::engine {

namespace {

// The finite points of a map and the keyframes that see them as a bundle problem, and the ids of its indices.
struct LensAssembly {
  BundleProblem problem;
  std::vector<char> unknown;
  std::vector<KeyFrameId> cameras;
  std::vector<MapPointId> points;
};

template <typename HasLens>
LensAssembly Assemble(const Map& map, const std::shared_ptr<const CameraModel>& lens,
                      const HasLens& has_lens) {
  LensAssembly assembly;
  std::map<MapPointId, int> point_at;
  for (const Map::PointRecord& record : map.points()) {
    if (!record.alive || record.point.infinite()) continue;
    point_at[record.point.id] = static_cast<int>(assembly.points.size());
    assembly.points.push_back(record.point.id);
    assembly.problem.points.push_back({record.point.position(), false});
  }
  for (const auto& [id, record] : map.keyframes()) {
    const KeyFrame& keyframe = record.keyframe;
    if (keyframe.kind != KeyFrameKind::kSixDof) continue;
    const bool unknown = has_lens(keyframe.camera.get());
    const int camera = static_cast<int>(assembly.cameras.size());
    assembly.cameras.push_back(id);
    assembly.unknown.push_back(unknown);
    assembly.problem.cameras.push_back(
        {unknown ? CameraModel::WithMotionOf(*keyframe.camera, lens) : keyframe.camera,
         keyframe.camera_from_map, keyframe.fixed});
    for (const Observation& observation : record.observations) {
      const auto point = point_at.find(observation.point);
      if (point == point_at.end()) continue;
      assembly.problem.measurements.push_back(
          {camera, point->second, observation.pixel, static_cast<float>(1 << observation.level), false});
    }
  }
  return assembly;
}

// The correction between two states of a keyframe: it maps the pose exactly, and points by their change of
// depth.
Sim3 CorrectionBetween(const Rigid3& before, const Rigid3& after, double scale) {
  Sim3 moved;
  moved.scale = scale;
  moved.rotation = after.rotation.inverse() * before.rotation;
  moved.translation =
      after.rotation.inverse() * Eigen::Vector3d(scale * before.translation - after.translation);
  return moved;
}

// Writes an adjusted problem to the map. All keyframes of the lens get `model`; those of a joined map may
// have had different ones.
template <typename HasLens>
void ApplyToMap(const LensAssembly& assembly, const std::shared_ptr<const CameraModel>& model,
                const HasLens& has_lens, Map* map) {
  const PanoramaRegistration registration(*map);
  std::map<KeyFrameId, Rigid3> before;
  std::map<KeyFrameId, std::vector<double>> ratios;
  for (const auto& [id, record] : map->keyframes()) before[id] = record.keyframe.camera_from_map;
  for (const BundleProblem::Measurement& measurement : assembly.problem.measurements) {
    const auto c = static_cast<std::size_t>(measurement.camera),
               p = static_cast<std::size_t>(measurement.point);
    const KeyFrameId id = assembly.cameras[c];
    const double old_depth = (before[id] * map->FindPoint(assembly.points[p])->point.position()).z();
    const double depth =
        (assembly.problem.cameras[c].camera_from_map * assembly.problem.points[p].position).z();
    if (old_depth > 0 && depth > 0) ratios[id].push_back(depth / old_depth);
  }
  std::map<KeyFrameId, Sim3> moved;
  const auto add_dependent = [&](const KeyFrame& keyframe, KeyFrameId reference) {
    const auto leader = moved.find(reference);
    const double scale = leader != moved.end() ? leader->second.scale : 1;
    moved[keyframe.id] = CorrectionBetween(before[keyframe.id], keyframe.camera_from_map, scale);
  };
  for (std::size_t i = 0; i < assembly.cameras.size(); ++i) {
    const KeyFrameId id = assembly.cameras[i];
    KeyFrame& keyframe = map->FindKeyFrame(id)->keyframe;
    keyframe.camera_from_map = assembly.problem.cameras[i].camera_from_map;
    moved[id] = CorrectionBetween(before[id], keyframe.camera_from_map, Median(std::move(ratios[id]), 1));
  }
  for (std::size_t i = 0; i < assembly.points.size(); ++i) {
    map->FindPoint(assembly.points[i])->point.point_in_map.head<3>() = assembly.problem.points[i].position;
  }
  registration.Follow(map);
  for (auto& [id, record] : map->keyframes()) {
    KeyFrame& keyframe = record.keyframe;
    if (!has_lens(keyframe.camera.get())) continue;
    const double focal_ratio = model->intrinsics().fx / keyframe.camera->intrinsics().fx;
    keyframe.camera = CameraModel::WithMotionOf(*keyframe.camera, model);
    if (keyframe.kind != KeyFrameKind::kPanorama) continue;
    // The observed displacement in pixels corresponds to a smaller angle if the focal length is longer.
    for (const PanoramaMap& panorama : map->panoramas()) {
      if (panorama.id != keyframe.panorama) continue;
      const Rigid3& reference = map->FindKeyFrame(panorama.reference)->keyframe.camera_from_map;
      const Eigen::Vector3d center = keyframe.camera_from_map.OriginInSource();
      Eigen::Vector3d rotation_vector =
          (keyframe.camera_from_map.rotation * reference.rotation.inverse()).Log();
      rotation_vector.head<2>() /= focal_ratio;
      const Rotation3 rotation = Rotation3::Exp(rotation_vector) * reference.rotation;
      keyframe.camera_from_map = Rigid3(rotation, -(rotation * center));
      add_dependent(keyframe, panorama.reference);
    }
  }
  // Dependent keyframes of a known lens followed their reference.
  for (const auto& [id, record] : map->keyframes()) {
    if (moved.contains(id)) continue;
    const auto panorama =
        std::find_if(map->panoramas().begin(), map->panoramas().end(),
                     [&](const PanoramaMap& candidate) { return candidate.id == record.keyframe.panorama; });
    add_dependent(record.keyframe, panorama != map->panoramas().end() ? panorama->reference : kNoId);
  }
  for (Map::PointRecord& record : map->points()) {
    if (!record.alive) continue;
    if (record.point.infinite()) {
      map->UpdateDirection(&record);
    } else {
      map->UpdateNormal(&record);
    }
  }
  for (auto& [id, record] : map->keyframes()) map->UpdateDepth(&record);
  map->AddCorrection(std::move(moved));
}

// The displacement of the image corner, in pixels, that the difference in distortion causes. A change of the
// focal length is tested separately.
double DistortionChange(const CameraModel& a, const CameraModel& b) {
  const auto& in = a.intrinsics();
  const double corner = std::hypot(in.cx, in.cy) / in.fx;
  const double k1 = a.distortion()[0] - b.distortion()[0], k2 = a.distortion()[1] - b.distortion()[1];
  return std::abs(k1 + k2 * corner * corner) * corner * corner * corner * in.fx;
}

// The standard deviation of an estimate, relative to the focal length. Matches were selected with the
// previous lens and bias the estimate towards it, so that estimates approach the true value in several steps,
// and the last step indicates the remaining error. On a drone's flight whose estimates fell from 478 to 464
// px (true: 458 px), the remaining error was 1.3 to 4 times the last step, 2.7 times on average. After the
// first step, 29 % from the initial guess, the remaining error was a quarter of that step. The spread of the
// estimates since the map had half as many keyframes is included too; if no estimate is as old as that, it is
// at least kSigmaWithoutHistory. The errors of such estimates in seven simulated and recorded sequences were
// 0.2 to 9 %, with a median of 3 %.
double TotalSigma(double own_sigma, double model_sigma, double step, bool first, double spread,
                  bool no_history) {
  constexpr double kRemainingSteps = 3, kRemainingOfFirstStep = 0.25, kSigmaWithoutHistory = 0.03;
  const double remaining = (first ? kRemainingOfFirstStep : kRemainingSteps) * step;
  return std::hypot(std::hypot(own_sigma, model_sigma),
                    std::hypot(remaining, std::max(spread, no_history ? kSigmaWithoutHistory : 0)));
}

}  // namespace

std::optional<std::string> LensEstimationOptions::Validate() const {
  return OptionCheck()
      .That(std::ranges::all_of(lenses, [](const EstimatedLens& lens) { return lens.model != nullptr; }),
            "Each unknown lens needs an initial model.")
      .AtLeast(min_keyframes, 2, "number of keyframes of the first estimate of a lens")
      .That(growth > 1 && std::isfinite(growth),
            "The growth between two estimates of a lens must be above 1.")
      .That(std::ranges::all_of(fields_of_view_deg,
                                [](double degrees) { return degrees > 0 && degrees < 180; }),
            "Each field of view must be between 0 and 180 degrees.")
      .Positive(coarse_sigma, "sigma of a coarse focal length")
      .Positive(max_sigma, "sigma of a usable focal length")
      .AtLeast(min_change_sigmas, 0, "change of a lens in sigmas")
      .AtLeast(min_change, 0, "change of a focal length")
      .AtLeast(min_change_px, 0, "change of a lens at the image corner")
      .AtLeast(max_rounds, 0, "number of rounds of an estimate")
      .Positive(fixed_sigma, "sigma of a fixed focal length")
      .Contained(search.Validate())
      .Positive(contradiction_change, "change of a contradicted focal length")
      .AtLeast(contradiction_sigmas, 0, "change of a contradicted focal length in sigmas")
      .Positive(contradiction_residual, "residual ratio of a contradicted calibration")
      .Contained(calibration.Validate())
      .AtLeast(model_sigma, 0, "sigma of the lens model")
      .fault();
}

LensEstimation::LensEstimation(const LensEstimationOptions& options)
    : options_(Checked(options)), lenses_(options.lenses), plans_(options.lenses.size()) {
  for (const EstimatedLens& lens : lenses_) versions_.push_back({lens.model});
}

void LensEstimation::Reset() {
  plans_.assign(lenses_.size(), Plan());
  for (GivenCalibration& checked : given_) checked.next_at = options_.min_checked_keyframes;
  to_match_.clear();
}

bool LensEstimation::IsVersionOf(std::size_t lens, const CameraModel* model) const {
  model = &model->WithoutMotion();
  return std::any_of(versions_[lens].begin(), versions_[lens].end(),
                     [model](const auto& version) { return version.get() == model; });
}

std::shared_ptr<const CameraModel> LensEstimation::CurrentModel(
    const std::shared_ptr<const CameraModel>& model) const {
  for (std::size_t lens = 0; lens < lenses_.size(); ++lens) {
    if (IsVersionOf(lens, model.get())) return CameraModel::WithMotionOf(*model, lenses_[lens].model);
  }
  return model;
}

bool LensEstimation::IsOutdated(std::size_t lens, const Map& map) const {
  return std::any_of(map.keyframes().begin(), map.keyframes().end(), [&](const auto& entry) {
    const CameraModel* model = entry.second.keyframe.camera.get();
    return !model->HasSameLens(*lenses_[lens].model) && IsVersionOf(lens, model);
  });
}

std::size_t LensEstimation::KeyFramesOf(std::size_t lens, const Map& map) const {
  return static_cast<std::size_t>(
      std::count_if(map.keyframes().begin(), map.keyframes().end(), [&](const auto& entry) {
        const KeyFrame& keyframe = entry.second.keyframe;
        return keyframe.kind == KeyFrameKind::kSixDof && IsVersionOf(lens, keyframe.camera.get());
      }));
}

LensEstimation::Progress LensEstimation::Step(PointSearcher* searcher, const std::atomic<bool>* interrupt,
                                              Map* map) {
  if (lenses_.empty()) return Progress::kNothing;
  if (!to_match_.empty()) {
    const KeyFrameId id = to_match_.front();
    to_match_.pop_front();
    if (map->FindKeyFrame(id)) MatchMapPoints(options_.search, id, searcher, map);
    return Progress::kStepDone;
  }
  for (std::size_t lens = 0; lens < lenses_.size(); ++lens) {
    if (IsOutdated(lens, *map)) return UpdateMap(lens, interrupt, map);
    if (lenses_[lens].fixed) continue;
    const std::size_t keyframes = KeyFramesOf(lens, *map);
    if (keyframes < options_.min_keyframes || keyframes < plans_[lens].next_at) continue;
    return EstimateLens(lens, interrupt, map);
  }
  return Progress::kNothing;
}

// Adapts a map whose keyframes have an earlier model of the lens, because the lens was estimated in another
// map.
LensEstimation::Progress LensEstimation::UpdateMap(std::size_t lens, const std::atomic<bool>* interrupt,
                                                   Map* map) {
  const auto has_lens = [&](const CameraModel* model) { return IsVersionOf(lens, model); };
  LensAssembly assembly = Assemble(*map, lenses_[lens].model, has_lens);
  SelfCalibrationOptions calibration = options_.calibration;
  calibration.refine_lens = false;
  calibration.interrupt = interrupt;
  const SelfCalibration result = CalibrateBundle(calibration, assembly.unknown, &assembly.problem);
  if (result.outcome == SelfCalibration::Outcome::kInterrupted) return Progress::kStepDone;
  ApplyToMap(assembly, lenses_[lens].model, has_lens, map);
  last_ = lens;
  return Progress::kMapChanged;
}

LensEstimation::Progress LensEstimation::EstimateLens(std::size_t lens, const std::atomic<bool>* interrupt,
                                                      Map* map) {
  const auto has_lens = [&](const CameraModel* model) { return IsVersionOf(lens, model); };
  EstimatedLens& known = lenses_[lens];
  Plan& plan = plans_[lens];
  LensAssembly assembly = Assemble(*map, known.model, has_lens);
  SelfCalibrationOptions calibration = options_.calibration;
  if (known.focal_sigma > options_.coarse_sigma) calibration.fields_of_view_deg = options_.fields_of_view_deg;
  calibration.interrupt = interrupt;
  SelfCalibration result = CalibrateBundle(calibration, assembly.unknown, &assembly.problem);
  if (result.outcome == SelfCalibration::Outcome::kInterrupted) return Progress::kStepDone;
  const double own_sigma = result.focal_sigma;
  last_ = lens;
  const std::size_t keyframes = KeyFramesOf(lens, *map);
  const auto next_at =
      std::max(keyframes + 1, static_cast<std::size_t>(options_.growth * static_cast<double>(keyframes)));
  const auto finish = [&](Progress progress) {
    plan.next_at = next_at;
    plan.round = 0;
    return progress;
  };
  if (result.outcome != SelfCalibration::Outcome::kDone || !(own_sigma <= options_.max_sigma))
    return finish(Progress::kNothing);
  const double before = known.model->intrinsics().fx;
  const double change = std::abs(std::log(result.focal_px / before));
  const bool first = plan.estimates.empty();
  const double step = first ? change : std::abs(std::log(result.focal_px) - plan.estimates.back().log_focal);
  double spread = 0;
  bool no_history = true;
  for (auto estimate = plan.estimates.rbegin(); estimate != plan.estimates.rend() && no_history; ++estimate) {
    spread = std::max(spread, std::abs(std::log(result.focal_px) - estimate->log_focal));
    no_history = 2 * estimate->keyframes > keyframes;
  }
  result.focal_sigma = TotalSigma(own_sigma, options_.model_sigma, step, first, spread, no_history);
  // An estimate does not replace a more precise one that agrees with it, whether that is from another map or
  // from this one. A large step makes an estimate imprecise until another one confirms it.
  constexpr double kMaxDisagreement = 2;
  const double sigma_now = TotalSigma(own_sigma, options_.model_sigma, step, first, 0, no_history);
  if (sigma_now > 1.5 * known.focal_sigma &&
      change < kMaxDisagreement * std::hypot(result.focal_sigma, known.focal_sigma)) {
    if (!first) plan.estimates.push_back({keyframes, std::log(result.focal_px)});
    return finish(Progress::kNothing);
  }
  const CameraModel& found = result.lens;
  const bool changes = (change > options_.min_change_sigmas * own_sigma && change > options_.min_change) ||
                       DistortionChange(found, *known.model) > options_.min_change_px;
  plan.estimates.push_back({keyframes, std::log(result.focal_px)});
  const bool fix = result.focal_sigma <= options_.fixed_sigma && HasConverged(plan, keyframes);
  const bool more_precise = fix || changes || result.focal_sigma < 0.7 * known.focal_sigma;
  known.focal_sigma = result.focal_sigma;
  known.fixed = fix;
  if (!changes && !fix) return finish(more_precise ? Progress::kLensUpdated : Progress::kNothing);
  known.model = std::make_shared<const CameraModel>(found);
  versions_[lens].push_back(known.model);
  ApplyToMap(assembly, known.model, has_lens, map);
  if (fix || ++plan.round >= options_.max_rounds) return finish(Progress::kMapChanged);
  for (const auto& [id, record] : map->keyframes()) to_match_.push_back(id);
  return Progress::kMapChanged;
}

std::optional<CalibrationContradiction> LensEstimation::Check(const std::atomic<bool>* interrupt,
                                                              const Map& map) {
  std::vector<std::size_t> counts(given_.size(), 0);  // keyframes of each of given_
  for (const auto& [id, record] : map.keyframes()) {
    const auto& image = record.keyframe.camera;
    const auto& model = image->lens_of_image() ? image->lens_of_image() : image;
    if (record.keyframe.kind != KeyFrameKind::kSixDof) continue;
    bool estimated = false;
    for (std::size_t lens = 0; lens < lenses_.size(); ++lens) estimated |= IsVersionOf(lens, model.get());
    if (estimated) continue;
    // A map that is loaded has models of its own.
    const auto known = std::find_if(given_.begin(), given_.end(), [&](const GivenCalibration& checked) {
      return checked.model->HasSameLens(*model);
    });
    if (known == given_.end()) {
      given_.push_back({.model = model, .next_at = options_.min_checked_keyframes});
      counts.push_back(1);
    } else {
      ++counts[static_cast<std::size_t>(known - given_.begin())];
    }
  }
  for (std::size_t i = 0; i < given_.size(); ++i) {
    GivenCalibration& checked = given_[i];
    const std::size_t keyframes = counts[i];
    // A large error is found in a small map already, and the cost of a check grows with the map.
    constexpr std::size_t kMaxCheckedKeyFrames = 24;
    if (checked.done || keyframes < checked.next_at || keyframes > kMaxCheckedKeyFrames) continue;
    const auto& in = checked.model->intrinsics();
    const bool radial = checked.model->lens() == LensModel::kRadialTangential;
    const auto& k = checked.model->distortion();
    const double focal = 0.5 * (in.fx + in.fy);
    // Only lenses of this model can be estimated, so other models are approximated by it.
    const auto start = std::make_shared<const CameraModel>(
        LensModel::kRadialTangential,
        CameraModel::Intrinsics{in.width_px, in.height_px, focal, focal, in.cx, in.cy},
        radial ? std::array<double, 5>{k[0], k[1], 0, 0, 0} : std::array<double, 5>{});
    const auto has_lens = [&](const CameraModel* model) { return model->HasSameLens(*checked.model); };
    LensAssembly given = Assemble(map, start, has_lens);
    LensAssembly open = given;
    SelfCalibrationOptions calibration = options_.calibration;
    calibration.fields_of_view_deg = options_.fields_of_view_deg;
    calibration.interrupt = interrupt;
    const SelfCalibration estimate = CalibrateBundle(calibration, open.unknown, &open.problem);
    if (estimate.outcome == SelfCalibration::Outcome::kInterrupted) return std::nullopt;
    checked.next_at =
        std::max(keyframes + 1, static_cast<std::size_t>(options_.growth * static_cast<double>(keyframes)));
    if (estimate.outcome != SelfCalibration::Outcome::kDone) continue;
    const double change = std::abs(std::log(estimate.focal_px / focal));
    const double sigma = std::hypot(estimate.focal_sigma, options_.model_sigma);
    // One precise estimate that agrees is enough; the check costs as much as several adjustments.
    checked.done = sigma <= options_.max_sigma && change < options_.contradiction_change;
    if (sigma > options_.max_sigma || change < options_.contradiction_change ||
        change < options_.contradiction_sigmas * sigma)
      continue;
    calibration.refine_lens = false;
    const SelfCalibration kept = CalibrateBundle(calibration, given.unknown, &given.problem);
    if (kept.outcome == SelfCalibration::Outcome::kInterrupted) continue;
    if (kept.outcome == SelfCalibration::Outcome::kDone &&
        estimate.sigma > options_.contradiction_residual * kept.sigma)
      continue;
    checked.done = true;
    return CalibrationContradiction{focal, estimate.focal_px};
  }
  return std::nullopt;
}

// Whether all estimates since the map had half as many keyframes agree.
bool LensEstimation::HasConverged(const Plan& plan, std::size_t keyframes) const {
  if (keyframes < options_.min_fixed_keyframes) return false;
  bool from_half = false;
  const double now = plan.estimates.back().log_focal;
  for (auto estimate = plan.estimates.rbegin(); estimate != plan.estimates.rend(); ++estimate) {
    if (std::abs(estimate->log_focal - now) > options_.fixed_sigma) return false;
    if (2 * estimate->keyframes <= keyframes) {
      from_half = true;
      break;
    }
  }
  return from_half;
}

}  // namespace docent::engine
