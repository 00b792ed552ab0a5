// SPDX-License-Identifier: Apache-2.0
#include "app/simulator/frame_drops.h"

#include "engine/base/random.h"

namespace docent::app {

std::vector<int> KeptFrames(int count, double dropped_share, std::uint64_t seed) {
  constexpr int kShortest = 3, kLongest = 10;
  constexpr double kMeanBurst = 0.5 * (kShortest + kLongest);
  // Each step keeps one frame, loses one (probability x), or loses a burst (probability x / kMeanBurst), so
  // that single losses and bursts lose equally many. Of the 1 + x - x / kMeanBurst frames of a mean step, 2 x
  // are lost, which gives x for the wanted ratio.
  const double single = dropped_share / (2 - dropped_share + dropped_share / kMeanBurst);
  const double burst = single / kMeanBurst;
  Random random(seed);
  std::vector<int> kept;
  for (int frame = 0; frame < count;) {
    const double choice = dropped_share > 0 && frame > 0 ? random.Uniform() : 1;
    if (choice < single) {
      ++frame;
    } else if (choice < single + burst) {
      frame += kShortest + static_cast<int>(random.Below(kLongest - kShortest + 1));
    } else {
      kept.push_back(frame++);
    }
  }
  return kept;
}

}  // namespace docent::app
