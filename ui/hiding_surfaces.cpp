// SPDX-License-Identifier: Apache-2.0
#include "ui/hiding_surfaces.h"

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <utility>

#include "content/occluder.h"

namespace docent::ui {
namespace {

bool HidesContent(const content::Entity& entity) {
  return entity.kind == content::Entity::Kind::kOccluder && !entity.hidden;
}

std::shared_ptr<const engine::SurfaceMesh> PlacedMesh(const content::Scene& scene) {
  auto placed = std::make_shared<engine::SurfaceMesh>();
  for (const content::Entity& entity : scene.entities) {
    if (!HidesContent(entity)) continue;
    const content::OccluderMesh mesh = content::MeshOf(entity.occluder);
    const auto first = static_cast<std::uint32_t>(placed->vertices.size());
    for (const Eigen::Vector3d& vertex : mesh.vertices)
      placed->vertices.emplace_back((entity.occluder.map_from_shape * vertex).cast<float>());
    for (const auto& [a, b, c] : mesh.triangles)
      placed->triangles.push_back({first + a, first + b, first + c});
  }
  return placed;
}

// Without the triangles that occluders stand for.
std::shared_ptr<const engine::SurfaceMesh> WithoutReplaced(const engine::SurfaceMesh& measured,
                                                           const content::Scene& scene) {
  std::vector<char> is_replaced(measured.vertices.size(), 0);
  for (const content::Entity& entity : scene.entities) {
    if (!HidesContent(entity)) continue;
    for (std::size_t i = 0; i < is_replaced.size(); ++i) {
      if (is_replaced[i] == 0)
        is_replaced[i] = content::StandsFor(entity.occluder, measured.vertices[i].cast<double>()) ? 1 : 0;
    }
  }
  auto rest = std::make_shared<engine::SurfaceMesh>();
  rest->vertices = measured.vertices;
  std::copy_if(measured.triangles.begin(), measured.triangles.end(), std::back_inserter(rest->triangles),
               [&](const auto& triangle) {
                 return std::any_of(triangle.begin(), triangle.end(),
                                    [&](std::uint32_t vertex) { return is_replaced[vertex] == 0; });
               });
  return rest;
}

}  // namespace

void HidingSurfaces::WriteKey(const content::Scene& scene, bool occluders, std::vector<double>* key) const {
  key->clear();
  if (!occluders) return;
  for (const content::Entity& entity : scene.entities) {
    if (!HidesContent(entity)) continue;
    const content::Occluder& occluder = entity.occluder;
    const engine::Sim3& pose = occluder.map_from_shape;
    key->push_back(static_cast<double>(occluder.shape));
    key->push_back(static_cast<double>(occluder.outline.size()));
    for (const double number : pose.rotation.quaternion().coeffs()) key->push_back(number);
    for (const double number : pose.translation) key->push_back(number);
    key->push_back(pose.scale);
    for (const double number : occluder.size) key->push_back(number);
    for (const Eigen::Vector2d& point : occluder.outline) {
      key->push_back(point.x());
      key->push_back(point.y());
    }
  }
}

const HidingSurfaces::Surfaces& HidingSurfaces::Of(
    const content::Scene& scene, bool occluders, const std::shared_ptr<const engine::SurfaceMesh>& measured) {
  WriteKey(scene, occluders, &next_key_);
  const bool same_occluders = next_key_ == key_;
  if (same_occluders && measured == measured_) return surfaces_;
  std::swap(key_, next_key_);
  measured_ = measured;
  if (!same_occluders) surfaces_.placed = key_.empty() ? nullptr : PlacedMesh(scene);
  surfaces_.measured = key_.empty() || measured == nullptr ? measured : WithoutReplaced(*measured, scene);
  return surfaces_;
}

}  // namespace docent::ui
