// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/pose_criteria.h"

namespace docent::engine {

namespace {

// Inlier ratio below which a pose is accepted only if its residuals are small. Measured with images that
// differ from the map's: right poses have a sigma of 0.8 to 1.1; of the poses with an inlier ratio below 0.2
// and a sigma of 1.0 or more, some were off by a third of a metre.
constexpr double kSmallRatio = 0.2;

bool FitsWell(const MapTrackResult& result) {
  constexpr double kMaxSigma = 1.5, kMaxSigmaAtSmallRatio = 0.8;
  return result.sigma <= (result.Quality() >= kSmallRatio ? kMaxSigma : kMaxSigmaAtSmallRatio);
}

}  // namespace

bool PoseCriteria::IsAccepted(const MapTrackResult& result, PatchComparison comparison) const {
  const bool low_requirement =
      result.observed == ObservedMotion::kPanorama || result.Quality() >= options_.high_quality;
  const int min_inliers = low_requirement ? options_.min_inliers_at_high_quality : options_.min_inliers;
  // Photometric tolerance matches by chance more often, and while maps are only viewed, content must not
  // jump. In overexposed images right poses had a sigma of 1.6 to 1.9, and nearly all points found agreed.
  const bool strict = comparison == PatchComparison::kTolerant || !options_.build_maps;
  const bool fits = !strict || result.Quality() >= options_.good_quality || FitsWell(result) ||
                    (result.Quality() >= kSmallRatio && HasConsensus(result));
  return fits && result.converged && result.sigma <= options_.max_sigma && result.inliers >= min_inliers &&
         result.occupied_cells >= options_.min_cells &&
         (result.Quality() >= options_.lost_quality || HasConsensus(result));
}

// Whether the inliers alone show that the pose is right, whatever the ratio of points found.
bool PoseCriteria::HasConsensus(const MapTrackResult& result) const {
  return result.inliers >= options_.min_consensus_inliers && result.sigma <= options_.max_consensus_sigma &&
         result.inliers >= options_.min_consensus_ratio * result.found;
}

bool PoseCriteria::IsGood(const MapTrackResult& result) const {
  return result.Quality() >= options_.good_quality || HasConsensus(result);
}

bool PoseCriteria::KeepsTrackWithFewPoints(const MapTrackResult& result) const {
  if (options_.build_maps || !result.converged || result.observed != ObservedMotion::kSixDof) return false;
  if (result.occupied_cells < options_.min_relocalization_cells || result.Quality() < options_.lost_quality)
    return false;
  if (result.inliers >= options_.min_inliers) return FitsWell(result);
  return result.inliers >= options_.min_tight_inliers && result.sigma <= options_.max_tight_sigma;
}

bool PoseCriteria::FitsRotation(const MapTrackResult& result, const MapSnapshot& map) const {
  return result.observed != ObservedMotion::kPanorama || !map.HasFinitePoints() ||
         result.sigma <= options_.max_rotation_sigma;
}

RejectionReason PoseCriteria::RejectionReasonOf(const MapTrackResult& result, const MapSnapshot& map,
                                                PatchComparison comparison) const {
  // Images that differ photometrically from the map's show fewer of its points, but still many, with small
  // residuals.
  const bool fits = comparison == PatchComparison::kTolerant &&
                    result.inliers >= options_.min_tolerant_inliers &&
                    result.sigma <= options_.max_tolerant_sigma;
  const double min_quality = fits ? options_.lost_quality : options_.min_relocalization_quality;
  if (result.inliers < options_.min_relocalization_inliers || result.Quality() < min_quality)
    return RejectionReason::kFewPoints;
  if (!result.converged || result.sigma > options_.max_sigma || !FitsRotation(result, map))
    return RejectionReason::kPoorFit;
  if (result.occupied_cells < options_.min_relocalization_cells) return RejectionReason::kClustered;
  return IsContradicted(result) ? RejectionReason::kContradicted : RejectionReason::kNone;
}

bool PoseCriteria::IsContradicted(const MapTrackResult& result) const {
  return result.contradicted_ratio > options_.max_contradicted_ratio ||
         (options_.build_maps && result.contradicted_area > options_.max_contradicted_area);
}

}  // namespace docent::engine
