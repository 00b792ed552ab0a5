// SPDX-License-Identifier: Apache-2.0
#include "engine/initialization/two_view_geometry.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <optional>

#include "engine/base/median.h"
#include "engine/base/option_check.h"
#include "engine/geometry/triangulation.h"
#include "engine/initialization/five_point.h"
#include "engine/initialization/homography.h"
#include "engine/initialization/two_view_consensus.h"
#include "engine/initialization/two_view_models.h"
#include "engine/initialization/two_view_selection.h"

namespace docent::engine {
namespace {

constexpr double kDegreesPerRadian = 57.295779513082321;
// A pair has two constraints instead of one: factor to the radius that contains the same share of a normal
// distribution.
constexpr double kTwoDimensional = 1.25;
// A point whose rays differ by less than this many inlier thresholds has no reliable depth.
constexpr double kMinParallaxThresholds = 2.0;
// Keypoints are never localized more precisely than this.
constexpr double kMinScatterPx = 0.1;

bool IsUnitRay(const Eigen::Vector3d& ray) {
  return std::abs(ray.squaredNorm() - 1) < 1e-6;
}

// One estimation: the pairs, the three models, and the checks that decide the outcome.
class TwoViewEstimator {
 public:
  TwoViewEstimator(const RayPairs& pairs, const TwoViewOptions& options) : pairs_(pairs), options_(options) {
    consensus_options_ = {.inlier_px = options.inlier_px,
                          .max_iterations = options.max_iterations,
                          .confidence = options.confidence,
                          .seed = options.seed};
    wide_options_ = consensus_options_;
    wide_options_.inlier_px *= kTwoDimensional;
  }

  // Decides the outcome and computes the pose, if there is one.
  TwoViewOutcome Decide() {
    if (MedianDisplacementPx() <= options_.inlier_px) return TwoViewOutcome::kStill;
    essential_ = FindEssential(pairs_, consensus_options_);
    // A rotation or homography with less than half the inliers of the most flexible model is irrelevant.
    wide_options_.min_inliers = std::max(essential_.inliers, MinInliersByRatio()) / 2;
    rotation_ = FindRotation(pairs_, wide_options_);
    homography_ = FindHomography(pairs_, wide_options_);
    OfferSimplerModels();
    if (!essential_.found) return TwoViewOutcome::kInconsistent;
    const int most = std::max({rotation_.inliers, homography_.inliers, essential_.inliers});
    if (most < MinInliersByRatio()) return TwoViewOutcome::kInconsistent;
    if (most < options_.min_inliers) return TwoViewOutcome::kTooFewMatches;

    scatter_px_ = EstimateScatter(pairs_, essential_, options_.inlier_px);
    // Keypoints are hardly ever more precise than a quarter pixel, and residuals beyond the threshold were
    // not counted.
    noise_px_ = std::clamp(scatter_px_, 0.25, options_.inlier_px);
    model_ = SelectModel(rotation_, homography_, essential_, options_.inlier_px, noise_px_);
    if (model_ == ModelKind::kRotation) return ClassifyRotation();
    if (!RotationLeavesParallax()) return TwoViewOutcome::kTooLittleParallax;
    return DecidePose();
  }

  const Rigid3& b_from_a() const { return b_from_a_; }
  double median_parallax_deg() const { return median_parallax_deg_; }
  const DepthSignificance& significance() const { return significance_; }
  // Pairs that agree with the pose and have a reliable depth.
  const std::vector<bool>& inlier() const { return inlier_; }

 private:
  int MinInliersByRatio() const {
    return static_cast<int>(std::ceil(options_.min_inlier_ratio * static_cast<double>(pairs_.size())));
  }

  // Squared displacement of the rays for a camera that is assumed to be still, over the noise of both images.
  Eigen::ArrayXd SquaredDisplacementPx() const {
    return 2 * RotationResiduals(pairs_, Eigen::Matrix3d::Identity());
  }
  double MedianDisplacementPx() const {
    const Eigen::ArrayXd squared = SquaredDisplacementPx();
    return std::sqrt(Median({squared.data(), squared.data() + squared.size()}));
  }

  // Five noisy pairs with little parallax seldom give a good pose. The homography and the rotation are fitted
  // to all pairs, so they offer better starts for the essential matrix.
  void OfferSimplerModels() {
    if (homography_.found && 2 * homography_.inliers > essential_.inliers) {
      if (const auto scaled = ScaleHomography(homography_.model)) {
        const auto motions = DecomposeHomography(*scaled);
        for (std::size_t i = 0; i < motions.size();
             i +=
             2) {  // each pair of motions differs only in the sign of the translation, which is irrelevant
          const Eigen::Vector3d& translation = motions[i].b_from_a.translation;
          if (translation.norm() > 1e-9)
            OfferPose(pairs_, consensus_options_, {motions[i].b_from_a.rotation, translation.normalized()},
                      &essential_);
        }
      }
    }
    if (rotation_.found && 2 * rotation_.inliers > essential_.inliers)
      for (int axis = 0; axis < 3; ++axis)
        OfferPose(pairs_, consensus_options_, {Rotation3(rotation_.model), Eigen::Vector3d::Unit(axis)},
                  &essential_);
  }

  TwoViewOutcome ClassifyRotation() const {
    const double angle_px = Rotation3(rotation_.model).Angle() / pairs_.pixel_angle;
    return angle_px < options_.inlier_px ? TwoViewOutcome::kStill : TwoViewOutcome::kPureRotation;
  }

  // Small calibration errors make a pure rotation look like structure. The residuals of the best rotation
  // must therefore exceed the noise, and also the possible errors of a lens model.
  bool RotationLeavesParallax() const {
    constexpr double kMinNoises = 1.6, kMinPx = 0.6;
    const double limit = options_.inlier_px * options_.inlier_px;
    const Weights inliers = (essential_.squared_px < limit).cast<double>();
    const Eigen::Matrix3d rotation = FitRotation(pairs_, inliers);
    std::vector<double> squared;
    for (const Eigen::Matrix3d* model : {&rotation, &rotation_.model}) {
      const Eigen::ArrayXd residuals = RotationResiduals(pairs_, *model);
      std::vector<double> of_inliers;
      for (Eigen::Index i = 0; i < pairs_.size(); ++i)
        if (inliers[i] != 0) of_inliers.push_back(residuals[i]);
      squared.push_back(Median(std::move(of_inliers)));
    }
    // 1.386 sigma^2 is the median of the sum of two squared normal variables.
    const double deviation = std::sqrt(std::min(squared[0], squared[1]) / 1.386);
    if (deviation > std::max(kMinNoises * noise_px_, kMinPx)) return true;
    // Precisely tracked corners may show less parallax than that. It must then clearly exceed their scatter,
    // and enough corners must contribute that neither chance nor one badly tracked object decides.
    constexpr double kClearNoises = 2.8, kMinClear = 100;
    return inliers.sum() >= kMinClear && deviation > kClearNoises * std::max(scatter_px_, kMinScatterPx);
  }

  TwoViewOutcome DecidePose() {
    const std::vector<PoseCandidate> ranked =
        RankPoses(pairs_, homography_, essential_, options_.inlier_px, noise_px_);
    b_from_a_ = ranked.front().b_from_a;
    const Eigen::ArrayXd squared = EssentialResiduals(pairs_, EssentialFromPose(b_from_a_));
    const std::vector<Depth> depths =
        ClassifyDepths(pairs_, b_from_a_, kMinParallaxThresholds * options_.inlier_px);
    Classify(squared, depths);
    if (consistent_ < MinInliersByRatio()) return TwoViewOutcome::kInconsistent;
    if (HasSecondMotion(squared) || IsStillCameraWithMovingObject()) return TwoViewOutcome::kInconsistent;
    MeasureParallax();
    // Many points without depth beside some with depth also occur when an object moves in front of a rotating
    // camera.
    constexpr double kMaxFarShare = 0.3;
    if (median_parallax_deg_ < options_.min_parallax_deg || far_ > kMaxFarShare * consistent_)
      return TwoViewOutcome::kTooLittleParallax;
    significance_ = MeasureDepthSignificance(
        pairs_, is_consistent_, b_from_a_,
        model_ == ModelKind::kHomography ? StructureModel::kPlane : StructureModel::kGeneral,
        std::max(scatter_px_, kMinScatterPx), options_.depth_noise);
    if (!DepthIsSignificant()) return TwoViewOutcome::kTooLittleParallax;
    if (IsAmbiguous(ranked)) return TwoViewOutcome::kAmbiguousPlane;
    if (std::count(inlier_.begin(), inlier_.end(), true) < options_.min_inliers)
      return TwoViewOutcome::kTooFewMatches;
    return model_ == ModelKind::kHomography ? TwoViewOutcome::kPlanar : TwoViewOutcome::kGeneral;
  }

  bool DepthIsSignificant() const {
    const double ratio = significance_.Ratio(), sigma = significance_.relative_depth_sigma;
    if (ratio >= options_.min_parallax_ratio && sigma <= options_.max_relative_depth_sigma) return true;
    return model_ == ModelKind::kHomography && ratio >= options_.min_plane_parallax_ratio &&
           sigma <= options_.max_plane_depth_sigma;
  }

  // consistent_: pairs with a small residual that are not behind a camera; far_: those of them without depth.
  void Classify(const Eigen::ArrayXd& squared, const std::vector<Depth>& depths) {
    const double limit = options_.inlier_px * options_.inlier_px;
    inlier_.assign(depths.size(), false);
    is_consistent_.assign(depths.size(), false);
    for (std::size_t i = 0; i < depths.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      if (!(squared[row] < limit) || depths[i] == Depth::kBehind) continue;
      is_consistent_[i] = true;
      ++consistent_;
      far_ += depths[i] == Depth::kTooFar;
      // On a plane the homography is stricter than the epipolar constraint: a match that slid along the
      // epipolar line is wrong.
      const bool on_plane = model_ != ModelKind::kHomography ||
                            homography_.squared_px[row] < limit * kTwoDimensional * kTwoDimensional;
      inlier_[i] = on_plane && depths[i] == Depth::kInFront;
    }
  }

  void MeasureParallax() {
    const Eigen::Matrix3d rotation = b_from_a_.rotation.matrix();
    std::vector<double> angles;
    for (std::size_t i = 0; i < is_consistent_.size(); ++i) {
      if (!is_consistent_[i]) continue;
      const auto row = static_cast<Eigen::Index>(i);
      const double chord = (rotation * pairs_.RayA(row) - pairs_.RayB(row)).norm();
      angles.push_back(2 * std::asin(std::min(chord / 2, 1.0)));
    }
    median_parallax_deg_ = kDegreesPerRadian * Median(std::move(angles));
  }

  // True if many of the pairs that disagree with the pose move as one, because the pose may then be that of a
  // moving object. The motion of the background is a rotation (or none) if the camera does not translate.
  bool HasSecondMotion(const Eigen::ArrayXd& squared) const {
    constexpr double kOutlierFactor = 2.0, kMinShare = 0.06;
    constexpr int kMinPairs = 10;
    const double limit_px = kOutlierFactor * options_.inlier_px, limit = limit_px * limit_px;
    std::vector<Eigen::Vector3d> rays_in_a, rays_in_b;
    for (Eigen::Index i = 0; i < pairs_.size(); ++i) {
      const double plane = model_ == ModelKind::kHomography
                               ? homography_.squared_px[i] / (kTwoDimensional * kTwoDimensional)
                               : 0.0;
      if (std::max(squared[i], plane) < limit) continue;
      rays_in_a.push_back(pairs_.RayA(i));
      rays_in_b.push_back(pairs_.RayB(i));
    }
    ConsensusOptions options = wide_options_;
    options.min_inliers =
        std::max(kMinPairs, static_cast<int>(kMinShare * static_cast<double>(pairs_.size())));
    return FindRotation(MakeRayPairs(rays_in_a, rays_in_b, pairs_.pixel_angle), options).inliers >=
           options.min_inliers;
  }

  // True if part of the image has neither motion nor parallax while the rest has. A still camera and a moving
  // object are then more likely than a camera that translates without rotation in front of a distant
  // background.
  bool IsStillCameraWithMovingObject() const {
    constexpr double kMinStillShare = 0.08, kMinFarShare = 0.5;
    constexpr double kStillNoises = 3.0;  // contains nine in ten of the points that do not move
    const double still_px = std::max(kTwoDimensional * options_.inlier_px, kStillNoises * noise_px_);
    constexpr double kFarRatio = 1.5;  // tolerance for the uncertainty of the rotation
    const double far_px = kFarRatio * still_px;
    const Eigen::ArrayXd squared = SquaredDisplacementPx();
    const Eigen::ArrayXd squared_parallax = 2 * RotationResiduals(pairs_, b_from_a_.rotation.matrix());
    int still = 0, still_and_far = 0;
    for (Eigen::Index i = 0; i < pairs_.size(); ++i) {
      if (squared[i] > still_px * still_px) continue;
      ++still;
      still_and_far += squared_parallax[i] < far_px * far_px;
    }
    return still > kMinStillShare * consistent_ && still_and_far > kMinFarShare * still;
  }

  const RayPairs& pairs_;
  const TwoViewOptions& options_;
  ConsensusOptions consensus_options_, wide_options_;
  Consensus rotation_, homography_, essential_;
  double scatter_px_ = 0, noise_px_ = 0;  // as measured, and with a lower limit
  ModelKind model_ = ModelKind::kRotation;
  Rigid3 b_from_a_;
  std::vector<bool> inlier_, is_consistent_;
  int consistent_ = 0, far_ = 0;
  double median_parallax_deg_ = 0;
  DepthSignificance significance_;
};

}  // namespace

std::optional<std::string> TwoViewOptions::Validate() const {
  return OptionCheck()
      .Positive(pixel_angle, "angle of a pixel")
      .Positive(inlier_px, "inlier threshold of two views")
      .AtLeast(max_iterations, 1, "number of iterations of two views")
      .Ratio(confidence, "confidence of two views")
      .AtLeast(min_inliers, 8, "number of inliers of two views")
      .Ratio(min_inlier_ratio, "inlier ratio of two views")
      .Positive(min_parallax_deg, "parallax of two views")
      .Contained(depth_noise.Validate())
      .AtLeast(min_parallax_ratio, 0, "significance of the parallax")
      .Positive(max_relative_depth_sigma, "relative depth sigma")
      .AtLeast(min_plane_parallax_ratio, 0, "significance of the parallax of a plane")
      .Positive(max_plane_depth_sigma, "relative depth sigma of a plane")
      .fault();
}

Hint HintFor(TwoViewOutcome outcome) {
  switch (outcome) {
    case TwoViewOutcome::kGeneral:
    case TwoViewOutcome::kPlanar:
      return Hint::kNone;
    case TwoViewOutcome::kStill:
      return Hint::kMoveSideways;
    case TwoViewOutcome::kPureRotation:
      return Hint::kMoveInsteadOfTurning;
    case TwoViewOutcome::kTooLittleParallax:
      return Hint::kMoveFurther;
    case TwoViewOutcome::kAmbiguousPlane:
      return Hint::kAvoidPlane;
    case TwoViewOutcome::kTooFewMatches:
      return Hint::kFindMoreDetail;
    case TwoViewOutcome::kInconsistent:
      return Hint::kWaitUntilStill;
  }
  return Hint::kNone;
}

TwoViewResult EstimateTwoViews(std::span<const Eigen::Vector3d> rays_in_a,
                               std::span<const Eigen::Vector3d> rays_in_b, const TwoViewOptions& options) {
  Checked(options);
  const std::size_t count = std::min(rays_in_a.size(), rays_in_b.size());
  TwoViewResult result;
  result.points_in_a.assign(count, Eigen::Vector3d::Zero());
  result.inlier.assign(count, false);
  // Rays that are not unit vectors (NaN, zero) are ignored.
  std::vector<Eigen::Vector3d> usable_a, usable_b;
  std::vector<std::size_t> index;
  for (std::size_t i = 0; i < count; ++i) {
    if (!IsUnitRay(rays_in_a[i]) || !IsUnitRay(rays_in_b[i])) continue;
    usable_a.push_back(rays_in_a[i]);
    usable_b.push_back(rays_in_b[i]);
    index.push_back(i);
  }
  constexpr int kMinPairs = 8;  // with fewer pairs even noise fits an essential matrix
  if (static_cast<int>(index.size()) < std::max(options.min_inliers, kMinPairs)) return result;

  const RayPairs pairs = MakeRayPairs(usable_a, usable_b, options.pixel_angle);
  TwoViewEstimator estimator(pairs, options);
  result.outcome = estimator.Decide();
  result.median_parallax_deg = estimator.median_parallax_deg();
  result.significance = estimator.significance();
  if (result.outcome != TwoViewOutcome::kGeneral && result.outcome != TwoViewOutcome::kPlanar) return result;
  result.b_from_a = estimator.b_from_a();
  for (std::size_t i = 0; i < index.size(); ++i) {
    if (!estimator.inlier()[i]) continue;
    const auto point = Triangulate(usable_a[i], usable_b[i], result.b_from_a);
    if (!point) continue;
    result.points_in_a[index[i]] = *point;
    result.inlier[index[i]] = true;
    ++result.inlier_count;
  }
  return result;
}

double ParallaxProgress(const TwoViewResult& result, const TwoViewOptions& options) {
  switch (result.outcome) {
    case TwoViewOutcome::kGeneral:
    case TwoViewOutcome::kPlanar:
    case TwoViewOutcome::kAmbiguousPlane:
      return 1;
    case TwoViewOutcome::kTooLittleParallax:
      break;
    case TwoViewOutcome::kStill:
    case TwoViewOutcome::kPureRotation:
    case TwoViewOutcome::kTooFewMatches:
    case TwoViewOutcome::kInconsistent:
      return 0;
  }
  const double by_angle = result.median_parallax_deg / options.min_parallax_deg;
  // The significance is measured only once the angle is large enough.
  if (by_angle < 1) return 0.5 * by_angle;
  const double by_error = result.significance.Ratio() / options.min_parallax_ratio;
  const double by_depth =
      options.max_relative_depth_sigma / std::max(result.significance.relative_depth_sigma, 1e-9);
  return 0.5 + 0.5 * std::clamp(std::min(by_error, by_depth), 0.0, 1.0);
}

}  // namespace docent::engine
