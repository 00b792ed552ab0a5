// SPDX-License-Identifier: Apache-2.0
#include "content/gltf/nodes.h"

#include <algorithm>
#include <cmath>

#include "content/gltf/json.h"
#include "content/mesh_tools.h"

namespace docent::content {
namespace {

std::vector<int> Parents(const tinygltf::Model& source) {
  std::vector<int> parents(source.nodes.size(), -1);
  for (std::size_t i = 0; i < source.nodes.size(); ++i) {
    for (const int child : source.nodes[i].children)
      parents[static_cast<std::size_t>(child)] = static_cast<int>(i);
  }
  return parents;
}

// The file's nodes ordered so that parents precede children.
std::vector<int> TopDown(const tinygltf::Model& source, const std::vector<int>& parents) {
  std::vector<int> order;
  order.reserve(source.nodes.size());
  for (std::size_t i = 0; i < parents.size(); ++i) {
    if (parents[i] < 0) order.push_back(static_cast<int>(i));
  }
  for (std::size_t next = 0; next < order.size(); ++next) {
    const std::vector<int>& children = source.nodes[static_cast<std::size_t>(order[next])].children;
    order.insert(order.end(), children.begin(), children.end());
  }
  return order;
}

glm::quat UnitQuaternion(const glm::dquat& q) {
  const double length = std::sqrt(glm::dot(q, q));
  return length > 0 && std::isfinite(length) ? glm::quat(q / length) : glm::quat(1, 0, 0, 0);
}

Node ReadNode(const tinygltf::Node& source, std::vector<std::string>* warnings) {
  Node node;
  node.name = source.name;
  node.mesh = source.mesh;
  node.skin = source.skin;
  if (source.matrix.size() == 16) {
    glm::dmat4 matrix;
    for (int i = 0; i < 16; ++i) matrix[i / 4][i % 4] = source.matrix[static_cast<std::size_t>(i)];
    const std::string warning = "A node's matrix contains a shear, which is left out.";
    if (!Decompose(matrix, &node) &&
        std::find(warnings->begin(), warnings->end(), warning) == warnings->end()) {
      warnings->push_back(warning);
    }
    return node;
  }
  for (int k = 0; k < 3; ++k) {
    const auto at = static_cast<std::size_t>(k);
    if (source.translation.size() == 3) node.translation[k] = static_cast<float>(source.translation[at]);
    if (source.scale.size() == 3) node.scale[k] = static_cast<float>(source.scale[at]);
  }
  const std::vector<double>& q = source.rotation;
  if (q.size() == 4) node.rotation = UnitQuaternion(glm::dquat(q[3], q[0], q[1], q[2]));
  return node;
}

std::vector<int> SceneRoots(const tinygltf::Model& source, const std::vector<int>& parents) {
  std::vector<int> roots;
  if (!source.scenes.empty()) {
    const std::vector<int>& listed =
        source.scenes[static_cast<std::size_t>(std::max(source.defaultScene, 0))].nodes;
    std::vector<bool> is_listed(parents.size(), false);
    for (const int node : listed) is_listed[static_cast<std::size_t>(node)] = true;
    // Some exporters list every node. A node below another listed one is shown with it and is no root. The
    // search for an ancestor stops at the first listed one, so that a long chain of listed nodes costs one
    // step per node.
    for (const int node : listed) {
      int above = parents[static_cast<std::size_t>(node)];
      while (above >= 0 && !is_listed[static_cast<std::size_t>(above)])
        above = parents[static_cast<std::size_t>(above)];
      if (above < 0) roots.push_back(node);
    }
    return roots;
  }
  for (std::size_t i = 0; i < parents.size(); ++i) {
    if (parents[i] < 0) roots.push_back(static_cast<int>(i));
  }
  return roots;
}

// Removes the meshes of all nodes that no root of the scene reaches.
void HideUnreachable(Model* model) {
  std::vector<bool> shown(model->nodes.size(), false);
  for (const int root : model->roots) shown[static_cast<std::size_t>(root)] = true;
  for (std::size_t i = 0; i < model->nodes.size(); ++i) {
    Node& node = model->nodes[i];
    if (node.parent >= 0 && shown[static_cast<std::size_t>(node.parent)]) shown[i] = true;
    if (!shown[i]) node.mesh = node.skin = -1;
  }
}

// A bind pose is an affine transform, so that the last row of its matrix is 0 0 0 1 (§3.7.3.1).
bool MakeAffine(glm::mat4* matrix) {
  const glm::vec4 row((*matrix)[0][3], (*matrix)[1][3], (*matrix)[2][3], (*matrix)[3][3]);
  const glm::vec4 expected(0, 0, 0, 1);
  for (int k = 0; k < 4; ++k) (*matrix)[k][3] = expected[k];
  return row == expected;
}

void ReadSkins(const tinygltf::Model& source, const std::vector<int>& place_of, AccessorCache* accessors,
               Model* model) {
  bool affine = true;
  for (const tinygltf::Skin& from : source.skins) {
    Skin skin;
    for (const int joint : from.joints) skin.joints.push_back(place_of[static_cast<std::size_t>(joint)]);
    skin.inverse_bind.resize(skin.joints.size(), glm::mat4(1));
    if (from.inverseBindMatrices >= 0) {
      const AccessorReader& matrices = accessors->Get(from.inverseBindMatrices);
      for (std::size_t i = 0; i < skin.joints.size(); ++i) {
        for (int k = 0; k < 16; ++k) skin.inverse_bind[i][k / 4][k % 4] = matrices.Float(i, k);
        affine = MakeAffine(&skin.inverse_bind[i]) && affine;
      }
    }
    model->skins.push_back(std::move(skin));
  }
  if (!affine) {
    model->warnings.emplace_back(
        "The last row of an inverse bind matrix is not 0 0 0 1, and is replaced by it.");
  }
}

}  // namespace

bool Decompose(const glm::dmat4& matrix, Node* node) {
  node->translation = glm::vec3(matrix[3]);
  glm::dmat3 axes(matrix);
  glm::dvec3 scale(glm::length(axes[0]), glm::length(axes[1]), glm::length(axes[2]));
  if (glm::determinant(axes) < 0) scale.x = -scale.x;
  node->scale = glm::vec3(scale);
  if (scale.x == 0 || scale.y == 0 || scale.z == 0) {
    node->rotation = glm::quat(1, 0, 0, 0);
    return true;
  }
  for (int k = 0; k < 3; ++k) axes[k] /= scale[k];
  const double shear = std::max({std::abs(glm::dot(axes[0], axes[1])), std::abs(glm::dot(axes[1], axes[2])),
                                 std::abs(glm::dot(axes[0], axes[2]))});
  if (shear > 1e-3) {
    // The nearest orthonormal frame with the same third axis (Gram-Schmidt).
    axes[1] = glm::dvec3(UnitOr(axes[1] - axes[2] * glm::dot(axes[1], axes[2]), glm::vec3(0, 1, 0)));
    axes[0] = glm::cross(axes[1], axes[2]);
  }
  node->rotation = UnitQuaternion(glm::quat_cast(axes));
  return shear <= 1e-3;
}

std::vector<int> ReadNodes(const tinygltf::Model& source, AccessorCache* accessors, Model* model) {
  const std::vector<int> parents = Parents(source);
  const std::vector<int> order = TopDown(source, parents);
  std::vector<int> place_of(order.size(), -1);
  for (std::size_t i = 0; i < order.size(); ++i)
    place_of[static_cast<std::size_t>(order[i])] = static_cast<int>(i);
  for (const int number : order) {
    const auto at = static_cast<std::size_t>(number);
    Node node = ReadNode(source.nodes[at], &model->warnings);
    if (parents[at] >= 0) node.parent = place_of[static_cast<std::size_t>(parents[at])];
    for (const int child : source.nodes[at].children) {
      node.children.push_back(place_of[static_cast<std::size_t>(child)]);
    }
    model->nodes.push_back(std::move(node));
  }
  for (const int root : SceneRoots(source, parents))
    model->roots.push_back(place_of[static_cast<std::size_t>(root)]);
  HideUnreachable(model);
  ReadSkins(source, place_of, accessors, model);
  return place_of;
}

}  // namespace docent::content
