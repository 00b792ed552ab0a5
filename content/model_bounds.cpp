// SPDX-License-Identifier: Apache-2.0
#include "content/model_bounds.h"

#include <cmath>
#include <limits>

namespace docent::content {

// The node of a skinned mesh does not move it (§3.7.3.3).
const std::vector<glm::mat4>& JointMatrices::Of(const Node& node) {
  if (node.skin < 0) return none_;
  const auto index = static_cast<std::size_t>(node.skin);
  const Skin& skin = model_.skins[index];
  std::vector<glm::mat4>& matrices = by_skin_[index];
  if (!matrices.empty()) return matrices;
  matrices.reserve(skin.joints.size());
  for (std::size_t i = 0; i < skin.joints.size(); ++i) {
    matrices.push_back(nodes_[static_cast<std::size_t>(skin.joints[i])] * skin.inverse_bind[i]);
  }
  return matrices;
}

glm::mat4 RestMatrix(const Vertex& vertex, const std::vector<glm::mat4>& joints, const glm::mat4& node) {
  if (joints.empty() || vertex.weights == glm::vec4(0)) return node;
  glm::mat4 sum(0);
  for (int k = 0; k < 4; ++k) {
    if (vertex.weights[k] > 0) sum += vertex.weights[k] * joints[vertex.joints[k]];
  }
  return sum;
}

std::optional<std::pair<glm::vec3, glm::vec3>> RestBounds(const Model& model) {
  const std::vector<glm::mat4> nodes = NodeMatrices(model, -1, 0);
  JointMatrices skins(model, nodes);
  glm::vec3 least(std::numeric_limits<float>::max()), most(std::numeric_limits<float>::lowest());
  bool any = false;
  for (std::size_t i = 0; i < model.nodes.size(); ++i) {
    const Node& node = model.nodes[i];
    if (node.mesh < 0) continue;
    const std::vector<glm::mat4>& joints = skins.Of(node);
    for (const Primitive& primitive : model.meshes[static_cast<std::size_t>(node.mesh)].primitives) {
      for (const Vertex& vertex : primitive.vertices) {
        const glm::vec3 position(RestMatrix(vertex, joints, nodes[i]) * glm::vec4(vertex.position, 1));
        if (!std::isfinite(position.x) || !std::isfinite(position.y) || !std::isfinite(position.z)) {
          return std::nullopt;
        }
        least = glm::min(least, position);
        most = glm::max(most, position);
        any = true;
      }
    }
  }
  if (!any) return std::pair(glm::vec3(0), glm::vec3(0));
  return std::pair(least, most);
}

}  // namespace docent::content
