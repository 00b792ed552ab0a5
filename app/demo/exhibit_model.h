// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

namespace docent::app {

// A small model made on the spot: an obelisk of striped stone on a stepped pedestal, one metre high, its foot
// at the origin, y up. The bytes are a self-contained GLB with an embedded PNG texture: what a person would
// bring from a modelling program, so that the demonstration takes the same way.
std::vector<std::uint8_t> MakeExhibitGlb();

}  // namespace docent::app
