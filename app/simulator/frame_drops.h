// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

namespace docent::app {

// Numbers of those of `count` frames that are not lost, in their order. Half of the lost frames are lost one
// by one and half in bursts of three to ten, as when a machine is busy for a moment. The first frame is kept.
// The share holds on average over long sequences.
std::vector<int> KeptFrames(int count, double dropped_share, std::uint64_t seed);

}  // namespace docent::app
