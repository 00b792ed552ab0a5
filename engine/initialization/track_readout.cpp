// SPDX-License-Identifier: Apache-2.0
#include "engine/initialization/track_readout.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "engine/base/option_check.h"
#include "engine/initialization/track_bundle.h"

namespace docent::engine {

namespace {

struct BetterAxis {
  std::size_t axis = 0;
  double cost_ratio = 1;  // of the other one
};
BetterAxis FindBetterAxis(const std::array<TrackBundle, 2>& bundles) {
  const double sigma_px = std::min(bundles[0].RobustSigma(), bundles[1].RobustSigma()),
               rows = bundles[0].Cost(sigma_px), columns = bundles[1].Cost(sigma_px);
  return rows < columns ? BetterAxis{0, columns / rows} : BetterAxis{1, rows / columns};
}

}  // namespace

std::optional<std::string> TrackReadoutOptions::Validate() const {
  return OptionCheck()
      .AtLeast(min_corners, 8, "number of corners used to estimate the readout time")
      .AtLeast(bundle.max_corners, min_corners, "largest number of corners used to estimate the readout time")
      .AtLeast(min_images, 4, "number of images used to estimate the readout time")
      .Positive(bundle.prior_sigma_s, "sigma of an unknown readout time")
      .Positive(bundle.min_noise_px, "smallest noise of a corner")
      .AtLeast(systematic_s_per_px, 0, "systematic error of a readout time")
      .AtLeast(max_noise_px, bundle.min_noise_px, "largest noise of a corner")
      .AtLeast(min_readout_sigmas, 0, "significance of a readout time")
      .AtLeast(min_readout_s, 0, "smallest readout time")
      .fault();
}

std::optional<TrackReadout> EstimateTrackReadout(const TrackReadoutOptions& options,
                                                 const CameraModel& camera, const CornerSequence& sequence) {
  if (static_cast<int>(sequence.images.size()) < options.min_images ||
      static_cast<int>(sequence.corners.size()) < options.min_corners)
    return std::nullopt;
  constexpr int kGlobalShutterSteps = 4, kFirstSteps = 4, kSteps = 40;
  const TrackBundle initial(options.bundle, camera, sequence);
  if (static_cast<int>(initial.corners()) < options.min_corners) return std::nullopt;
  // While the poses are not right yet, the significance of an axis misleads: where either is possible, both
  // are adjusted until one fits clearly better.
  constexpr double kClearly = 2;
  std::array<TrackBundle, 2> bundles = {initial, initial};
  std::vector<std::size_t> axes = {0, 1};
  if (const auto known = ReadoutAxis(camera)) axes = {static_cast<std::size_t>(*known)};
  const auto adjust = [&](std::size_t axis, int steps) {
    bundles[axis].Adjust(static_cast<Eigen::Index>(axis), steps);
  };
  for (const std::size_t axis : axes) {
    bundles[axis].Adjust(std::nullopt, kGlobalShutterSteps);
    adjust(axis, kFirstSteps);
  }
  if (axes.size() > 1) {
    const BetterAxis first = FindBetterAxis(bundles);
    if (first.cost_ratio > kClearly) axes = {first.axis};
  }
  std::vector<char> outliers(initial.corners(), 1);
  for (const std::size_t axis : axes) {
    adjust(axis, kSteps);
    const std::vector<char> found = bundles[axis].Outliers();
    for (std::size_t i = 0; i < outliers.size(); ++i) outliers[i] = outliers[i] && found[i];
  }
  for (const std::size_t axis : axes) {
    bundles[axis].Remove(outliers);
    if (static_cast<int>(bundles[axis].corners()) < options.min_corners) return std::nullopt;
    bundles[axis].UseCauchyLoss();
    adjust(axis, kSteps);
  }
  const std::size_t axis = axes.size() == 1 ? axes.front() : FindBetterAxis(bundles).axis;
  TrackBundle& bundle = bundles[axis];
  TrackReadout result;
  result.readout_s = bundle.readout_s();
  result.noise_px = bundle.sigma_px();
  result.sigma_s = std::hypot(bundle.ReadoutSigma(static_cast<Eigen::Index>(axis)),
                              options.systematic_s_per_px * bundle.RobustSigma());
  for (const CornerSequence::Image& image : sequence.images) result.times.push_back(image.time);
  result.rotation_rates = bundle.RotationRates();
  const double interval_s = ToSeconds(sequence.images.back().time - sequence.images.front().time) /
                            static_cast<double>(sequence.images.size() - 1);
  const double longest_s = result.readout_s.norm();
  constexpr double kMaxIntervals = 1.3;
  if (longest_s > kMaxIntervals * interval_s) return std::nullopt;
  if (longest_s > interval_s) result.readout_s *= interval_s / longest_s;
  const bool fits = result.noise_px <= options.max_noise_px && result.readout_s.allFinite() &&
                    std::isfinite(result.sigma_s);
  return fits ? std::optional(std::move(result)) : std::nullopt;
}

std::optional<ReadoutPrior> SignificantReadout(const TrackReadoutOptions& options,
                                               const TrackReadout& estimate) {
  const double smallest = std::max(options.min_readout_s, options.min_readout_sigmas * estimate.sigma_s);
  if (estimate.readout_s.norm() < smallest) return std::nullopt;
  return ReadoutPrior{estimate.readout_s, estimate.sigma_s};
}

}  // namespace docent::engine
