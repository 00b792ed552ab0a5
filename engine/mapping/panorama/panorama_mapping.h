// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/map/map.h"
#include "engine/matching/point_search.h"
#include "engine/matching/pose_refinement.h"

// Operations of the mapper on panorama keyframes (hybrid-slam §4.2, §4.4, §5.1). For the mapper's thread.
namespace docent::engine {

struct InfinitePointOptions {
  std::array<int, kPyramidLevels> max_points = {110, 80, 50, 30};  // per keyframe, by level
  float min_corner_score = 12.0f;                                  // Shi-Tomasi, grey values squared
  float min_distance_px = 9.0f;  // to any known feature, pixels of the level

  // Describes the first invalid option in one sentence, or empty.
  std::optional<std::string> Validate() const;
};

// Creates infinite points from unmatched corners of a keyframe of a panorama map. taken: level-0 pixels of
// finite points that the tracker found but that the keyframe does not observe in the map. Returns the number
// of new points.
int AddInfinitePoints(const InfinitePointOptions& options, KeyFrameId keyframe,
                      std::span<const Eigen::Vector2f> taken, Map* map);

struct LocalizationOptions {
  float search_radius_px = 20;  // level 0, about the prediction from the pose of the panorama
  double inlier_px = 4;         // RANSAC, level 0
  int min_inliers = 40;         // strict, since a wrong pose would harm the 3D map (hybrid-slam §4)
  double min_inlier_ratio = 0.4;
  int min_cells = 6;                 // occupied cells of a 4x4 grid over the image
  double max_sigma = 2.0;            // robust standard deviation of the normalized residuals
  double max_position_sigma = 0.01;  // ratio of the median depth of the inliers, from the covariance

  // Describes the first invalid option in one sentence, or empty.
  std::optional<std::string> Validate() const;
};

// Localizes a dependent panorama keyframe (hybrid-slam §5.1): searches the finite points of the map in it,
// and estimates its pose by three-point RANSAC and robust refinement over the inliers. If the pose passes
// every check, the keyframe becomes the reference of its own panorama map and observes the inliers. Returns
// false and changes nothing otherwise. guess: pose from which to search instead of the keyframe's own; null
// for none.
bool LocalizePanoramaKeyFrame(const LocalizationOptions& options, KeyFrameId keyframe, std::uint64_t seed,
                              Map* map, PointSearcher* searcher, const Rigid3* guess = nullptr);

// Removes observations of infinite points of a panorama map whose ray deviates from the direction of the
// point, and updates the directions of these points. Returns the number removed. A direction is that of the
// ray that created the point, or the mean of the observations at its last update (Map::UpdateDirection),
// which follows a movement of the panorama map: an observation that is only added does not change it.
int RemoveInfiniteOutliers(PanoramaId panorama, Map* map);

// Removes infinite points of a localized keyframe that coincide in the image with a finite point. Returns the
// number removed.
int RemoveDuplicateInfinitePoints(KeyFrameId keyframe, Map* map);

}  // namespace docent::engine
