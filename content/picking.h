// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>

#include "content/scene.h"

// Which entity a person points at. Pure functions; thread-safe. Lengths are in map units.
namespace docent::content {

// A half-line in the map. The direction need not have unit length; distances are multiples of it.
struct Ray {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
};

// Where a ray enters a box with these corners, at a distance of 0 or more; 0 inside. Empty beside it.
std::optional<double> IntersectBox(const Ray& ray, const Eigen::Vector3d& low, const Eigen::Vector3d& high);
// Where a ray meets a triangle, from either side. Empty beside it, behind the origin, and for a triangle that
// is seen from its edge.
std::optional<double> IntersectTriangle(const Ray& ray, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                        const Eigen::Vector3d& c);

// The nearest triangle of a model in its pose at this time of this animation (see NodeMatrices), skins
// included.
std::optional<double> IntersectModel(const Ray& ray, const Model& model, const engine::Sim3& map_from_model,
                                     int animation, double seconds);

// What is drawn of an entity: a model and its pose in the map.
struct EntityShape {
  std::shared_ptr<const Model> model;  // Null where nothing is drawn.
  engine::Sim3 map_from_model;
};

// How a scene is drawn, as far as picking depends on it.
struct PickOptions {
  double seconds = 0;  // Time of the animations.
  // The shape of an entity for a reader at `eye`, the ray's origin. Empty: models and images have the shapes
  // of their assets, and all other entities none.
  std::function<EntityShape(const Entity&, const Eigen::Vector3d& eye)> shape;
};

// What a ray hits.
struct Pick {
  std::size_t entity = 0;  // Index into Scene::entities.
  double distance = 0;     // Along the ray.
};
// The nearest entity that the ray hits. Entities whose model is unknown are left out.
std::optional<Pick> PickEntity(const Ray& ray, const Scene& scene, const PickOptions& options);

}  // namespace docent::content
