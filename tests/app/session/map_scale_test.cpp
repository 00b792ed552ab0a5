// SPDX-License-Identifier: Apache-2.0
// Maps whose scale is known without a measurement by the author.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <array>
#include <chrono>
#include <memory>
#include <opencv2/core.hpp>
#include <opencv2/core/eigen.hpp>
#include <opencv2/imgproc.hpp>

#include "app/session/session.h"
#include "engine/initialization/planar_target.h"

namespace docent::app {
namespace {

constexpr double kPixelsPerMetre = 400;  // of the wall

// A wall with rectangles of many sizes, 5 x 4 m.
cv::Mat WallWithRectangles() {
  cv::Mat wall(1600, 2000, CV_8UC1, cv::Scalar(128));
  cv::RNG random(7);
  for (int i = 0; i < 4000; ++i) {
    const cv::Point corner(random.uniform(0, wall.cols), random.uniform(0, wall.rows));
    const cv::Size size(random.uniform(8, 70), random.uniform(8, 70));
    cv::rectangle(wall, cv::Rect(corner, size), cv::Scalar(random.uniform(20, 236)), cv::FILLED);
  }
  cv::GaussianBlur(wall, wall, {}, 1);
  return wall;
}

// What a camera sees that looks straight at the wall from 2 m, this far to the right of its middle.
cv::Mat WallFrom2Metres(const cv::Mat& wall, const engine::CameraModel::Intrinsics& camera, double right_m) {
  constexpr double kDistance_m = 2;
  Eigen::Matrix3d wall_from_image;
  const double scale = kPixelsPerMetre * kDistance_m / camera.fx;
  wall_from_image << scale, 0, wall.cols / 2.0 + kPixelsPerMetre * right_m - scale * camera.cx,  //
      0, scale, wall.rows / 2.0 - scale * camera.cy,                                             //
      0, 0, 1;
  cv::Mat homography, view;
  cv::eigen2cv(wall_from_image, homography);
  cv::warpPerspective(wall, view, homography, {camera.width_px, camera.height_px},
                      cv::INTER_AREA | cv::WARP_INVERSE_MAP);
  return view;
}

TEST(MapScale, OfAMapInitializedFromATargetIsMetres) {
  const cv::Mat wall = WallWithRectangles();
  const cv::Rect poster(wall.cols / 2 - 240, wall.rows / 2 - 180, 480, 360);
  engine::CameraModel::Intrinsics intrinsics;
  intrinsics.width_px = 640;
  intrinsics.height_px = 480;
  intrinsics.fx = intrinsics.fy = 500;
  intrinsics.cx = 319.5;
  intrinsics.cy = 239.5;
  SessionOptions options;
  options.threaded = false;
  options.first_map = "Hall";
  options.tracker.target =
      std::make_shared<const engine::PlanarTarget>(wall(poster).clone(), poster.width / kPixelsPerMetre);
  Session session(options,
                  {std::make_shared<const engine::CameraModel>(engine::LensModel::kRadialTangential,
                                                               intrinsics, std::array<double, 5>{})},
                  nullptr);
  constexpr int kImages = 60;
  constexpr double kStep_m = 0.02;
  std::vector<Eigen::Vector3d> centres;
  for (int i = 0; i < kImages; ++i) {
    engine::Frame frame;
    frame.index = static_cast<std::uint64_t>(i);
    frame.time = std::chrono::milliseconds(33 * i);
    frame.image = WallFrom2Metres(wall, intrinsics, kStep_m * i - 0.3);
    const engine::TrackedFrame tracked = session.Process(frame);
    if (engine::HasPose(tracked.state) && tracked.finite_points > 0)
      centres.push_back(tracked.camera_from_map.OriginInSource());
  }
  session.Finish();
  ASSERT_GE(centres.size(), 10u);
  const double path_m = kStep_m * static_cast<double>(centres.size() - 1);
  EXPECT_NEAR((centres.back() - centres.front()).norm(), path_m, 0.03 * path_m);
  ASSERT_EQ(session.Maps().size(), 1u);
  EXPECT_EQ(session.Maps().front().scene->settings.metres_per_unit, 1);
}

}  // namespace
}  // namespace docent::app
