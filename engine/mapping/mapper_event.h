// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <variant>

#include "engine/base/time.h"
#include "engine/map/map_snapshot.h"
#include "engine/mapping/bundle/bundle_adjustment.h"
#include "engine/mapping/calibration/lens_estimation.h"
#include "engine/mapping/loops/loop_closing.h"

namespace docent::engine {

// What the mapper did, as values: words are made of them where a person reads them.
struct MapperEvent {
  struct MapStarted {
    std::size_t points = 0;  // finite
  };
  // The initialization was given up: too few points are consistent.
  struct StartFailed {
    std::size_t points = 0;
  };
  struct KeyFrameAdded {
    std::size_t new_points = 0, points = 0;  // created with it, and in the whole map
  };
  struct PanoramaOpened {
    int infinite_points = 0;
  };
  struct PanoramaKeyFrameAdded {
    int infinite_points = 0;  // new ones
  };
  // A panorama keyframe now has a position relative to finite points.
  struct KeyFrameLocalized {
    KeyFrameId keyframe = kNoId;
    bool by_descriptors = false;  // and not by guided search
  };
  struct InfinitePointsTriangulated {
    std::size_t triangulated = 0;
    int fused = 0;  // with finite points that the map had already
  };
  struct KeyFrameRemoved {
    KeyFrameId keyframe = kNoId;
  };
  struct GloballyAdjusted {
    BundleSummary summary;
  };
  struct LoopClosed {
    ClosedLoop loop;
  };
  // Mapper::Lenses changed.
  struct LensesEstimated {};
  // The map contradicts a given calibration.
  struct CalibrationContradicted {
    CalibrationContradiction contradiction;
  };

  Timestamp time{};
  std::variant<MapStarted, StartFailed, KeyFrameAdded, PanoramaOpened, PanoramaKeyFrameAdded,
               KeyFrameLocalized, InfinitePointsTriangulated, KeyFrameRemoved, GloballyAdjusted, LoopClosed,
               LensesEstimated, CalibrationContradicted>
      what;
};

}  // namespace docent::engine
