// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "content/model.h"

namespace docent::content {

// The bounding box of everything that the model shows in its rest pose, including skins, in model axes. Both
// corners are zero when it shows nothing. Empty when a vertex is outside the range of float.
std::optional<std::pair<glm::vec3, glm::vec3>> RestBounds(const Model& model);

// The matrices model_from_vertex of the joints of a skin, for the matrices of the model's nodes
// (NodeMatrices).
std::vector<glm::mat4> JointMatrices(const Skin& skin, const std::vector<glm::mat4>& nodes);

// The matrix that takes a vertex of a node's mesh to the model: that of its joints, if it has any, else that
// of the node.
glm::mat4 RestMatrix(const Vertex& vertex, const std::vector<glm::mat4>& joints, const glm::mat4& node);

}  // namespace docent::content
