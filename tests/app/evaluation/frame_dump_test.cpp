// SPDX-License-Identifier: Apache-2.0
#include "app/evaluation/frame_dump.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "app/session/session.h"
#include "app/simulator/simulation.h"
#include "tests/app/support/temporary_folder.h"

namespace docent::app {
namespace {

nlohmann::json ReadJson(const std::filesystem::path& path) {
  std::ifstream file(path);
  return nlohmann::json::parse(file);
}

// A short walk through the simulated room in lockstep, up to a frame that is tracked with finite points.
class FrameDump : public ::testing::Test {
 protected:
  void TrackUntilPosed() {
    simulation_ = MakeSimulation("room", SimulationOptions::Clean());
    camera_ = std::make_shared<engine::CameraModel>(simulation_->camera());
    SessionOptions options;
    options.threaded = false;
    options.first_map = "room";
    session_.emplace(options, std::vector<std::shared_ptr<const engine::CameraModel>>{camera_}, nullptr);
    for (int i = 0; i < 120; ++i) {
      engine::Frame frame;
      frame.time = FromSeconds(i / 30.0);
      frame.index = static_cast<std::uint64_t>(i);
      simulation_->Render(i, &frame.image);
      tracked_ = session_->Process(frame);
      if (tracked_.state == engine::TrackingState::kSixDof && tracked_.finite_points >= 50) return;
    }
    FAIL() << "no frame was tracked";
  }

  std::shared_ptr<const Simulation> simulation_;
  std::shared_ptr<const engine::CameraModel> camera_;
  std::optional<Session> session_;
  engine::TrackedFrame tracked_;
  TemporaryFolder folder_;
};

TEST_F(FrameDump, ListsWhereEveryPointWasSearchedAndFound) {
  TrackUntilPosed();
  WriteFrameDump(folder_.path(), 7, tracked_, session_->Inspect(tracked_), "Move more slowly.");
  const nlohmann::json json = ReadJson(folder_.path() / "frame-7.json");
  EXPECT_EQ(json["frame"], 7);
  EXPECT_EQ(json["state"], "sixdof");
  EXPECT_EQ(json["map"]["points"], tracked_.map->points.size());
  EXPECT_DOUBLE_EQ(json["camera_from_map"]["translation"][2], tracked_.camera_from_map.translation.z());
  std::size_t found = 0, inliers = 0;
  for (const nlohmann::json& point : json["points"]) {
    const engine::MapPoint* const in_map = tracked_.map->FindPoint(point["id"]);
    ASSERT_NE(in_map, nullptr);
    if (point["found_px"].is_null()) continue;
    ++found;
    if (!point["inlier"]) continue;
    ++inliers;
    const auto pixel = camera_->Project(tracked_.camera_from_map * in_map->position());
    ASSERT_TRUE(pixel);
    EXPECT_NEAR(point["residual_px"][0], point["found_px"][0].get<double>() - pixel->x(), 1e-6);
    EXPECT_NEAR(point["residual_px"][1], point["found_px"][1].get<double>() - pixel->y(), 1e-6);
    EXPECT_GT(point["weight"], 0);
    if (in_map->infinite()) {
      EXPECT_TRUE(point["depth_deviation"].is_null());
    } else {
      EXPECT_GT(point["depth_deviation"], 0);
    }
  }
  EXPECT_GT(inliers, 10u);
  EXPECT_EQ(found, tracked_.matches.size());
  EXPECT_EQ(inliers, static_cast<std::size_t>(tracked_.finite_points + tracked_.infinite_points));
  EXPECT_EQ(json["levels"].size(), static_cast<std::size_t>(engine::kPyramidLevels));
}

TEST_F(FrameDump, DrawsPointsAtTheirPixels) {
  TrackUntilPosed();
  const engine::FrameInspection inspection = session_->Inspect(tracked_);
  WriteFrameDump(folder_.path(), 0, tracked_, inspection, "");
  for (const char* const name : {"frame-0-points.png", "frame-0-residuals.png"}) {
    const cv::Mat drawn = cv::imread((folder_.path() / name).string());
    ASSERT_EQ(drawn.size(), tracked_.frame.image.size()) << name;
    cv::Mat difference;
    cv::absdiff(drawn, tracked_.frame.image, difference);
    cv::Mat changed = cv::Mat::zeros(drawn.size(), CV_8UC1);
    for (int y = 0; y < drawn.rows; ++y)
      for (int x = 0; x < drawn.cols; ++x)
        changed.at<std::uint8_t>(y, x) = difference.at<cv::Vec3b>(y, x) != cv::Vec3b(0, 0, 0);
    // Something must be drawn around every point that was found.
    int found = 0;
    for (const engine::InspectedPoint& point : inspection.points) {
      if (!point.found) continue;
      const int reach = 2 * (1 << point.level) + 2;
      const cv::Point at(cvRound(point.found->x()), cvRound(point.found->y()));
      const cv::Rect about =
          cv::Rect(at.x - reach, at.y - reach, 2 * reach + 1, 2 * reach + 1) & cv::Rect({0, 0}, drawn.size());
      EXPECT_GT(cv::countNonZero(changed(about)), 0) << name;
      ++found;
    }
    EXPECT_GT(found, 10);
  }
  const cv::Mat corners = cv::imread((folder_.path() / "frame-0-corners.png").string());
  EXPECT_EQ(corners.cols, tracked_.frame.image.cols * 3 / 2);
}

TEST_F(FrameDump, DescribesADroppedFrameByItsStateOnly) {
  engine::TrackedFrame dropped;
  dropped.state = engine::TrackingState::kDropped;
  WriteFrameDump(folder_.path(), 3, dropped, {}, "");
  const nlohmann::json json = ReadJson(folder_.path() / "frame-3.json");
  EXPECT_EQ(json["state"], "dropped");
  EXPECT_TRUE(json["camera_from_map"].is_null());
  EXPECT_TRUE(json["points"].empty());
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "frame-3-points.png"));
}

}  // namespace
}  // namespace docent::app
