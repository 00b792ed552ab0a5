// SPDX-License-Identifier: Apache-2.0
#include "app/evaluation/panorama_image.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "app/simulator/simulation.h"
#include "engine/vision/features.h"
#include "tests/app/support/rad_per_degree.h"

namespace docent::app {
namespace {

// The textured cylinder seen from its axis: a rotation of 90 degrees in 100 images.
const Simulation& Cylinder() {
  static const auto simulation = MakeSimulation("cylinder:0", SimulationOptions::Clean());
  return *simulation;
}

cv::Mat Grey(int frame) {
  cv::Mat bgr, grey;
  Cylinder().Render(frame, &bgr);
  cv::cvtColor(bgr, grey, cv::COLOR_BGR2GRAY);
  return grey;
}

engine::KeyFrame MakeKeyFrame(engine::KeyFrameId id, int frame, engine::PanoramaId panorama,
                              const engine::Rotation3& turned = {}) {
  static const auto camera = std::make_shared<engine::CameraModel>(Cylinder().camera());
  engine::KeyFrame keyframe;
  keyframe.id = id;
  keyframe.camera = camera;
  keyframe.features = engine::MakeFeatures(Grey(frame));
  keyframe.camera_from_map =
      Cylinder().world_from_camera(frame).inverse() * engine::Rigid3(turned, Eigen::Vector3d::Zero());
  keyframe.panorama = panorama;
  keyframe.kind = id == 0 ? engine::KeyFrameKind::kSixDof : engine::KeyFrameKind::kPanorama;
  return keyframe;
}

// One panorama map with keyframes 15 degrees apart, at their true poses in a world that is rotated about the
// vertical axis.
engine::MapSnapshot TrueMap(double world_rotation_deg) {
  engine::MapSnapshot map;
  const engine::Rotation3 turned = engine::Rotation3::Exp({0, world_rotation_deg * kRadPerDegree, 0});
  for (int i = 0; i < 6; ++i)
    map.keyframes.push_back(MakeKeyFrame(static_cast<engine::KeyFrameId>(i), 17 * i, 0, turned));
  map.panoramas = {{0, 0}};
  return map;
}

// The median grey value difference between a stitched image and a frame that is not part of it, with the
// frame's rays rotated by rotation_deg.
double MedianDifference(const PanoramaImage& panorama, int frame, const engine::Rotation3& map_from_world,
                        double rotation_deg, int* compared) {
  const cv::Mat truth = Grey(frame);
  const engine::Rotation3 more = engine::Rotation3::Exp({0, rotation_deg * kRadPerDegree, 0});
  const engine::Rotation3 map_from_camera =
      map_from_world * more * Cylinder().world_from_camera(frame).rotation;
  std::vector<int> differences;
  for (int y = 20; y < truth.rows - 20; y += 3) {
    for (int x = 20; x < truth.cols - 20; x += 3) {
      const auto ray = Cylinder().camera().Unproject({static_cast<double>(x), static_cast<double>(y)});
      const Eigen::Vector2d pixel = panorama.PixelOf(map_from_camera * *ray);
      const cv::Point at(static_cast<int>(std::lround(pixel.x())), static_cast<int>(std::lround(pixel.y())));
      if (!cv::Rect(0, 0, panorama.image.cols, panorama.image.rows).contains(at)) continue;
      if (panorama.shown.at<std::uint8_t>(at) == 0) continue;
      differences.push_back(std::abs(truth.at<std::uint8_t>(y, x) - panorama.image.at<std::uint8_t>(at)));
    }
  }
  *compared = static_cast<int>(differences.size());
  if (differences.empty()) return 255;
  std::nth_element(differences.begin(), differences.begin() + *compared / 2, differences.end());
  return differences[static_cast<std::size_t>(*compared / 2)];
}

TEST(PanoramaImage, MatchesImagesBetweenItsKeyframes) {
  // With 180 degrees, the panorama spans the wrap-around of the azimuth.
  for (const double world_rotation_deg : {0.0, 100.0, 180.0}) {
    const auto images = StitchPanoramas(TrueMap(world_rotation_deg));
    ASSERT_EQ(images.size(), 1u);
    const engine::Rotation3 map_from_world =
        engine::Rotation3::Exp({0, -world_rotation_deg * kRadPerDegree, 0});
    for (const int frame : {9, 43, 76}) {
      int compared = 0;
      const double difference = MedianDifference(images[0], frame, map_from_world, 0, &compared);
      EXPECT_GT(compared, 29'000);
      EXPECT_LT(difference, 5) << "grey levels, frame " << frame;
      // Half a degree is two and a half pixels, which the comparison must detect.
      for (const double rotation_deg : {-0.5, 0.5})
        EXPECT_GT(MedianDifference(images[0], frame, map_from_world, rotation_deg, &compared),
                  difference + 1);
    }
  }
}

TEST(PanoramaImage, IsCroppedToItsContent) {
  const PanoramaImage image = StitchPanoramas(TrueMap(0)).at(0);
  EXPECT_EQ(image.keyframes, 6);
  EXPECT_EQ(image.panorama, 0u);
  ASSERT_EQ(image.image.size(), image.shown.size());
  // From half a field of view left of the first keyframe to half a field of view right of the last.
  const engine::CameraModel& camera = Cylinder().camera();
  const double half = std::acos(camera.Unproject({0, camera.height_px() / 2.0})->z());
  const double turn =
      (Cylinder().world_from_camera(0).rotation.inverse() * Cylinder().world_from_camera(85).rotation)
          .Angle();
  EXPECT_NEAR(image.image.cols / image.pixels_per_radian, turn + 2 * half, 0.1);
  for (const int column : {0, image.shown.cols - 1}) EXPECT_GT(cv::countNonZero(image.shown.col(column)), 0);
  for (const int row : {0, image.shown.rows - 1}) EXPECT_GT(cv::countNonZero(image.shown.row(row)), 0);
  EXPECT_LT(cv::countNonZero(image.shown), static_cast<int>(image.shown.total()));
}

TEST(PanoramaImage, IncludesKeyframesThatWereLocalizedLaterAndNoOthers) {
  engine::MapSnapshot map = TrueMap(0);
  // Two keyframes become references of new panorama maps, one of them a metre away; another becomes an
  // ordinary one.
  const auto localize = [&](std::size_t index, engine::PanoramaId panorama, double away) {
    engine::KeyFrame& keyframe = map.keyframes[index];
    keyframe.kind = engine::KeyFrameKind::kSixDof;
    keyframe.panorama = panorama;
    keyframe.camera_from_map.translation.x() += away;
    if (panorama != engine::kNoId) map.panoramas.push_back({panorama, keyframe.id});
  };
  localize(3, 1, 0.01);
  localize(4, 2, 1.0);
  localize(5, engine::kNoId, 0);
  const auto images = StitchPanoramas(map);
  ASSERT_EQ(images.size(), 1u) << "one panorama; a single image elsewhere gives none";
  EXPECT_EQ(images[0].panorama, 0u);
  EXPECT_EQ(images[0].keyframes, 4);
}

TEST(PanoramaImage, IsNotMadeOfASingleImage) {
  engine::MapSnapshot map = TrueMap(0);
  map.keyframes.resize(1);
  EXPECT_TRUE(StitchPanoramas(map).empty());
  EXPECT_TRUE(StitchPanoramas({}).empty());
}

TEST(PanoramaImage, RoundTripsThroughPng) {
  cv::Mat image(40, 60, CV_8UC1);
  cv::randu(image, 0, 256);
  const cv::Mat read = cv::imdecode(EncodePng(image), cv::IMREAD_GRAYSCALE);
  ASSERT_EQ(read.size(), image.size());
  EXPECT_EQ(cv::norm(read, image, cv::NORM_INF), 0);
}

}  // namespace
}  // namespace docent::app
