// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <utility>

#include "content/model.h"

namespace docent::content {

// The bounding box of everything that the model shows in its rest pose, including skins, in model axes. Both
// corners are zero when it shows nothing. Empty when a vertex is outside the range of float.
std::optional<std::pair<glm::vec3, glm::vec3>> RestBounds(const Model& model);

}  // namespace docent::content
