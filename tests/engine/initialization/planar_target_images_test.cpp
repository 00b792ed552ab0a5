// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <array>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "engine/initialization/planar_target.h"
#include "engine/recognition/descriptor_database.h"
#include "engine/vision/features.h"
#include "tests/engine/rendered_world.h"

// Real paintings and photographs, which differ from synthetic texture.
namespace docent::engine {
namespace {

const std::filesystem::path kTargets = std::filesystem::path(DOCENT_SOURCE_DIR) / "../shared/assets/targets";
const std::array<const char*, 4> kPaintings = {"painting-0.jpg", "painting-7.jpg", "painting-14.jpg",
                                               "painting-21.jpg"};

class TargetImagesTest : public testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(kTargets)) GTEST_SKIP() << "there are no images in " << kTargets;
  }
  static cv::Mat Read(const std::string& name) {
    cv::Mat image = cv::imread((kTargets / name).string(), cv::IMREAD_GRAYSCALE);
    EXPECT_FALSE(image.empty()) << name;
    return image;
  }
};

// The painting on a plane of its width, as the camera sees it in front of a photograph.
cv::Mat Hang(const cv::Mat& image, double width_m, const Rigid3& camera_from_target,
             const CameraModel& camera, const cv::Mat& background) {
  const double metres = width_m / image.cols;
  Eigen::Matrix3d target_from_image, intrinsics;
  target_from_image << metres, 0, -metres * (image.cols - 1) / 2.0, 0, metres,
      -metres * (image.rows - 1) / 2.0, 0, 0, 1;
  const CameraModel::Intrinsics& lens = camera.intrinsics();
  intrinsics << lens.fx, 0, lens.cx, 0, lens.fy, lens.cy, 0, 0, 1;
  Eigen::Matrix3d camera_from_plane = camera_from_target.rotation.matrix();
  camera_from_plane.col(2) = camera_from_target.translation;
  const Eigen::Matrix3d homography = intrinsics * camera_from_plane * target_from_image;
  cv::Matx33d warp;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) warp(row, column) = homography(row, column);
  cv::Mat frame, smooth;
  cv::resize(background, frame, {camera.width_px(), camera.height_px()}, 0, 0, cv::INTER_AREA);
  cv::GaussianBlur(image, smooth, {}, 0.8);
  cv::warpPerspective(smooth, frame, warp, frame.size(), cv::INTER_LINEAR, cv::BORDER_TRANSPARENT);
  return frame;
}

TEST_F(TargetImagesTest, PaintingsAreDetectedAtTheirPosesAndNowhereElse) {
  constexpr double kWidth_m = 0.5;
  const auto camera = testing_world::PinholeCamera(640, 480);
  const cv::Mat wall = Read("graf/img1.png");
  std::vector<std::shared_ptr<const ImageFeatures>> frames;
  const Rigid3 pose(Rotation3::Exp({0.25, -0.5, 0.3}), {0.04, -0.03, 0.55});
  for (const char* name : kPaintings)
    frames.push_back(MakeFeatures(Hang(Read(name), kWidth_m, pose, *camera, wall)));
  frames.push_back(MakeFeatures(wall));
  for (std::size_t i = 0; i < kPaintings.size(); ++i) {
    const PlanarTarget target(Read(kPaintings[i]), kWidth_m);
    for (std::size_t j = 0; j < frames.size(); ++j) {
      SCOPED_TRACE(testing::Message() << kPaintings[i] << " in frame " << j);
      // The photograph alone has another size than the camera's image; it only matters that nothing is found
      // in it.
      const auto detection = target.Detect(*frames[j], *camera, 1);
      ASSERT_EQ(detection.has_value(), i == j);
      if (!detection) continue;
      EXPECT_LT((detection->camera_from_target.translation - pose.translation).norm(), 0.004);
      EXPECT_LT((detection->camera_from_target.rotation.inverse() * pose.rotation).Angle(), 0.01);
    }
  }
}

TEST_F(TargetImagesTest, DescriptorsMatchBetweenTwoViewsOfAWall) {
  Eigen::Matrix3d second_from_first;
  std::ifstream numbers(kTargets / "graf/H1to2p");
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) numbers >> second_from_first(row, column);
  ASSERT_TRUE(numbers);
  DescriptorDatabase database(DefaultVocabulary());
  for (const DescribedKeypoint& place : DescribeCorners(*MakeFeatures(Read("graf/img2.png")))) {
    // One corner counts once, whatever level and direction it was described with.
    const auto point =
        static_cast<MapPointId>(std::lround(place.pixel.y() / 6) * 1000 + std::lround(place.pixel.x() / 6));
    database.Add({place.oriented.descriptor, 0, point, place.pixel, place.level});
  }
  const std::vector<DescribedKeypoint> seen = DescribeCorners(*MakeFeatures(Read("graf/img1.png")));
  std::vector<Descriptor> queries;
  for (const DescribedKeypoint& place : seen) queries.push_back(place.oriented.descriptor);
  int right = 0;
  const auto matches = database.FindMatches(queries, {});
  for (const auto& match : matches) {
    const Eigen::Vector2f expected =
        (second_from_first * seen[match.query].pixel.cast<double>().homogeneous())
            .hnormalized()
            .cast<float>();
    right += (expected - match.entry.pixel).norm() < static_cast<float>(3 << match.entry.level);
  }
  // Far more than a pose needs; by chance one in thousands would be right.
  EXPECT_GE(right, 100);
  EXPECT_GE(right, static_cast<int>(matches.size()) / 2);
  RecordProperty("matches", static_cast<int>(matches.size()));
  RecordProperty("right", right);
}

}  // namespace
}  // namespace docent::engine
