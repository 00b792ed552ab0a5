// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "content/model.h"

// Computes vertex data that is missing in a file. Pure functions; indices must be in range.
namespace docent::content {

// Returns `v` normalized, or `fallback` if it is zero or not finite. Uses double, so that no finite float
// overflows.
glm::vec3 UnitOr(const glm::dvec3& v, const glm::vec3& fallback);

// Gives each corner its own vertex with the normal of its triangle (required by glTF 2.0 §3.7.2.1 when
// normals are missing).
void MakeFlat(Primitive* primitive);

// Replaces zero normals with the area-weighted mean normal of the adjacent triangles, and normalizes the
// others.
void RepairNormals(Primitive* primitive);

// Computes tangents from positions, normals and one set of texture coordinates: the direction of increasing
// u, orthogonal to the normal, with the handedness in w (Lengyel, "Foundations of Game Engine Development 2",
// §7.5).
void ComputeTangents(int uv_set, Primitive* primitive);

}  // namespace docent::content
