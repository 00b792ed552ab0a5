// SPDX-License-Identifier: Apache-2.0
#include "app/simulator/write_sequence.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "app/calibration/calibration_file.h"
#include "engine/base/error.h"

namespace docent::app {
namespace {

class WriteSequenceTest : public ::testing::Test {
 protected:
  WriteSequenceTest() {
    std::filesystem::remove_all(folder_);
    SimulationOptions options;
    options.camera = SimulatedCamera(160);
    options.duration_s = 0.3;
    simulation_ = MakeSimulation("museum:1", options);
  }
  ~WriteSequenceTest() override { std::filesystem::remove_all(folder_); }

  // The lines of a file without comments.
  std::vector<std::string> LinesOf(const std::string& name) const {
    std::ifstream file(folder_ / name);
    std::vector<std::string> lines;
    for (std::string line; std::getline(file, line);) {
      if (!line.empty() && line[0] != '#') lines.push_back(line);
    }
    return lines;
  }

  const std::filesystem::path folder_ =
      std::filesystem::path(::testing::TempDir()) /
      ("docent_write_sequence_" +
       std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()));
  std::unique_ptr<Simulation> simulation_;
};

TEST_F(WriteSequenceTest, WritesImagesGroundTruthCalibrationAndLabels) {
  int calls = 0;
  WriteSequence(*simulation_, folder_, [&](int written, int total) {
    EXPECT_EQ(written, ++calls);
    EXPECT_EQ(total, 10);
  });
  EXPECT_EQ(calls, 10);
  EXPECT_EQ(ReadCalibration(folder_ / "calibration.yaml"), simulation_->camera());
  const auto images = LinesOf("rgb.txt"), truth = LinesOf("groundtruth.txt"),
             labels = LinesOf("segments.txt");
  ASSERT_EQ(images.size(), 10u);
  ASSERT_EQ(truth.size(), 10u);
  ASSERT_EQ(labels.size(), 10u);
  for (int i = 0; i < 10; ++i) {
    const auto line = static_cast<std::size_t>(i);
    std::istringstream image_line(images[line]), truth_line(truth[line]);
    double time, truth_time;
    std::string name;
    ASSERT_TRUE(image_line >> time >> name);
    EXPECT_NEAR(time, ToSeconds(simulation_->time(i)), 1e-6);
    cv::Mat expected;
    simulation_->Render(i, &expected);
    const cv::Mat written = cv::imread((folder_ / name).string(), cv::IMREAD_COLOR);
    ASSERT_EQ(written.size(), expected.size());
    EXPECT_EQ(cv::norm(written, expected, cv::NORM_INF), 0);
    Eigen::Vector3d translation;
    Eigen::Quaterniond rotation;
    ASSERT_TRUE(truth_line >> truth_time >> translation.x() >> translation.y() >> translation.z() >>
                rotation.x() >> rotation.y() >> rotation.z() >> rotation.w());
    EXPECT_EQ(truth_time, time);
    EXPECT_TRUE(engine::IsNear({engine::Rotation3(rotation), translation}, simulation_->world_from_camera(i),
                               1e-8, 1e-8));
    EXPECT_THAT(labels[line], ::testing::EndsWith(" build0"));
  }
}

TEST_F(WriteSequenceTest, WritesTheTrueCalibrationBesideAWrongOne) {
  WriteSequence(*simulation_, folder_ / "right");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "right" / "true_calibration.yaml"));
  const auto wrong = MakeSimulation("museum:1,focal-error=2,distortion-error=1,duration=0.1");
  WriteSequence(*wrong, folder_ / "wrong");
  EXPECT_EQ(ReadCalibration(folder_ / "wrong" / "calibration.yaml"), wrong->calibration());
  EXPECT_EQ(ReadCalibration(folder_ / "wrong" / "true_calibration.yaml"), wrong->camera());
  EXPECT_EQ(FindCalibration(folder_ / "wrong"), folder_ / "wrong" / "calibration.yaml");
}

TEST_F(WriteSequenceTest, WritesTheReadoutTimeOfARollingShutterIntoTheTrueCalibrationOnly) {
  const auto rolling = MakeSimulation("museum:1,rolling-shutter=20,duration=0.1");
  WriteSequence(*rolling, folder_ / "rolling");
  EXPECT_FALSE(ReadCalibration(folder_ / "rolling" / "calibration.yaml").known_readout_s());
  EXPECT_EQ(ReadCalibration(folder_ / "rolling" / "true_calibration.yaml").known_readout_s(),
            Eigen::Vector2d(0, 0.02));
}

TEST_F(WriteSequenceTest, UsesAnEmptyFolderButRejectsANonEmptyOne) {
  std::filesystem::create_directories(folder_);
  std::ofstream(folder_ / "mine.txt") << "keep";
  EXPECT_THROW(WriteSequence(*simulation_, folder_), Error);
  EXPECT_TRUE(std::filesystem::exists(folder_ / "mine.txt"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "rgb"));
  EXPECT_THROW(WriteSequence(*simulation_, folder_ / "mine.txt"), Error);
  std::filesystem::remove(folder_ / "mine.txt");
  WriteSequence(*simulation_, folder_);
  EXPECT_EQ(LinesOf("rgb.txt").size(), 10u);
}

TEST_F(WriteSequenceTest, LeavesNoFilesWhenStopped) {
  const auto stop = [](int written, int) {
    if (written == 3) throw std::runtime_error("stopped");
  };
  EXPECT_THROW(WriteSequence(*simulation_, folder_, stop), std::runtime_error);
  EXPECT_FALSE(std::filesystem::exists(folder_));
  std::filesystem::create_directories(folder_);
  EXPECT_THROW(WriteSequence(*simulation_, folder_, stop), std::runtime_error);
  EXPECT_TRUE(std::filesystem::is_empty(folder_));
}

}  // namespace
}  // namespace docent::app
