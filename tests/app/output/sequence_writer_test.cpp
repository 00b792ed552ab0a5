// SPDX-License-Identifier: Apache-2.0
#include "app/output/sequence_writer.h"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "app/calibration/calibration_file.h"
#include "app/cameras/frame_source.h"
#include "app/evaluation/ground_truth.h"
#include "tests/app/support/temporary_folder.h"

namespace docent::app {
namespace {

TEST(SequenceWriter, WritesASequenceThatCanBeRead) {
  const TemporaryFolder folder;
  const engine::CameraModel camera(engine::LensModel::kRadialTangential, {32, 24, 30, 30, 16, 12},
                                   {0.1, 0, 0, 0, 0});
  const engine::Rigid3 pose(engine::Rotation3::Exp({0.1, -0.2, 0.3}), {1, -2, 3});
  SequenceWriter writer(folder.path(), camera, ImageFormat::kPng);
  for (int i = 0; i < 3; ++i) {
    writer.Add(
        {Timestamp(i * 33'333'333LL), cv::Mat(24, 32, CV_8UC3, cv::Scalar(i, 50, 200)), pose, "general"});
  }
  writer.Close();

  const auto source = OpenCamera(folder.path().string());
  ASSERT_TRUE(source->info().calibration_path);
  EXPECT_EQ(ReadCalibration(*source->info().calibration_path), camera);
  engine::Frame frame;
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(source->Next(&frame));
    EXPECT_EQ(frame.time, Timestamp(i * 33'333'333LL));
    EXPECT_EQ(frame.image.at<cv::Vec3b>(5, 5), cv::Vec3b(static_cast<std::uint8_t>(i), 50, 200));
  }
  EXPECT_FALSE(source->Next(&frame));
  const auto truth = ReadGroundTruth(*source->info().ground_truth_path);
  ASSERT_EQ(truth.size(), 3u);
  EXPECT_TRUE(engine::IsNear(truth[2].truth_from_camera, pose, 1e-9, 1e-9));
  EXPECT_EQ(ReadSegments(*source->info().segments_path).size(), 3u);
}

TEST(SequenceWriter, LeavesNoSequenceWithoutClose) {
  const TemporaryFolder folder;
  { SequenceWriter(folder.path(), engine::CameraModel(), ImageFormat::kPng); }
  EXPECT_NE(ErrorOf([&] { OpenCamera(folder.path().string()); }), "");
}

}  // namespace
}  // namespace docent::app
