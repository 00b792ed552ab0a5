// SPDX-License-Identifier: Apache-2.0
#include "app/evaluation/simulated_truth.h"

namespace docent::app {

std::vector<TimedPose> GroundTruthOf(const Simulation& simulation) {
  std::vector<TimedPose> poses;
  for (int i = 0; i < simulation.frame_count(); ++i) {
    poses.push_back({simulation.time(i), simulation.world_from_camera(i)});
  }
  return poses;
}

std::vector<TimedLabel> SegmentsOf(const Simulation& simulation) {
  std::vector<TimedLabel> labels;
  for (int i = 0; i < simulation.frame_count(); ++i) {
    const std::string& label = simulation.label(i);
    if (labels.empty() || labels.back().label != label) labels.push_back({simulation.time(i), label});
  }
  return labels;
}

}  // namespace docent::app
