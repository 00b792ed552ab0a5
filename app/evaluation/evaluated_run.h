// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "app/evaluation/evaluate_run.h"

namespace docent::app {

// A stitched panorama (see PanoramaImage) for the report.
struct ShownPanorama {
  std::string caption;
  std::vector<std::uint8_t> png;
};

// All data that the report shows for one sequence.
struct EvaluatedRun {
  RunRecord run;
  std::vector<TimedPose> truth;      // May be empty.
  std::vector<TimedLabel> segments;  // May be empty.
  SequenceReport report;
  std::vector<ShownPanorama> panoramas = {};
  std::shared_ptr<const EvaluatedRun> compared = nullptr;  // The same sequence with the other engine.
};

}  // namespace docent::app
