// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace docent::engine {

// What is known of the readout time of a rolling shutter before a map tells it, seconds; see ReadoutMotion.
struct ReadoutPrior {
  Eigen::Vector2d readout_s = Eigen::Vector2d::Zero();
  double sigma_s = 0;  // standard deviation of each entry
};

}  // namespace docent::engine
