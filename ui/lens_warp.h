// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "engine/geometry/camera_model.h"
#include "ui/axes.h"

namespace docent::ui {

// A rectangle of whole pixels: [x, x + width) by [y, y + height).
struct PixelRectangle {
  int x = 0, y = 0, width = 0, height = 0;

  bool empty() const { return width <= 0 || height <= 0; }
  bool Overlaps(const PixelRectangle& other) const {
    return x < other.x + other.width && other.x < x + width && y < other.y + other.height &&
           other.y < y + height;
  }
  // Extends this rectangle to the smallest one that contains both.
  void Include(const PixelRectangle& other);
};

// One undistorted view into which content is rendered: a pinhole camera with its own axes, and its rectangle
// in an atlas (pixels, OpenGL's origin at the bottom left).
struct LensFace {
  engine::Rotation3 face_from_camera;
  TangentBounds bounds;
  int x_px = 0, y_px = 0, width_px = 0, height_px = 0;
};

// Tables for drawing content through a distorting lens. Content is rendered undistorted into the faces of an
// atlas; then each image pixel takes its colour from the atlas texel that its own ray hits. The rays come
// from CameraModel::Unproject, so the warp is as exact as the lens model. An ordinary lens needs one face,
// slightly larger than its field of view. A lens that exceeds kMaxTangent uses those faces of a cube that it
// sees, so that fields of view beyond 180 degrees work too.
struct LensWarp {
  static constexpr double kMaxTangent = 2.0;  // Largest tangent of one face: 63 degrees off the axis.

  std::vector<LensFace> faces;  // Never empty.
  int atlas_width_px = 0, atlas_height_px = 0;
  // For each tile of the image, row by row, the rectangle of the atlas that it samples; width 0 for none.
  static constexpr int kTilePx = 32;
  int tiles_per_row = 0;
  std::vector<PixelRectangle> tiles;

  // The atlas texture coordinates of each pixel, row by row from the top. x < 0 where the lens has no ray.
  std::vector<glm::vec2> lookup;
};

// The centre of the image keeps its resolution in the atlas, unless a side of the atlas would then exceed
// max_side_px. This takes about a hundred nanoseconds per pixel, so call it once per camera.
LensWarp MakeLensWarp(const engine::CameraModel& camera, int max_side_px);

// The part of the image (whole tiles; image pixels, row 0 at the top) that samples any of these rectangles of
// the atlas.
PixelRectangle ImageFromAtlas(const LensWarp& warp, const engine::CameraModel& camera,
                              const std::vector<PixelRectangle>& atlas_rectangles);

}  // namespace docent::ui
