// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "content/model.h"

// Fills in what a file left out of its triangles. Pure functions on plain data; indices are in range.
namespace docent::content {

// `v` with length 1, or `fallback` where it has no direction. Works in double, so that no finite float
// overflows.
glm::vec3 UnitOr(const glm::dvec3& v, const glm::vec3& fallback);

// A vertex of its own for each corner, with the normal of its triangle (what glTF 2.0 §3.7.2.1 asks for when
// normals are missing).
void MakeFlat(Primitive* primitive);

// Normals of length zero are replaced by the mean of the triangles around the vertex, weighted by area; the
// others are brought to unit length.
void RepairNormals(Primitive* primitive);

// Tangents from positions, normals and one set of texture coordinates: the direction in which u grows, made
// orthogonal to the normal, with the handedness in w (Lengyel, "Foundations of Game Engine Development 2",
// §7.5).
void ComputeTangents(int uv_set, Primitive* primitive);

}  // namespace docent::content
