// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/map/map.h"
#include "engine/mapping/calibration/self_calibration.h"
#include "engine/matching/guided_matching.h"
#include "engine/matching/point_search.h"

namespace docent::engine {

// Field of view across the longer side of the image, degrees, that is assumed for an unknown lens. Webcams
// and phones lie between 50 and 80.
inline constexpr double kUnknownFieldOfView_deg = 60;

// The current estimate of the calibration of one camera.
struct EstimatedLens {
  std::shared_ptr<const CameraModel> model;  // radial-tangential with fx = fy; only k1 and k2 may be nonzero
  // Standard deviation of the focal length, relative to it. The initial value covers fields of view from 40
  // to 90 degrees.
  double focal_sigma = 0.4;
  bool fixed = false;     // the estimate is precise enough and does not change any more
  std::string name = {};  // name of the camera, for messages
};

// A given calibration whose focal length the map contradicts.
struct CalibrationContradiction {
  // Of the calibration, and as estimated from the map. Matches that were selected with a wrong calibration
  // bias the estimate: for calibrations that were 1.5 times too long or too short, it was off by 5 to 25 %.
  double given_focal_px = 0, focal_px = 0;
};

struct LensEstimationOptions {
  std::vector<EstimatedLens> lenses = {};  // with different models; empty: nothing is estimated
  std::size_t min_keyframes = 4;           // number of keyframes in the map for the first estimate
  double growth = 1.3;                     // factor by which that number grows until the next estimate
  // Fields of view, degrees, from which the optimization starts while the relative standard deviation of the
  // focal length is above `coarse_sigma`.
  std::vector<double> fields_of_view_deg = {40, 50, 60, 72, 85, 100};
  double coarse_sigma = 0.05;
  // Estimates with a larger relative standard deviation are not used.
  double max_sigma = 0.1;
  // An estimate replaces the lens if the focal length differs by more than this number of its standard
  // deviations and by more than this ratio, or if the corner of the image moves by more than this many
  // pixels.
  double min_change_sigmas = 1, min_change = 0.003, min_change_px = 1.0;
  // After a change, guided matching is repeated in all keyframes and the lens is estimated again, because the
  // existing matches were selected with the previous lens. Maximum number of such rounds in a row.
  int max_rounds = 3;
  // The lens is fixed when its relative standard deviation is at most this and the estimates have differed by
  // no more than this while the number of keyframes doubled, and not before this number of keyframes.
  double fixed_sigma = 0.005;
  std::size_t min_fixed_keyframes = 16;
  GuidedMatchingOptions search;  // of the guided matching after a change
  // A given calibration is checked at this number of keyframes, and again whenever the number has grown by
  // `growth`, until an estimate agrees with it. A warning needs a focal length that differs from the estimate
  // by more than this, as a difference of logarithms and in standard deviations of the estimate, and
  // residuals of the estimate below this ratio of those with the given calibration. CalibrationMonitor
  // detects smaller errors.
  std::size_t min_checked_keyframes = 5;
  double contradiction_change = 0.2, contradiction_sigmas = 4, contradiction_residual = 0.9;
  SelfCalibrationOptions calibration = {.k2_prior_sigma = 0.15, .center_prior_sigma = 0.015};
  // Standard deviation of the error that the lens model itself causes, relative to the focal length. It is
  // added in quadrature.
  double model_sigma = 0.003;

  // Describes the first invalid option in one sentence, or empty.
  std::optional<std::string> Validate() const;
};

// Estimates the unknown calibrations of a map's keyframes while the map grows (self_calibration.h), and
// adapts the map to the result: all keyframes of the lens get the new model, poses and points are adjusted,
// and a MapCorrection lets trackers and content follow. Used by the mapper on its own thread only.
class LensEstimation {
 public:
  explicit LensEstimation(const LensEstimationOptions& options);

  // To be called when another map is built. The estimates are kept.
  void Reset();
  enum class Progress {
    kNothing,      // no step is due
    kStepDone,     // the map may have gained observations
    kMapChanged,   // poses and points changed, and possibly lenses
    kLensUpdated,  // the estimate of a lens is more precise; the map did not change
  };
  // Does one step. If *interrupt (may be null) becomes true, an adjustment stops without changes and remains
  // due.
  Progress Step(PointSearcher* searcher, const std::atomic<bool>* interrupt, Map* map);

  // Checks whether the map contradicts the focal length of a given calibration, and reports that at most once
  // per calibration. To be called when no other work is due.
  std::optional<CalibrationContradiction> Check(const std::atomic<bool>* interrupt, const Map& map);

  const std::vector<EstimatedLens>& lenses() const { return lenses_; }
  // The lens of the last kMapChanged or kLensUpdated.
  const EstimatedLens& last() const { return lenses_[last_]; }
  // The newest model of the lens that `model` is an earlier estimate of; `model` itself if it is given.
  std::shared_ptr<const CameraModel> CurrentModel(const std::shared_ptr<const CameraModel>& model) const;

 private:
  struct Estimate {
    std::size_t keyframes = 0;
    double log_focal = 0;
  };
  // Of one lens in the current map.
  struct Plan {
    std::size_t next_at = 0;  // number of its keyframes at the next estimate
    int round = 0;
    std::vector<Estimate> estimates;
  };
  bool IsVersionOf(std::size_t lens, const CameraModel* model) const;
  bool IsOutdated(std::size_t lens, const Map& map) const;
  std::size_t KeyFramesOf(std::size_t lens, const Map& map) const;
  Progress EstimateLens(std::size_t lens, const std::atomic<bool>* interrupt, Map* map);
  Progress UpdateMap(std::size_t lens, const std::atomic<bool>* interrupt, Map* map);
  bool HasConverged(const Plan& plan, std::size_t keyframes) const;

  const LensEstimationOptions options_;
  std::vector<EstimatedLens> lenses_;
  // All models that each lens has had. They are kept alive, so that an address identifies a model.
  std::vector<std::vector<std::shared_ptr<const CameraModel>>> versions_;
  std::vector<Plan> plans_;
  struct GivenCalibration {
    std::shared_ptr<const CameraModel> model;
    std::size_t next_at = 0;  // number of its keyframes at the next check
    bool done = false;        // it agrees with an estimate, or a warning was given
  };
  std::vector<GivenCalibration> given_;
  std::deque<KeyFrameId> to_match_;
  std::size_t last_ = 0;
};

}  // namespace docent::engine
