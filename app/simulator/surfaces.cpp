// SPDX-License-Identifier: Apache-2.0
#include "app/simulator/surfaces.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

namespace docent::app {
namespace {

// Light from the upper left front: the sides of a box have different brightness, so that its edges are
// visible.
float LightOn(const Eigen::Vector3d& normal) {
  static const Eigen::Vector3d to_light = Eigen::Vector3d(-0.45, -0.8, -0.4).normalized();
  return static_cast<float>(0.78 + 0.24 * normal.dot(to_light));
}

}  // namespace

int Surfaces::AddTexture(const cv::Mat& bgr, bool repeat) {
  textures_.emplace_back(bgr, repeat);
  return static_cast<int>(textures_.size()) - 1;
}

Rectangle& Surfaces::AddRectangle(const Eigen::Vector3d& top_left, const Eigen::Vector3d& right,
                                  const Eigen::Vector3d& down, int texture, const TextureWindow& window) {
  Rectangle rectangle;
  rectangle.center = top_left + 0.5 * right + 0.5 * down;
  rectangle.half_u = 0.5 * right;
  rectangle.half_v = 0.5 * down;
  rectangle.texture = texture;
  rectangle.window = window;
  rectangles_.push_back(rectangle);
  return rectangles_.back();
}

void Surfaces::AddBox(const Eigen::Vector3d& base_center, double width, double height, double depth,
                      double yaw_rad, int texture, int front) {
  const Eigen::Vector3d x(std::cos(yaw_rad), 0, -std::sin(yaw_rad)),
      z(std::sin(yaw_rad), 0, std::cos(yaw_rad));
  const Eigen::Vector3d down(0, height, 0), top = base_center - down;
  const Eigen::Vector3d half_x = 0.5 * width * x, half_z = 0.5 * depth * z;
  struct Side {
    Eigen::Vector3d corner, right, normal;
  };
  const Side sides[4] = {{top - half_x - half_z, 2 * half_x, -z},
                         {top + half_x - half_z, 2 * half_z, x},
                         {top + half_x + half_z, -2 * half_x, z},
                         {top - half_x + half_z, -2 * half_z, -x}};
  for (int i = 0; i < 4; ++i) {
    const bool own_image = i == 0 && front >= 0;
    const double left = (i % 3) / 3.0;
    const TextureWindow window = own_image ? TextureWindow{} : TextureWindow{left, 0, left + 1.0 / 3, 1};
    Rectangle& side =
        AddRectangle(sides[i].corner, sides[i].right, down, own_image ? front : texture, window);
    side.light = LightOn(sides[i].normal);
    side.light_v = -0.06f;  // Darker towards the ground.
  }
  Rectangle& lid =
      AddRectangle(top - half_x + half_z, 2 * half_x, -2 * half_z, texture, {0.1, 0.1, 0.9, 0.9});
  lid.light = LightOn({0, -1, 0});
}

void Surfaces::AddColumn(const Eigen::Vector3d& base_center, double radius, double height, int sides,
                         int texture, const TextureWindow& window) {
  const double step = 2 * std::numbers::pi / sides;
  for (int i = 0; i < sides; ++i) {
    const Eigen::Vector3d a(radius * std::cos(i * step), -height, radius * std::sin(i * step));
    const Eigen::Vector3d b(radius * std::cos((i + 1) * step), -height, radius * std::sin((i + 1) * step));
    const double left = window.left + (window.right - window.left) * i / sides;
    const double right = window.left + (window.right - window.left) * (i + 1) / sides;
    Rectangle& side = AddRectangle(base_center + a, b - a, {0, height, 0}, texture,
                                   {left, window.top, right, window.bottom});
    side.light = LightOn(Eigen::Vector3d(a.x() + b.x(), 0, a.z() + b.z()).normalized());
  }
  // A square inside of the rim closes the top, which a camera above could otherwise see through.
  const double half = radius * std::numbers::sqrt2 / 2;
  Rectangle& lid = AddRectangle(base_center + Eigen::Vector3d(-half, -height, half), {2 * half, 0, 0},
                                {0, 0, -2 * half}, texture, {0.1, 0.1, 0.4, 0.4});
  lid.light = LightOn({0, -1, 0});
}

std::optional<SurfaceHit> Surfaces::Intersect(const Eigen::Vector3d& origin,
                                              const Eigen::Vector3d& direction) const {
  std::optional<SurfaceHit> nearest;
  for (std::size_t i = 0; i < rectangles_.size(); ++i) {
    const Rectangle& rectangle = rectangles_[i];
    const Eigen::Vector3d normal = rectangle.half_u.cross(rectangle.half_v);
    const double denominator = normal.dot(direction);
    if (denominator == 0) continue;
    const double distance = normal.dot(rectangle.center - origin) / denominator;
    if (!(distance > 0) || (nearest && distance >= nearest->distance)) continue;
    const Eigen::Vector3d point = origin + distance * direction;
    const Eigen::Vector3d offset = point - rectangle.center;
    if (std::abs(offset.dot(rectangle.half_u)) > rectangle.half_u.squaredNorm() ||
        std::abs(offset.dot(rectangle.half_v)) > rectangle.half_v.squaredNorm()) {
      continue;
    }
    nearest = SurfaceHit{point, distance, static_cast<int>(i)};
  }
  return nearest;
}

}  // namespace docent::app
