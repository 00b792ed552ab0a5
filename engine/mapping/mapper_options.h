// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>

#include "engine/initialization/track_readout.h"
#include "engine/mapping/bundle/map_adjustment.h"
#include "engine/mapping/calibration/lens_estimation.h"
#include "engine/mapping/calibration/readout_estimation.h"
#include "engine/mapping/loops/loop_closing.h"
#include "engine/mapping/loops/map_joining.h"
#include "engine/mapping/panorama/panorama_mapping.h"
#include "engine/mapping/points/keyframe_culling.h"
#include "engine/mapping/points/map_descriptors.h"
#include "engine/mapping/points/point_creation.h"
#include "engine/matching/guided_matching.h"
#include "engine/matching/point_search.h"
#include "engine/vision/image_store.h"

namespace docent::engine {

struct MapperOptions {
  std::size_t max_queue = 3;             // keyframes that wait to be inserted (ptamm §2.2)
  double initial_baseline = 0.1;         // distance of the two initial views if it is unknown, ptamm §2.3
  int neighbours = 3;                    // keyframes in which the corners of a new keyframe are searched
  double min_neighbour_baseline = 0.03;  // ratio of the keyframe's median depth
  double max_neighbour_baseline = 0.6;   // ratio of the keyframe's median depth
  int min_initial_points = 60;  // after the first adjustment; with fewer the initialization is given up
  GuidedMatchingOptions guided_matching;
  PointCreationOptions creation;
  InfinitePointOptions infinite;
  LocalizationOptions localization;
  AppearanceOptions appearance;
  KeyFrameCullingOptions culling;
  int min_initial_directions = 40;  // infinite points in the first image that start a map as a panorama
  // Minimum parallax to triangulate infinite points: points that are seen from two panorama maps are mostly
  // further away (hybrid-slam §5.2).
  double min_infinite_parallax_deg = 1.5;
  // Keyframes in which the infinite points of a localized keyframe are searched.
  int conversion_neighbours = 30;
  MapAdjustmentOptions adjustment;
  LoopOptions loops;
  MapJoiningOptions joining;
  LensEstimationOptions lens;
  ReadoutEstimationOptions readout;   // of a rolling shutter, from the map
  TrackReadoutOptions track_readout;  // from corners
  SearchOptions search;
  // Whether the adopted map is only extended for a while: its keyframes keep their poses, no more than
  // max_temporary_keyframes of the added ones are kept, and neither loops, lenses nor the whole map are
  // worked on.
  bool temporary = false;
  std::size_t max_temporary_keyframes = 20;  // chosen to bound the memory, not measured
  std::shared_ptr<ImageStore> images;        // stores the keyframes' images; null: in memory

  // Describes the first invalid option in one sentence, or empty.
  std::optional<std::string> Validate() const;
};

}  // namespace docent::engine
