// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "engine/geometry/rigid3.h"

namespace docent::app {

// The chordal mean of rotations (Hartley et al., "Rotation Averaging", 2013, section 5.3). `rotations` is not
// empty.
engine::Rotation3 MeanRotation(const std::vector<engine::Rotation3>& rotations);

}  // namespace docent::app
