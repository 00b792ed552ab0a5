// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "content/scene.h"

namespace docent::app {

// Lets the animation of a model begin when a visitor comes near it, where it is seen from its beginning. It
// goes on until the visitor has gone away, and begins anew when they come back. Times are seconds that do not
// decrease. One thread.
class ApproachWatch {
 public:
  // When the animation of each model has begun, by the name of its entity; those of the others have not.
  using Starts = std::map<std::string, double>;

  // A frame whose camera is at this place in the map with this key; without a place, nothing changes. The
  // result is never null.
  std::shared_ptr<const Starts> Update(double seconds, std::uint64_t map_key, const content::Scene& scene,
                                       const std::optional<Eigen::Vector3d>& camera_in_map);

 private:
  std::uint64_t map_key_ = 0;
  std::shared_ptr<const Starts> starts_ = std::make_shared<Starts>();
};

}  // namespace docent::app
