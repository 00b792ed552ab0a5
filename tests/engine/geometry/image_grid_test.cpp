// SPDX-License-Identifier: Apache-2.0
#include "engine/geometry/image_grid.h"

#include <gtest/gtest.h>

#include <vector>

namespace docent::engine {
namespace {

CameraModel CameraOfSize(int width_px, int height_px) {
  return {LensModel::kRadialTangential, {width_px, height_px, 100, 100, width_px / 2.0, height_px / 2.0}, {}};
}

TEST(ImageGrid, NumbersItsCellsRowByRow) {
  std::size_t next = 0;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 5; ++column) EXPECT_EQ(GridIndex(column, row, 5, 3), next++);
}

TEST(ImageGrid, TakesTheNearestCellForThoseOutside) {
  EXPECT_EQ(GridIndex(-4, 1, 5, 3), GridIndex(0, 1, 5, 3));
  EXPECT_EQ(GridIndex(5, 1, 5, 3), GridIndex(4, 1, 5, 3));
  EXPECT_EQ(GridIndex(2, -1, 5, 3), GridIndex(2, 0, 5, 3));
  EXPECT_EQ(GridIndex(2, 3, 5, 3), GridIndex(2, 2, 5, 3));
  EXPECT_EQ(GridIndex(99, 99, 5, 3), 14u);
  EXPECT_EQ(GridIndex(-99, -99, 5, 3), 0u);
}

TEST(ImageGrid, DividesTheImageIntoEqualCells) {
  const CameraModel camera = CameraOfSize(640, 480);
  std::vector<int> pixels(16, 0);
  for (int y = 0; y < 480; ++y) {
    for (int x = 0; x < 640; ++x) {
      const std::size_t cell = GridCell(Eigen::Vector2i(x, y), camera, 4, 4);
      ASSERT_LT(cell, pixels.size());
      ++pixels[cell];
      EXPECT_EQ(cell, static_cast<std::size_t>(y / 120 * 4 + x / 160));
    }
  }
  for (const int count : pixels) EXPECT_EQ(count, 160 * 120);
}

TEST(ImageGrid, CoversImagesThatItsCellsDoNotDivide) {
  const CameraModel camera = CameraOfSize(101, 67);
  std::vector<int> pixels(4 * 3, 0);
  for (int y = 0; y < 67; ++y)
    for (int x = 0; x < 101; ++x) ++pixels.at(GridCell(Eigen::Vector2i(x, y), camera, 4, 3));
  for (const int count : pixels) {
    EXPECT_GE(count, 25 * 22);
    EXPECT_LE(count, 26 * 23);
  }
}

TEST(ImageGrid, HasSharpBordersForRealPixels) {
  const CameraModel camera = CameraOfSize(640, 480);
  EXPECT_EQ(GridCell(Eigen::Vector2d(159.999, 0), camera, 4, 4), 0u);
  EXPECT_EQ(GridCell(Eigen::Vector2d(160.0, 0), camera, 4, 4), 1u);
  EXPECT_EQ(GridCell(Eigen::Vector2d(0, 119.999), camera, 4, 4), 0u);
  EXPECT_EQ(GridCell(Eigen::Vector2d(0, 120.0), camera, 4, 4), 4u);
}

TEST(ImageGrid, AgreesForWholeAndRealPixels) {
  const CameraModel camera = CameraOfSize(101, 67);
  for (int y = -3; y < 70; ++y)
    for (int x = -3; x < 105; ++x)
      EXPECT_EQ(GridCell(Eigen::Vector2i(x, y), camera, 4, 3), GridCell(Eigen::Vector2d(x, y), camera, 4, 3))
          << x << ", " << y;
}

TEST(ImageGrid, TakesTheNearestCellForPixelsOutsideTheImage) {
  const CameraModel camera = CameraOfSize(640, 480);
  EXPECT_EQ(GridCell(Eigen::Vector2d(-30.5, 200), camera, 4, 4), 4u);
  EXPECT_EQ(GridCell(Eigen::Vector2d(640, 200), camera, 4, 4), 7u);
  EXPECT_EQ(GridCell(Eigen::Vector2d(900, -5), camera, 4, 4), 3u);
  EXPECT_EQ(GridCell(Eigen::Vector2i(-1, 480), camera, 4, 4), 12u);
}

}  // namespace
}  // namespace docent::engine
