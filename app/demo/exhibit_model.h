// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

namespace docent::app {

// Generates a small model for the demonstration: a striped obelisk on a stepped pedestal, one metre high,
// with its foot at the origin and y up. The result is a self-contained GLB with an embedded PNG texture, so
// that the demonstration loads it like a model exported from a modelling program.
std::vector<std::uint8_t> MakeExhibitGlb();

}  // namespace docent::app
