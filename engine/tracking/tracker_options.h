// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>

#include "engine/initialization/initializer.h"
#include "engine/initialization/target_initializer.h"
#include "engine/tracking/descriptor_relocalizer.h"
#include "engine/tracking/keyframe_novelty.h"
#include "engine/tracking/keyframe_policy.h"
#include "engine/tracking/map_tracker.h"
#include "engine/tracking/readout_estimator.h"
#include "engine/tracking/rotation_center.h"
#include "engine/vision/features.h"

namespace docent::engine {

struct TrackerOptions {
  FeatureOptions features;
  MapTrackerOptions map_tracker;
  InitializerOptions initializer;
  // If given, maps are initialized from this planar target, in metres (hybrid-slam §5.5), instead of from two
  // arbitrary views.
  std::shared_ptr<const PlanarTarget> target;
  TargetStartOptions target_start;
  KeyFrameNoveltyOptions keyframes;
  KeyFramePolicyOptions keyframe_policy;
  RotationCenterOptions rotation_center;
  // Enables panorama maps (hybrid-slam): pure rotation is tracked by infinite points, and a new map starts as
  // a panorama map with its first image. If false, only general motion is tracked, as in ptamm.
  bool hybrid = true;
  // Low texture: if no more points than this can be searched, the rotation is tracked directly from all
  // pixels.
  int low_texture_points = 60;
  // Ratio of the image's variance that direct rotation tracking must explain.
  double min_explained_variance = 0.8;
  double min_image_overlap = 0.5;  // overlap with the image that the rotation is measured from
  // Longest time of direct rotation tracking without map points, in seconds: small errors accumulate.
  double max_direct_rotation_s = 5.0;
  double good_quality = 0.30;  // inlier ratio of good tracking quality (ptamm §2.1)
  double lost_quality = 0.13;  // inlier ratio below which a frame is lost (ptamm §2.1)
  // A pose with fewer inliers is rejected whatever its inlier ratio: patches that match by chance agree with
  // some pose too. When a camera left the map, poses with 20 to 30 inliers jumped by two degrees and more.
  int min_inliers = 30;
  // Enough if only the rotation is estimated, or if the inlier ratio reaches high_quality, as in low texture.
  int min_inliers_at_high_quality = 12;
  double high_quality = 0.5;
  // Consensus: a pose with this many inliers, this inlier ratio among the points found and this small a
  // residual is good whatever the ratio of points found, because in a dense part of a map most points may be
  // occluded or look different. Measured on frames below `good_quality`: true poses (an office, a flying
  // drone) had a sigma of 0.7-2.3 and 61-99 % inliers among the points found; chance matches had a sigma of
  // 3.8-15.
  int min_consensus_inliers = 60;    // twice `min_inliers`
  double min_consensus_ratio = 0.6;  // inliers over points found
  double max_consensus_sigma = 2.0;
  int min_cells = 3;  // cells of the 4x4 image grid with an inlier
  // Largest robust sigma of the normalized residuals: where nothing fits, the robust threshold grows until
  // chance matches pass it. A true pose has a sigma below 1.
  double max_sigma = 4.0;
  // The same for a pure rotation in a map with finite points: true rotations have less than half of it. If it
  // is exceeded for this many frames, the camera has translated and counts as lost, so that its translation
  // is not taken for rotation.
  double max_rotation_sigma = 1.0;
  int max_poor_rotation_frames = 5;
  // Lets the mapper's result for the last keyframe arrive in the map first.
  int frames_between_keyframes = 4;
  // After so many, half a second at 30 Hz, a keyframe that the map does not have yet is no longer awaited:
  // the mapper may have dropped it.
  int max_frames_without_keyframe = 15;
  // A frame with fewer inliers than this ratio of the last keyframe's waits only until that one is in the
  // map. Measured on cameras that rush past shelves and desks: 0.9 keeps almost as many images as never
  // waiting, where slow cameras get up to 73 % more keyframes; 0.8 loses a third more of the images than 0.9.
  double min_kept_ratio = 0.9;
  // Conditions on a pose that was found after a loss (ptamm §6.3).
  int min_relocalization_inliers = 40;
  double min_relocalization_quality = 0.25;
  int min_relocalization_cells = 5;
  double short_loss_s = 2.0;  // time after a loss in which the last pose is tried first
  int max_retrieved = 10;  // Keyframes retrieved by thumbnail, each then aligned to the image by a rotation.
  int max_retrieved_per_map = 4;       // contained in max_retrieved
  std::size_t max_verified = 3;        // candidates of these that are verified per frame
  std::size_t max_competing_maps = 2;  // other maps that are verified as well, each by its best candidate
  // Best-to-second ratio of the qualities of two maps above which the best is accepted. It is accepted too
  // after it was better by any amount for min_leading_frames consecutive frames: overlapping maps both
  // explain the image and must not block each other for ever.
  double min_quality_ratio = 1.2;
  int min_leading_frames = 15;
  // Consecutive frames that must confirm a hypothesis before another map is entered (ptamm §6.3), and before
  // a map that was entered or found again is extended.
  int confirming_frames = 3;
  // Visible inlier ratio below which the pose may belong to another place of similar appearance: such a pose
  // needs confirmation, the map is not extended by it, and of overlapping maps that are not extended another
  // one may fit better (ptamm §5.3).
  double poor_visible_ratio = 0.5;  // inliers over all points in view, occluded ones included
  // MapTrackResult::contradicted_ratio above which a pose that was found after a loss is rejected. In visits
  // to a real kitchen whose images were blurred, overexposed, taken with a longer lens or hidden to a third
  // by people, it was 0.03 to 0.40 for right poses; in simulated bays that share a cabinet, 0.68 to 0.76 for
  // wrong ones.
  double max_contradicted_ratio = 0.55;
  // The same of MapTrackResult::contradicted_area, while maps are built. Of poses in a rendered museum whose
  // bays share a cabinet, 93 % of 490 right ones had at most this, and 7 % of 227 wrong ones; 92 and 41 % had
  // at most max_contradicted_ratio. A visitor is lost where an author begins a new map, and people may hide
  // 42 % of an image.
  double max_contradicted_area = 0.45;
  // Ratio by which another map or place must exceed that of the present one to be entered.
  double better_ratio = 1.3;
  // Interval of the search for such a map while the present quality is good.
  int frames_between_better_map_searches = 2;
  // Photometric tolerance ends when the standard comparison has at least this ratio of the last frame's
  // inliers; a smaller number than before may come from a different selection of points.
  double min_standard_ratio = 0.9;
  // With photometric tolerance, a pose after a loss with this many inliers and this small a residual needs
  // only `lost_quality`. Right poses had 69 to 193 inliers of 600 points and mostly a sigma of 0.8 to 1.3; a
  // wrong one had 81 inliers. In a thousand trials with images of other places no pose had a dozen inliers.
  int min_tolerant_inliers = 100;
  double max_tolerant_sigma = 1.2;
  // While maps are not extended, tracking continues with this few inliers if their residual is this small:
  // poses with 13 to 29 inliers and a sigma of 0.4 to 0.9 were right to 3 cm.
  int min_tight_inliers = 12;
  double max_tight_sigma = 1.0;
  // While maps are only viewed: with fewer finite inliers of the map than this, a quarter of what is searched
  // per frame, images are kept for visual odometry.
  int few_points_of_map = 150;
  // Longest time of visual odometry without the map, in seconds; 0 for none. Chosen, because
  // errors grow with it; measured for six seconds, in which they stayed as small as the map's own.
  double max_odometry_s = 10.0;
  ReadoutOptions readout;  // of a rolling shutter
  bool build_maps = true;  // if false, a frame without a map is lost, not initializing

  // Describes the first invalid option of tracking in one sentence, or empty.
  std::optional<std::string> Validate() const;
};

}  // namespace docent::engine
