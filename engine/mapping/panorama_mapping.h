// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/map/map.h"
#include "engine/tracking/point_search.h"
#include "engine/tracking/pose_refinement.h"

// What the mapper does for panorama keyframes (hybrid-slam §4.2, §4.4, §5.1). For its thread.
namespace docent::engine {

struct InfinitePointOptions {
  std::array<int, kPyramidLevels> max_points = {110, 80, 50, 30};  // a keyframe, by level
  float min_corner_score = 12.0f;                                  // Shi-Tomasi, grey values squared
  float min_distance_px = 9.0f;  // to any known feature, pixels of the level
};

// New infinite points from corners of a keyframe of a panorama map that no point explains yet. `taken`:
// level-0 pixels where finite points were seen that the keyframe does not observe in the map. Returns how
// many.
int AddInfinitePoints(const InfinitePointOptions& options, KeyFrameId keyframe,
                      std::span<const Eigen::Vector2f> taken, Map* map);

struct LocalizationOptions {
  float search_radius_px = 20;  // level 0, about where the turned-only pose expects a point
  double inlier_px = 4;         // RANSAC, level 0
  int min_inliers = 40;         // strict, since a wrong pose would harm the 3D map (hybrid-slam §4)
  double min_inlier_ratio = 0.4;
  int min_cells = 6;                 // of a 4x4 grid over the image
  double max_sigma = 2.0;            // robust, of the normalised residuals
  double max_position_sigma = 0.01;  // of the mean depth, from the covariance
};

// Appearance for the map's finite points in a dependent panorama keyframe by active search, and estimates its
// pose from them: three-point RANSAC, then robust refinement over its inliers. If that holds by all counts,
// the keyframe is localized: it becomes the reference of a panorama map of its own, with the inliers as
// observations (hybrid-slam §5.1). False when it does not; then nothing has changed. guess: where to look
// from instead of the keyframe's own pose; null for none.
bool LocalizePanoramaKeyFrame(const LocalizationOptions& options, KeyFrameId keyframe, std::uint64_t seed,
                              Map* map, PointSearcher* searcher, const Rigid3* guess = nullptr);

// Removes observations of infinite points of a panorama map under another direction than the point's, which
// is the mean of all. Returns how many.
int DropInfiniteOutliers(PanoramaId panorama, Map* map);

// Removes the infinite points of a localized keyframe that a finite point, seen at the same place, stands
// for. Returns how many.
int DropInfiniteTwins(KeyFrameId keyframe, Map* map);

}  // namespace docent::engine
