// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "engine/base/time.h"
#include "engine/geometry/camera_model.h"
#include "engine/geometry/readout_prior.h"
#include "engine/geometry/rigid3.h"
#include "engine/initialization/two_view_geometry.h"
#include "engine/map/map_snapshot.h"

namespace docent::engine {

// Two views with matched corners and the relative pose between them: sufficient to initialize a map.
struct InitialPair {
  struct View {
    Timestamp time{};
    std::shared_ptr<const ImageFeatures> features;
    std::shared_ptr<const CameraModel> camera = nullptr;  // of this image; null: InitialPair::camera
  };
  struct Match {
    Eigen::Vector2f pixel_a, pixel_b;  // level 0
    std::uint8_t level = 0;            // pyramid level of the corner in view a
  };
  std::shared_ptr<const CameraModel> camera;
  View a, b;
  std::vector<Match> matches;
  Rigid3 a_from_map;       // pose of the first view if the map already exists as a panorama; else identity
  TwoViewResult geometry;  // one inlier flag and one point per match
  std::optional<ReadoutPrior> readout;  // what is known of the readout time without a map
  double baseline_m = 0;                // distance of the views in metres; 0 if unknown
};

}  // namespace docent::engine
