// SPDX-License-Identifier: Apache-2.0
#include "maps/maintenance/relocalization_check.h"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "engine/vision/features.h"

namespace docent::maps {
namespace {

constexpr double kFocal = 300, kDepth = 2;
constexpr int kWidth = 320, kHeight = 240, kPartOfTheWall = 40;

cv::Mat PaintWall() {
  cv::Mat wall(kHeight, 2200, CV_8UC1), sum = cv::Mat::zeros(kHeight, 2200, CV_32FC1);
  cv::RNG random(3);
  // Structure at all scales, like real walls.
  for (const double sigma : {1.2, 4.0, 12.0}) {
    cv::Mat noise(wall.size(), CV_32FC1);
    random.fill(noise, cv::RNG::NORMAL, 0, sigma);
    cv::GaussianBlur(noise, noise, {}, sigma);
    sum += noise * sigma;
  }
  cv::normalize(sum, wall, 0, 255, cv::NORM_MINMAX, CV_8U);
  return wall;
}

// Keyframes that face a wall, each at an offset along it in pixels. The corners of each become points,
// observed by all keyframes whose image contains them.
engine::MapSnapshot MakeRow(const std::vector<int>& offsets) {
  const cv::Mat wall = PaintWall();
  const auto camera = std::make_shared<const engine::CameraModel>(
      engine::LensModel::kRadialTangential,
      engine::CameraModel::Intrinsics{kWidth, kHeight, kFocal, kFocal, 160, 120}, std::array<double, 5>{});
  engine::MapSnapshot map;
  for (const int offset : offsets) {
    engine::KeyFrame keyframe;
    keyframe.id = map.next_keyframe++;
    keyframe.fixed = keyframe.id == 0;
    keyframe.camera = camera;
    keyframe.mean_depth = kDepth;
    keyframe.camera_from_map.translation.x() = -offset * kDepth / kFocal;
    keyframe.features = engine::MakeFeatures(wall(cv::Rect(offset, 0, kWidth, kHeight)).clone());
    map.keyframes.push_back(keyframe);
  }
  for (const engine::KeyFrame& keyframe : map.keyframes) {
    const int offset = offsets[keyframe.id];
    for (int level = 0; level < engine::kPyramidLevels; ++level) {
      for (std::size_t i = 0; i < keyframe.features->corners[level].size(); i += 3) {
        const engine::Corner corner = keyframe.features->corners[level][i];
        const Eigen::Vector2d pixel = engine::LevelZeroFromLevel(Eigen::Vector2d(corner.x, corner.y), level);
        // Each keyframe makes points only in the middle of its image, so that none is made twice.
        if (std::abs(pixel.x() - 160) > kPartOfTheWall / 2.0) continue;
        engine::MapPoint point;
        point.id = map.next_point++;
        point.point_in_map << (pixel.x() + offset - 160) * kDepth / kFocal,
            (pixel.y() - 120) * kDepth / kFocal, kDepth, 1;
        point.source_keyframe = keyframe.id;
        point.source_level = static_cast<std::uint8_t>(level);
        point.source_pixel = {static_cast<float>(corner.x), static_cast<float>(corner.y)};
        map.points.push_back(point);
      }
    }
  }
  for (const engine::KeyFrame& keyframe : map.keyframes) {
    for (const engine::MapPoint& point : map.points) {
      const auto pixel = camera->Project(keyframe.camera_from_map * point.position());
      if (pixel && camera->IsInside(*pixel, 4))
        map.observations.push_back({keyframe.id, point.id, pixel->cast<float>(), point.source_level});
    }
  }
  return map;
}

TEST(RelocalizationCheck, FindsKeyframesWithNeighboursAndMissesIsolatedOnes) {
  std::vector<int> offsets;
  for (int i = 0; i < 8; ++i) offsets.push_back(i * kPartOfTheWall);
  offsets.push_back(1500);  // Shares no points with another keyframe.
  const engine::MapSnapshot map = MakeRow(offsets);
  ASSERT_EQ(engine::Validate(map), "");
  const auto trials = LeaveEachKeyFrameOut(map);
  ASSERT_EQ(trials.size(), offsets.size());
  int found = 0;
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_EQ(trials[i].keyframe, i);
    EXPECT_NEAR(trials[i].place.x(), offsets[i] * kDepth / kFocal, 1e-9);
    EXPECT_NE(trials[i].result, RelocalizationTrial::Result::kWrongPose);
    found += trials[i].result == RelocalizationTrial::Result::kFound;
  }
  EXPECT_GE(found, 7);
  EXPECT_EQ(trials[8].result, RelocalizationTrial::Result::kNotFound);

  const RelocalizationGrid grid = MakeRelocalizationGrid(map, trials);
  EXPECT_DOUBLE_EQ(grid.side, kDepth / 2);
  int in_cells = 0, found_in_cells = 0;
  for (const RelocalizationCell& cell : grid.cells) {
    in_cells += cell.trials;
    found_in_cells += cell.found;
    EXPECT_EQ(cell.direction, 0) << "all face the same direction";
    EXPECT_EQ(cell.square.y(), 0) << "none is ahead of the others";
    EXPECT_LT((cell.view - Eigen::Vector3d::UnitZ()).norm(), 1e-9);
    EXPECT_LT((cell.place - Eigen::Vector3d(cell.square.x() * grid.side, 0, 0)).norm(), 1e-9);
  }
  EXPECT_EQ(in_cells, 9);
  EXPECT_EQ(found_in_cells, found);
  EXPECT_EQ(grid.cells.back().square.x(), 10) << "1500 pixels are ten map units";
  EXPECT_EQ(grid.cells.back().found, 0);
}

TEST(RelocalizationCheck, StopsWhenProgressReturnsFalse) {
  const engine::MapSnapshot map = MakeRow({0, 40, 80});
  const auto trials = LeaveEachKeyFrameOut(map, {}, [](std::size_t done) { return done < 2; });
  EXPECT_EQ(trials.size(), 2u);
  EXPECT_TRUE(LeaveEachKeyFrameOut({}).empty());
}

}  // namespace
}  // namespace docent::maps
