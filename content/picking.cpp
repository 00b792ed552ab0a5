// SPDX-License-Identifier: Apache-2.0
#include "content/picking.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "content/model_bounds.h"

namespace docent::content {
namespace {

Eigen::Vector3d VectorFrom(const glm::vec3& v) {
  return {v.x, v.y, v.z};
}

Eigen::Vector3d Transformed(const glm::mat4& matrix, const glm::vec3& v) {
  return VectorFrom(glm::vec3(matrix * glm::vec4(v, 1.0f)));
}

// Keeps distances: a point at a distance along the result is the transformed point at that distance.
Ray RayInModel(const Ray& ray, const engine::Sim3& map_from_model) {
  const engine::Sim3 model_from_map = map_from_model.inverse();
  return {model_from_map * ray.origin, model_from_map.scale * (model_from_map.rotation * ray.direction)};
}

// The positions of a primitive's vertices in model axes. `joints`: of the skin of its node, if it has one.
std::vector<Eigen::Vector3d> PlacedVertices(const Primitive& primitive, const glm::mat4& model_from_node,
                                            const std::vector<glm::mat4>& joints) {
  std::vector<Eigen::Vector3d> places;
  places.reserve(primitive.vertices.size());
  for (const Vertex& vertex : primitive.vertices) {
    if (joints.empty() || vertex.weights == glm::vec4(0)) {
      places.push_back(Transformed(model_from_node, vertex.position));
      continue;
    }
    // A skinned mesh is not moved by its own node (glTF 2.0 §3.7.3.3).
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (int k = 0; k < 4; ++k) {
      if (vertex.weights[k] > 0 && vertex.joints[k] < joints.size())
        sum +=
            static_cast<double>(vertex.weights[k]) * Transformed(joints[vertex.joints[k]], vertex.position);
    }
    places.push_back(sum);
  }
  return places;
}

EntityShape AssetShape(const Entity& entity) {
  if (!HasModel(entity) || !entity.model.asset) return {};
  return {entity.model.asset->model, entity.model.map_from_model};
}

}  // namespace

std::optional<double> IntersectBox(const Ray& ray, const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  double enter = 0, leave = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    const double from = ray.origin[axis], along = ray.direction[axis];
    if (along == 0) {
      if (from < low[axis] || from > high[axis]) return std::nullopt;
      continue;
    }
    const double first = (low[axis] - from) / along, second = (high[axis] - from) / along;
    enter = std::max(enter, std::min(first, second));
    leave = std::min(leave, std::max(first, second));
  }
  if (!(enter <= leave)) return std::nullopt;
  return enter;
}

// Solves origin + t direction = a + u (b - a) + v (c - a) by Cramer's rule.
std::optional<double> IntersectTriangle(const Ray& ray, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                        const Eigen::Vector3d& c) {
  const Eigen::Vector3d along = b - a, across = c - a, offset = ray.origin - a;
  const Eigen::Vector3d normal = along.cross(across);
  const double determinant = -ray.direction.dot(normal);
  if (!(std::abs(determinant) > 1e-12 * ray.direction.norm() * normal.norm())) return std::nullopt;
  const Eigen::Vector3d side = offset.cross(ray.direction);
  const double u = across.dot(side) / determinant, v = -along.dot(side) / determinant;
  const double distance = offset.dot(normal) / determinant;
  if (u < 0 || v < 0 || u + v > 1 || !(distance >= 0)) return std::nullopt;
  return distance;
}

std::optional<double> IntersectModel(const Ray& ray_in_map, const Model& model,
                                     const engine::Sim3& map_from_model, int animation, double seconds) {
  const Ray ray = RayInModel(ray_in_map, map_from_model);
  const bool moves = animation >= 0 && animation < static_cast<int>(model.animations.size());
  // The box is that of the rest pose.
  if (!moves && !IntersectBox(ray, VectorFrom(model.bounds_min), VectorFrom(model.bounds_max)))
    return std::nullopt;
  const std::vector<glm::mat4> nodes = NodeMatrices(model, moves ? animation : -1, seconds);
  JointMatrices skins(model, nodes);
  std::optional<double> nearest;
  std::vector<int> open(model.roots.begin(), model.roots.end());
  while (!open.empty()) {
    const auto index = static_cast<std::size_t>(open.back());
    open.pop_back();
    const Node& node = model.nodes[index];
    open.insert(open.end(), node.children.begin(), node.children.end());
    if (node.mesh < 0) continue;
    for (const Primitive& primitive : model.meshes[static_cast<std::size_t>(node.mesh)].primitives) {
      const auto places = PlacedVertices(primitive, nodes[index], skins.Of(node));
      for (std::size_t i = 0; i + 2 < primitive.indices.size(); i += 3) {
        const auto distance =
            IntersectTriangle(ray, places[primitive.indices[i]], places[primitive.indices[i + 1]],
                              places[primitive.indices[i + 2]]);
        if (distance && (!nearest || *distance < *nearest)) nearest = distance;
      }
    }
  }
  return nearest;
}

std::optional<Pick> PickEntity(const Ray& ray, const Scene& scene, const PickOptions& options) {
  std::optional<Pick> nearest;
  for (std::size_t i = 0; i < scene.entities.size(); ++i) {
    const Entity& entity = scene.entities[i];
    const EntityShape shape = options.shape ? options.shape(entity, ray.origin) : AssetShape(entity);
    if (!shape.model) continue;
    const int animation = entity.kind == Entity::Kind::kModel ? entity.model.animation : -1;
    const auto distance = IntersectModel(ray, *shape.model, shape.map_from_model, animation, options.seconds);
    if (distance && (!nearest || *distance < nearest->distance)) nearest = Pick{i, *distance};
  }
  return nearest;
}

}  // namespace docent::content
