// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "content/scene.h"

// The geometry of occluders (Occluder in scene.h). Pure functions; thread-safe.
namespace docent::content {

// Triangles that can be seen from both sides.
struct OccluderMesh {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

// "plane", "box", "cylinder" or "polygon".
const char* NameOf(Occluder::Shape shape);

// The surface of an occluder in its own axes and unit.
OccluderMesh MeshOf(const Occluder& occluder);

// A polygon through points of the map, in their order; it lies in the plane that fits them best. Throws Error
// when they enclose no area, their outline crosses itself, or there are too few or too many.
Occluder PolygonThrough(std::span<const Eigen::Vector3d> points_in_map);

// What is wrong with the shape, as the end of a sentence ("would have ..."); empty if nothing is. Its pose is
// left to PoseProblem.
std::string ShapeProblem(const Occluder& occluder);

// Whether a surface that was measured at this point of the map is the one that the occluder stands for: it is
// in the shape, or no farther from it than a measured surface may be.
bool StandsFor(const Occluder& occluder, const Eigen::Vector3d& point_in_map);

}  // namespace docent::content
