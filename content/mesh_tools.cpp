// SPDX-License-Identifier: Apache-2.0
#include "content/mesh_tools.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace docent::content {
namespace {

// Twice the triangle's area times its unit normal.
glm::dvec3 AreaNormal(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c) {
  return glm::cross(glm::dvec3(b) - glm::dvec3(a), glm::dvec3(c) - glm::dvec3(a));
}

// An arbitrary unit vector orthogonal to a unit vector.
glm::vec3 AnyOrthogonal(const glm::vec3& n) {
  const glm::vec3 other = std::abs(n.x) < 0.9f ? glm::vec3(1, 0, 0) : glm::vec3(0, 1, 0);
  return UnitOr(glm::cross(glm::dvec3(other), glm::dvec3(n)), glm::vec3(1, 0, 0));
}

}  // namespace

glm::vec3 UnitOr(const glm::dvec3& v, const glm::vec3& fallback) {
  const double largest = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
  if (!(largest > 0) || !std::isfinite(largest)) return fallback;
  const glm::dvec3 scaled = v / largest;
  return glm::vec3(scaled / glm::length(scaled));
}

void MakeFlat(Primitive* primitive) {
  std::vector<Vertex> vertices;
  vertices.reserve(primitive->indices.size());
  for (std::size_t i = 0; i + 2 < primitive->indices.size(); i += 3) {
    Vertex corners[3];
    for (std::size_t k = 0; k < 3; ++k) corners[k] = primitive->vertices[primitive->indices[i + k]];
    const glm::vec3 normal =
        UnitOr(AreaNormal(corners[0].position, corners[1].position, corners[2].position), glm::vec3(0, 1, 0));
    for (std::size_t k = 0; k < 3; ++k) {
      corners[k].normal = normal;
      primitive->indices[i + k] = static_cast<std::uint32_t>(vertices.size());
      vertices.push_back(corners[k]);
    }
  }
  primitive->vertices = std::move(vertices);
}

void RepairNormals(Primitive* primitive) {
  std::vector<glm::dvec3> sums(primitive->vertices.size(), glm::dvec3(0));
  for (std::size_t i = 0; i + 2 < primitive->indices.size(); i += 3) {
    const std::uint32_t* corner = &primitive->indices[i];
    const glm::dvec3 normal =
        AreaNormal(primitive->vertices[corner[0]].position, primitive->vertices[corner[1]].position,
                   primitive->vertices[corner[2]].position);
    for (int k = 0; k < 3; ++k) sums[corner[k]] += normal;
  }
  for (std::size_t i = 0; i < sums.size(); ++i) {
    Vertex& vertex = primitive->vertices[i];
    vertex.normal = UnitOr(vertex.normal, UnitOr(sums[i], glm::vec3(0, 1, 0)));
  }
}

void ComputeTangents(int uv_set, Primitive* primitive) {
  std::vector<glm::dvec3> u_directions(primitive->vertices.size(), glm::dvec3(0));
  std::vector<glm::dvec3> v_directions(primitive->vertices.size(), glm::dvec3(0));
  const auto uv = [&](std::uint32_t vertex) {
    return glm::dvec2(uv_set == 0 ? primitive->vertices[vertex].uv0 : primitive->vertices[vertex].uv1);
  };
  for (std::size_t i = 0; i + 2 < primitive->indices.size(); i += 3) {
    const std::uint32_t* corner = &primitive->indices[i];
    const glm::dvec3 origin(primitive->vertices[corner[0]].position);
    const glm::dvec3 edge1 = glm::dvec3(primitive->vertices[corner[1]].position) - origin;
    const glm::dvec3 edge2 = glm::dvec3(primitive->vertices[corner[2]].position) - origin;
    const glm::dvec2 step1 = uv(corner[1]) - uv(corner[0]), step2 = uv(corner[2]) - uv(corner[0]);
    const double determinant = step1.x * step2.y - step1.y * step2.x;
    if (!std::isfinite(determinant) || determinant == 0) continue;
    // Only the sign of the determinant is needed: the directions are normalized at the end, and large
    // triangles get more weight.
    const double sign = determinant > 0 ? 1 : -1;
    const glm::dvec3 along_u = sign * (edge1 * step2.y - edge2 * step1.y);
    const glm::dvec3 along_v = sign * (edge2 * step1.x - edge1 * step2.x);
    for (int k = 0; k < 3; ++k) {
      u_directions[corner[k]] += along_u;
      v_directions[corner[k]] += along_v;
    }
  }
  for (std::size_t i = 0; i < primitive->vertices.size(); ++i) {
    Vertex& vertex = primitive->vertices[i];
    const glm::dvec3 normal(vertex.normal);
    const glm::dvec3 along_u(UnitOr(u_directions[i], AnyOrthogonal(vertex.normal)));
    const glm::vec3 tangent =
        UnitOr(along_u - normal * glm::dot(normal, along_u), AnyOrthogonal(vertex.normal));
    const glm::dvec3 along_v(UnitOr(v_directions[i], glm::vec3(0)));
    const bool mirrored = glm::dot(glm::cross(normal, glm::dvec3(tangent)), along_v) < 0;
    vertex.tangent = glm::vec4(tangent, mirrored ? -1.0f : 1.0f);
  }
}

}  // namespace docent::content
