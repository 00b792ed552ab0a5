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

// The matrices model_from_vertex of the joints of a model's skins, for the matrices of its nodes
// (NodeMatrices). Those of a skin are computed once, however many nodes it is used by. Both arguments must
// outlive this. One thread.
class JointMatrices {
 public:
  JointMatrices(const Model& model, const std::vector<glm::mat4>& nodes)
      : model_(model), nodes_(nodes), by_skin_(model.skins.size()) {}

  // Of the skin of a node; empty without one.
  const std::vector<glm::mat4>& Of(const Node& node);

 private:
  const Model& model_;
  const std::vector<glm::mat4>& nodes_;
  std::vector<std::vector<glm::mat4>> by_skin_;  // Empty until they are asked for.
  const std::vector<glm::mat4> none_;
};

// The matrix that takes a vertex of a node's mesh to the model: that of its joints, if it has any, else that
// of the node.
glm::mat4 RestMatrix(const Vertex& vertex, const std::vector<glm::mat4>& joints, const glm::mat4& node);

}  // namespace docent::content
