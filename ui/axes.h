// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <glm/glm.hpp>

#include "engine/geometry/rigid3.h"
#include "engine/geometry/sim3.h"

// The only file that converts between Docent's camera axes (x right, y down, z forward) and OpenGL's eye axes
// (x right, y up, z backward), and between Eigen's and glm's types. Both frames are right-handed, so the
// winding order of triangles is preserved. Lengths are in map units.
namespace docent::ui {

inline glm::vec3 GlmFrom(const Eigen::Vector3d& v) {
  return glm::vec3(v.x(), v.y(), v.z());
}

inline glm::mat4 GlmFrom(const Eigen::Matrix3d& rotation, double scale, const Eigen::Vector3d& translation) {
  glm::mat4 result(1.0f);
  for (int column = 0; column < 3; ++column) {
    for (int row = 0; row < 3; ++row) result[column][row] = static_cast<float>(scale * rotation(row, column));
  }
  result[3] = glm::vec4(GlmFrom(translation), 1.0f);
  return result;
}

inline glm::mat4 GlmFrom(const engine::Sim3& transform) {
  return GlmFrom(transform.rotation.matrix(), transform.scale, transform.translation);
}

// A rotation by 180 degrees about the x axis; it is its own inverse.
inline Eigen::Matrix3d GlEyeFromCamera() {
  return Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
}

// The view matrix: it transforms a point from the map to OpenGL eye coordinates.
inline glm::mat4 GlEyeFromMap(const engine::Rigid3& camera_from_map) {
  return GlmFrom(GlEyeFromCamera() * camera_from_map.rotation.matrix(), 1.0,
                 GlEyeFromCamera() * camera_from_map.translation);
}

// A rectangle of a pinhole camera's image plane z = 1, in camera axes. The values are the tangents of the
// angles from the optical axis to its borders.
struct TangentBounds {
  double left = -1.0, right = 1.0, top = -1.0, bottom = 1.0;  // x right, y down; left < right, top < bottom
};

// Projects from OpenGL eye coordinates to OpenGL clip coordinates for a pinhole camera with these bounds. The
// depth buffer covers depths from near_plane to far_plane (both positive, in map units).
inline glm::mat4 GlClipFromGlEye(const TangentBounds& bounds, double near_plane, double far_plane) {
  const double width = bounds.right - bounds.left, height = bounds.bottom - bounds.top;
  glm::mat4 clip(0.0f);
  clip[0][0] = static_cast<float>(2.0 / width);
  clip[2][0] = static_cast<float>((bounds.right + bounds.left) / width);
  clip[1][1] = static_cast<float>(2.0 / height);
  clip[2][1] = static_cast<float>(-(bounds.top + bounds.bottom) / height);
  clip[2][2] = static_cast<float>(-(far_plane + near_plane) / (far_plane - near_plane));
  clip[2][3] = -1.0f;
  clip[3][2] = static_cast<float>(-2.0 * far_plane * near_plane / (far_plane - near_plane));
  return clip;
}

// The texture coordinates (0..1, OpenGL's origin at the bottom left) of the direction (x, y, 1) in camera
// axes, in a texture that was rendered with GlClipFromGlEye.
inline glm::vec2 GlTextureFromTangent(const TangentBounds& bounds, double x, double y) {
  return glm::vec2((x - bounds.left) / (bounds.right - bounds.left),
                   (bounds.bottom - y) / (bounds.bottom - bounds.top));
}

}  // namespace docent::ui
