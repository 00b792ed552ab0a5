// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <numbers>

namespace docent::app {

// Turns degrees into radians.
inline constexpr double kRadPerDegree = std::numbers::pi / 180;

}  // namespace docent::app
