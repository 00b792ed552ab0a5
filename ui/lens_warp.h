// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "engine/geometry/camera_model.h"
#include "ui/axes.h"

namespace docent::ui {

// Whole pixels; [x, x + width) by [y, y + height).
struct PixelRectangle {
  int x = 0, y = 0, width = 0, height = 0;

  bool empty() const { return width <= 0 || height <= 0; }
  bool Overlaps(const PixelRectangle& other) const {
    return x < other.x + other.width && other.x < x + width && y < other.y + other.height &&
           other.y < y + height;
  }
  // Grows to the smallest rectangle that holds both.
  void Include(const PixelRectangle& other);
};

// One undistorted view that content is rendered into: a pinhole in its own camera axes, and its place in an
// atlas (pixels, OpenGL's origin at the bottom left).
struct LensFace {
  engine::Rotation3 face_from_camera;
  TangentBounds bounds;
  int x_px = 0, y_px = 0, width_px = 0, height_px = 0;
};

// How to draw through a lens: content is rendered undistorted into the faces of an atlas, then every pixel of
// the image fetches its colour from where its own ray falls in the atlas. The ray of each pixel comes from
// CameraModel::Unproject, so the warp is as exact as the lens model. An ordinary lens needs one face, a
// little larger than its field of view; beyond kMaxTangent the directions go to the faces of a cube that the
// lens really sees, so that lenses beyond 180 degrees work too.
struct LensWarp {
  static constexpr double kMaxTangent = 2.0;  // of one face: 63 degrees off the axis

  std::vector<LensFace> faces;  // never empty
  int atlas_width_px = 0, atlas_height_px = 0;
  // Rectangles of the atlas that the image's tiles look at, row by row of tiles; empty (width 0) for none.
  static constexpr int kTilePx = 32;
  int tiles_per_row = 0;
  std::vector<PixelRectangle> tiles;

  // Texture coordinates in the atlas for each pixel, row by row from the top; x < 0 where the lens has no
  // ray.
  std::vector<glm::vec2> lookup;
};

// The middle of the image keeps its resolution in the atlas, unless a side of the atlas would then exceed
// max_side_px. A hundred nanoseconds or so a pixel: to be made once a camera.
LensWarp MakeLensWarp(const engine::CameraModel& camera, int max_side_px);

// The part of the image that looks at any of these rectangles of the atlas (whole tiles; image pixels,
// row 0 is the top).
PixelRectangle ImageFromAtlas(const LensWarp& warp, const engine::CameraModel& camera,
                              const std::vector<PixelRectangle>& atlas_rectangles);

}  // namespace docent::ui
