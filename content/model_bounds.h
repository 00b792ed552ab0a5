// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <utility>

#include "content/model.h"

namespace docent::content {

// Smallest box around everything that the model shows in its rest pose, skins included, in model axes; both
// corners zero when it shows nothing. Empty when a vertex lies beyond what a float holds.
std::optional<std::pair<glm::vec3, glm::vec3>> RestBounds(const Model& model);

}  // namespace docent::content
