// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

namespace docent::app {

// Returns the indices of the frames out of `count` that are not lost, in order. Half of the lost frames are
// lost singly and half in bursts of three to ten, as on a busy machine. The first frame is always kept. The
// ratio of lost frames holds on average over long sequences.
std::vector<int> KeptFrames(int count, double dropped_share, std::uint64_t seed);

}  // namespace docent::app
