// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "app/simulator/texture.h"

// What a simulated world is made of: textured rectangles, and helpers that build boxes and round columns of
// them. World frame x right, y down, z forward, metres; the floor is the plane y = 0, so things stand at
// negative y.
namespace docent::app {

// The part of a texture that a rectangle shows, in units of the whole texture; beyond 1 a repeating one
// repeats.
struct TextureWindow {
  double left = 0, top = 0, right = 1, bottom = 1;
};

// A flat rectangle { center + u half_u + v half_v : |u|, |v| <= 1 }, seen from both sides. half_u points
// along the texture's rows (to the right), half_v along its columns (down); the two are perpendicular.
struct Rectangle {
  Eigen::Vector3d center, half_u, half_v;
  int texture = 0;
  TextureWindow window;
  // Light that falls on it, 1 = as painted: light + light_u u + light_v v.
  float light = 1, light_u = 0, light_v = 0;
};

// Where a ray meets the surfaces.
struct SurfaceHit {
  Eigen::Vector3d point;
  double distance = 0;  // metres along the unit ray
  int rectangle = -1;
};

// Rectangles and their textures. Built by one thread, then only read.
class Surfaces {
 public:
  int AddTexture(const cv::Mat& bgr, bool repeat = false);
  // A rectangle from its top-left corner and its whole sides.
  Rectangle& AddRectangle(const Eigen::Vector3d& top_left, const Eigen::Vector3d& right,
                          const Eigen::Vector3d& down, int texture, const TextureWindow& window = {});
  // An upright box that stands on y = base: footprint width (along its own x) times depth (its own z), turned
  // by yaw about the vertical. Sides show the texture's left, middle and right thirds in turn, the lid a
  // square of it. `front`, when not negative, is shown on the side that looks along -z before the turn.
  void AddBox(const Eigen::Vector3d& base_center, double width, double height, double depth, double yaw_rad,
              int texture, int front = -1);
  // An upright prism of many sides with the texture wrapped once around it: a column, a vase, a mug.
  void AddColumn(const Eigen::Vector3d& base_center, double radius, double height, int sides, int texture,
                 const TextureWindow& window = {});

  // The nearest surface along a ray (direction of unit length), found by trying every one, in double.
  std::optional<SurfaceHit> Intersect(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;

  const std::vector<Rectangle>& rectangles() const { return rectangles_; }
  const std::vector<Texture>& textures() const { return textures_; }

 private:
  std::vector<Rectangle> rectangles_;
  std::vector<Texture> textures_;
};

}  // namespace docent::app
