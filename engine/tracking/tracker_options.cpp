// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/tracker_options.h"

#include "engine/base/option_check.h"

namespace docent::engine {

std::optional<std::string> TrackerOptions::Validate() const {
  return OptionCheck()
      .AtLeast(low_texture_points, 0, "number of points of low texture")
      .Ratio(min_explained_variance, "explained variance")
      .Ratio(min_image_overlap, "image overlap")
      .AtLeast(max_direct_rotation_s, 0, "time of direct rotation tracking")
      .Ratio(good_quality, "inlier ratio of good quality")
      .Within(lost_quality, 0, good_quality, "inlier ratio of a lost frame")
      .AtLeast(min_inliers, 1, "number of inliers")
      .AtLeast(min_inliers_at_high_quality, 1, "number of inliers at high quality")
      .Ratio(high_quality, "inlier ratio of high quality")
      .AtLeast(min_consensus_inliers, 1, "number of inliers of a consensus")
      .Ratio(min_consensus_ratio, "inlier ratio of a consensus")
      .Positive(max_consensus_sigma, "sigma of a consensus")
      .Within(min_cells, 0, 16, "number of image cells")
      .Positive(max_sigma, "sigma")
      .Positive(max_rotation_sigma, "sigma of a rotation")
      .AtLeast(max_poor_rotation_frames, 1, "number of frames with a poor rotation")
      .AtLeast(frames_between_keyframes, 0, "number of frames between keyframes")
      .AtLeast(max_frames_without_keyframe, 0, "number of frames without an accepted keyframe")
      .Ratio(min_kept_ratio, "ratio of inliers kept since a keyframe")
      .AtLeast(min_relocalization_inliers, 1, "number of inliers after a loss")
      .Ratio(min_relocalization_quality, "inlier ratio after a loss")
      .Within(min_relocalization_cells, 0, 16, "number of image cells after a loss")
      .AtLeast(short_loss_s, 0, "time of a short loss")
      .AtLeast(max_retrieved, 1, "number of retrieved keyframes")
      .AtLeast(max_retrieved_per_map, 1, "number of retrieved keyframes of one map")
      .That(max_verified > 0, "At least one candidate must be verified.")
      .AtLeast(min_quality_ratio, 1, "best-to-second ratio")
      .AtLeast(min_leading_frames, 1, "number of leading frames")
      .AtLeast(confirming_frames, 1, "number of confirming frames")
      .Ratio(poor_visible_ratio, "visible inlier ratio of a poor pose")
      .Ratio(max_contradicted_ratio, "contradicted ratio of a pose after a loss")
      .Ratio(max_contradicted_area, "contradicted area of a pose after a loss")
      .AtLeast(better_ratio, 1, "ratio of a better map")
      .AtLeast(frames_between_better_map_searches, 1, "number of frames between searches")
      .AtLeast(min_standard_ratio, 0, "ratio of inliers of the standard comparison")
      .AtLeast(min_tolerant_inliers, 1, "number of inliers with photometric tolerance")
      .Positive(max_tolerant_sigma, "sigma with photometric tolerance")
      .AtLeast(min_tight_inliers, 1, "number of inliers of a pose with a small residual")
      .Positive(max_tight_sigma, "sigma of a pose with a small residual")
      .AtLeast(few_points_of_map, 0, "number of finite inliers below which visual odometry is prepared")
      .AtLeast(max_odometry_s, 0, "time of visual odometry")
      .Contained(features.Validate())
      .Contained(map_tracker.Validate())
      .Contained(initializer.Validate())
      .Contained(target_start.Validate())
      .Contained(keyframes.Validate())
      .Contained(keyframe_policy.Validate())
      .Contained(rotation_center.Validate())
      .Contained(readout.Validate())
      .fault();
}

}  // namespace docent::engine
