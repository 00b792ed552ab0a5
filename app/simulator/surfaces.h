// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "app/simulator/texture.h"

// The geometry of a simulated world: textured rectangles, and functions that build boxes and columns of them.
// World frame: x right, y down, z forward, metres. The floor is the plane y = 0, so objects have negative y.
namespace docent::app {

// The part of a texture that a rectangle shows, in units of the texture's size; repeating textures may
// exceed 1.
struct TextureWindow {
  double left = 0, top = 0, right = 1, bottom = 1;
};

// A planar rectangle { center + u half_u + v half_v : |u|, |v| <= 1 }, visible from both sides. half_u is
// along the texture's rows (to the right), half_v along its columns (down); they are perpendicular.
struct Rectangle {
  Eigen::Vector3d center, half_u, half_v;
  int texture = 0;
  TextureWindow window;
  // Brightness factor of the texture: light + light_u u + light_v v.
  float light = 1, light_u = 0, light_v = 0;
};

// Intersection of a ray with the surfaces.
struct SurfaceHit {
  Eigen::Vector3d point;
  double distance = 0;  // Metres along the unit ray.
  int rectangle = -1;
};

// Rectangles and their textures. Built by one thread, then read by any thread.
class Surfaces {
 public:
  int AddTexture(const cv::Mat& bgr, bool repeat = false);
  // Adds a rectangle given by its top-left corner and its full sides.
  Rectangle& AddRectangle(const Eigen::Vector3d& top_left, const Eigen::Vector3d& right,
                          const Eigen::Vector3d& down, int texture, const TextureWindow& window = {});
  // Adds an upright box with a footprint of width (local x) by depth (local z), rotated by yaw about the
  // vertical. The sides show the left, middle and right third of the texture in turn, the top shows a square
  // of it. `front`, if not negative, is the texture of the side that faces -z before the rotation.
  void AddBox(const Eigen::Vector3d& base_center, double width, double height, double depth, double yaw_rad,
              int texture, int front = -1);
  // Adds an upright prism with many sides and the texture wrapped once around it: a column, a vase, a mug.
  void AddColumn(const Eigen::Vector3d& base_center, double radius, double height, int sides, int texture,
                 const TextureWindow& window = {});

  // The nearest surface along a ray (direction of unit length), by testing all rectangles in double
  // precision.
  std::optional<SurfaceHit> Intersect(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;

  const std::vector<Rectangle>& rectangles() const { return rectangles_; }
  const std::vector<Texture>& textures() const { return textures_; }

 private:
  std::vector<Rectangle> rectangles_;
  std::vector<Texture> textures_;
};

}  // namespace docent::app
