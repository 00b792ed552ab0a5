// SPDX-License-Identifier: Apache-2.0
#include "ui/recorder.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

#include "tests/ui/ui_testing.h"
#include "ui/map_view.h"

namespace docent::ui {
namespace {

std::filesystem::path Scratch(const std::string& name) {
  return std::filesystem::temp_directory_path() / ("docent-ui-" + std::to_string(getpid()) + "-" + name);
}

TEST(Recorder, WritesAVideoThatReadsBackWithTheSameImages) {
  const std::filesystem::path path = Scratch("video.mp4");
  {
    Recorder recorder(path.string(), 25);
    for (int i = 0; i < 20; ++i)
      recorder.Write(cv::Mat(121, 161, CV_8UC3, cv::Scalar(10 + 10 * i, 120, 240 - 10 * i)));
    recorder.Close();
  }
  cv::VideoCapture video(path.string(), cv::CAP_FFMPEG);
  ASSERT_TRUE(video.isOpened());
  EXPECT_NEAR(video.get(cv::CAP_PROP_FPS), 25, 0.01);
  int count = 0;
  for (cv::Mat image; video.read(image); ++count) {
    EXPECT_EQ(image.size(), cv::Size(160, 120));
    const cv::Scalar mean = cv::mean(image);
    EXPECT_NEAR(mean[0], 10 + 10 * count, 8);
    EXPECT_NEAR(mean[2], 240 - 10 * count, 8);
  }
  EXPECT_EQ(count, 20);
  std::filesystem::remove(path);
}

TEST(Recorder, ThrowsAClearErrorWhenItCannotWrite) {
  const auto message = [](const std::string& path, double rate) {
    try {
      Recorder recorder(path, rate);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_NE(message("/no such folder/video.mp4", 30).find("/no such folder/video.mp4"), std::string::npos);
  EXPECT_NE(message(Scratch("video.txt").string(), 30).find(".mp4"), std::string::npos);
  EXPECT_NE(message(Scratch("video.mp4").string(), 0).find("rate"), std::string::npos);
}

TEST(Recorder, ReportsARecordingThatAFullDiskHasCutOff) {
  const auto old_handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit old_limit{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &old_limit), 0);
  for (const char* ending : {"mp4", "mkv", "avi", "mov"}) {
    const std::filesystem::path path = Scratch(std::string("cut.") + ending);
    rlimit limit = old_limit;
    limit.rlim_cur = 200'000;
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &limit), 0);
    std::string problem;
    try {
      Recorder recorder(path.string(), 30);
      cv::RNG random(1);
      for (int i = 0; i < 60; ++i) {
        cv::Mat image(240, 320, CV_8UC3);
        random.fill(image, cv::RNG::UNIFORM, 0, 255);
        recorder.Write(image);
      }
      recorder.Close();
    } catch (const Error& error) {
      problem = error.what();
    }
    setrlimit(RLIMIT_FSIZE, &old_limit);
    EXPECT_NE(problem.find("incomplete"), std::string::npos) << ending << ": " << problem;
    std::filesystem::remove(path);
  }
  std::signal(SIGXFSZ, old_handler);
}

TEST(Recorder, LeavesNoFileWhenNoImageWasWritten) {
  const std::filesystem::path path = Scratch("empty.mp4");
  Recorder(path.string(), 30).Close();
  EXPECT_FALSE(std::filesystem::exists(path));
}

TEST(MapView, ViewsStraightDownAtMaximumElevation) {
  Orbit orbit;
  orbit.target = {1, 2, 3};
  orbit.distance = 4;
  orbit.elevation = 10;  // Clamped to a right angle.
  const engine::Rigid3 camera_from_map = CameraFromMap(orbit);
  EXPECT_LT((camera_from_map.OriginInSource() - Eigen::Vector3d(1, -2, 3)).norm(), 1e-9);
  EXPECT_LT((camera_from_map * orbit.target - Eigen::Vector3d(0, 0, 4)).norm(), 1e-9);
}

TEST(MapView, LooksDownAlongTheUpDirectionOfTheMap) {
  // The first camera is tilted; the others are level on average, and their up direction counts.
  engine::MapSnapshot map;
  for (const double tilt : {0.9, -0.2, 0.2, 0.0, -0.9}) {
    engine::KeyFrame keyframe;
    keyframe.camera_from_map.rotation =
        engine::Rotation3::Exp({tilt, 0, 0}) * engine::Rotation3::Exp({0, 0, 0.4});
    map.keyframes.push_back(keyframe);
  }
  map.keyframes.back().camera_from_map.translation = {1, 0, 0};
  Orbit orbit = OrbitAbove(map);
  orbit.elevation = std::numbers::pi / 2;
  const Eigen::Vector3d forward = CameraFromMap(orbit).rotation.inverse() * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d up = engine::Rotation3::Exp({0, 0, -0.4}) * -Eigen::Vector3d::UnitY();
  EXPECT_LT((forward + up).norm(), 1e-9);
  EXPECT_LT((forward + engine::UpInMap(map)).norm(), 1e-12);
}

TEST(MapView, ShowsGridSpacingInMapUnits) {
  engine::MapSnapshot map;
  map.points.resize(3);
  map.keyframes.resize(2);
  EXPECT_EQ(MapViewCounts(map, 0.2), "3 points, 2 keyframes, grid spacing 0.2 map units");
}

using MapViewImage = OffscreenTest;

TEST_F(MapViewImage, ShowsPredictedRecallByPlaceAndDirection) {
  const engine::MapSnapshot map;
  Orbit orbit;
  orbit.distance = 4;
  orbit.elevation = std::numbers::pi / 2;
  MapView view;
  cv::Mat image;
  const std::vector<PredictedRecall> found = {{{0, 0, 0}, {0, 0, 1}, 2.0, 1.0},
                                              {{0, 0, 0}, {0, 0, -1}, 2.0, 0.0}};
  view.Draw(map, orbit, {nullptr, "", found, false, std::nullopt});
  view.ReadBack(&image);
  // Seen from above, +z is up in the image: green there and red below, on the middle column.
  const int x = image.cols / 2;
  const int step = image.rows / 12;
  const auto ahead = image.at<cv::Vec3b>(image.rows / 2 - step, x);
  const auto behind = image.at<cv::Vec3b>(image.rows / 2 + step, x);
  EXPECT_GT(ahead[1], ahead[2] + 60);
  EXPECT_GT(behind[2], behind[1] + 60);
  const auto aside = image.at<cv::Vec3b>(image.rows / 2 + 3, x + step);
  EXPECT_LT(std::abs(aside[1] - aside[2]), 40) << "this direction has no prediction";
}

TEST_F(MapViewImage, ShowsTheEdgesOfTheBoundary) {
  Orbit orbit;
  orbit.distance = 4;
  orbit.elevation = std::numbers::pi / 2;
  MapView view;
  MapViewContents contents;
  cv::Mat without, with, difference;
  view.Draw({}, orbit, contents);
  view.ReadBack(&without);
  contents.boundary.emplace(Eigen::Vector3d(-0.5, -0.01, -0.5), Eigen::Vector3d(0.5, 0.01, 0.5));
  view.Draw({}, orbit, contents);
  view.ReadBack(&with);
  cv::cvtColor(cv::abs(with - without), difference, cv::COLOR_BGR2GRAY);
  std::vector<cv::Point> changed;
  cv::findNonZero(difference > 40, changed);
  ASSERT_FALSE(changed.empty());
  const cv::Rect box = cv::boundingRect(changed);
  // Seen straight from above, its edges are a square about the middle and nothing within it changes.
  EXPECT_NEAR(box.width, box.height, 4);
  EXPECT_NEAR(box.x + 0.5 * box.width, 0.5 * with.cols, 2);
  EXPECT_NEAR(box.y + 0.5 * box.height, 0.5 * with.rows, 2);
  EXPECT_EQ(difference.at<std::uint8_t>(with.rows / 2 + 3, with.cols / 2 + 5), 0);
}

TEST_F(MapViewImage, ShowsThePointsOfAMapInColour) {
  engine::MapSnapshot map;
  Random random(5);
  for (engine::MapPointId i = 0; i < 300; ++i) {
    engine::MapPoint point;
    point.id = i;
    point.point_in_map << random.Uniform(-1, 1), random.Uniform(-0.1, 0.1), random.Uniform(1, 3), 1;
    map.points.push_back(point);
  }
  MapView view;
  cv::Mat empty, full;
  const Orbit orbit = OrbitAbove(map);
  EXPECT_LT((orbit.target - Eigen::Vector3d(0, 0, 2)).norm(), 0.3);
  view.Draw({}, orbit, {});
  view.ReadBack(&empty);
  view.Draw(map, orbit, {});
  view.ReadBack(&full);
  cv::Mat red;
  cv::inRange(full, cv::Scalar(0, 0, 180), cv::Scalar(130, 130, 255), red);
  EXPECT_GT(cv::countNonZero(red), 600);
  cv::inRange(empty, cv::Scalar(0, 0, 180), cv::Scalar(130, 130, 255), red);
  EXPECT_EQ(cv::countNonZero(red), 0);
}

}  // namespace
}  // namespace docent::ui
