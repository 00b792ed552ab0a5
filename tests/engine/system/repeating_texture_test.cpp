// SPDX-License-Identifier: Apache-2.0
// A visitor looks at a board of squares that look alike, while people hide a third of the image.
#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>
#include <vector>

#include "engine/base/random.h"
#include "engine/system/system.h"
#include "tests/engine/rendered_world.h"

namespace docent::engine {
namespace {

using testing_world::Camera;
using testing_world::CameraAt;
using testing_world::RenderedWorld;
using testing_world::Wall;

// A board of squares of ten centimetres on a painted wall.
RenderedWorld BoardOnAWall() {
  constexpr double kSquare_m = 0.1, kHalfWidth_m = 0.5, kHalfHeight_m = 0.38;
  Wall board{{0, 0, 1.2}, Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY(), kHalfWidth_m, kHalfHeight_m,
             {}};
  board.paint = cv::Mat(static_cast<int>(2 * kHalfHeight_m / testing_world::kTexelSize) + 1,
                        static_cast<int>(2 * kHalfWidth_m / testing_world::kTexelSize) + 1, CV_32FC1);
  for (int y = 0; y < board.paint.rows; ++y) {
    for (int x = 0; x < board.paint.cols; ++x) {
      const int column = static_cast<int>(x * testing_world::kTexelSize / kSquare_m);
      const int row = static_cast<int>(y * testing_world::kTexelSize / kSquare_m);
      board.paint.at<float>(y, x) = (column + row) % 2 == 0 ? 30 : 220;
    }
  }
  cv::GaussianBlur(board.paint, board.paint, {5, 5}, 1);
  return RenderedWorld({board, testing_world::PaintedWall({0, 0, 1.3}, Eigen::Vector3d::UnitX(),
                                                          Eigen::Vector3d::UnitY(), 2, 1.5, /*seed=*/3)});
}

// Covers the right third of the image with spots, which are other ones in each image.
void HideAThird(std::uint64_t seed, cv::Mat* image) {
  Random random(seed);
  const int left = image->cols - image->cols / 3;
  (*image)(cv::Rect(left, 0, image->cols - left, image->rows)).setTo(90);
  for (int i = 0; i < 60; ++i) {
    const int x =
        left + 8 + static_cast<int>(random.Below(static_cast<std::uint32_t>(image->cols - left - 16)));
    const int y = static_cast<int>(random.Below(static_cast<std::uint32_t>(image->rows)));
    cv::circle(*image, {x, y}, 3 + static_cast<int>(random.Below(5)), cv::Scalar(random.Uniform(0, 255)), -1);
  }
}

TEST(RepeatingTexture, IsRecognizedWhilePeopleHideAThirdOfTheImage) {
  const RenderedWorld world = BoardOnAWall();
  const std::shared_ptr<const MapSnapshot> map =
      testing_world::TrueMap(world, Camera(),
                             {CameraAt({-0.1, 0, 0}), CameraAt({0, 0.05, 0}), CameraAt({0.1, 0, 0})})
          .Snapshot();
  for (const std::uint64_t seed : {1, 2, 3}) {
    SystemOptions options;
    options.threaded = false;
    options.extend_maps = false;
    options.seed = seed;
    System system(options, {Camera()});
    system.AddMap(1, map, MapPermissions());
    system.place_index().SetMap(1, map);
    int posed = 0;
    for (int i = 0; i < 30; ++i) {
      const Rigid3 pose = CameraAt({-0.15 + 0.008 * i, 0.03, 0.02}, {0, 0.3 * i, 0.1 * i});
      Frame frame = testing_world::MakeFrame(i, world, pose);
      HideAThird(100 * seed + static_cast<std::uint64_t>(i), &frame.image);
      const TrackedFrame tracked = system.Process(frame);
      if (!HasPose(tracked.state)) continue;
      ++posed;
      EXPECT_LT((tracked.camera_from_map.OriginInSource() - pose.OriginInSource()).norm(), 0.02) << i;
    }
    EXPECT_GE(posed, 24) << "of 30, with seed " << seed;
  }
}

}  // namespace
}  // namespace docent::engine
