// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "app/evaluation/evaluate_run.h"

namespace docent::app {

// A stitched panorama (see PanoramaImage) as the report shows it.
struct ShownPanorama {
  std::string caption;
  std::vector<std::uint8_t> png;
};

// Everything that a report shows of one sequence.
struct EvaluatedRun {
  RunRecord run;
  std::vector<TimedPose> truth;      // may be empty
  std::vector<TimedLabel> segments;  // may be empty
  SequenceReport report;             // of this run
  std::vector<ShownPanorama> panoramas = {};
  std::shared_ptr<const EvaluatedRun> compared = nullptr;  // the same sequence by the other engine
};

}  // namespace docent::app
