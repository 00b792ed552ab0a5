// SPDX-License-Identifier: Apache-2.0
#include "app/evaluation/camera_report.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace docent::app {
namespace {

engine::TrackedFrame FrameOf(engine::TrackingState state, int milliseconds) {
  engine::TrackedFrame frame;
  frame.state = state;
  frame.tracking_time = std::chrono::milliseconds(milliseconds);
  return frame;
}

TEST(CameraReport, ReportsTheLatenciesOfEachCamera) {
  using engine::TrackingState;
  CameraTally hand("hand"), shoulder("/dev/video1");
  for (int i = 1; i <= 100; ++i) hand.Add(FrameOf(TrackingState::kSixDof, i));
  hand.Add(FrameOf(TrackingState::kDropped, 0));
  hand.Add(FrameOf(TrackingState::kLost, 7));
  shoulder.Add(FrameOf(TrackingState::kLost, 4));
  for (int i = 1; i <= 20; ++i) {
    shoulder.AddAge(FrameStage::kTracked, std::chrono::milliseconds(10 * i));
    shoulder.AddAge(FrameStage::kDrawn, std::chrono::milliseconds(10 * i + 4));
    shoulder.AddAge(FrameStage::kShown, std::chrono::milliseconds(10 * i + 5));
    shoulder.AddShown(std::chrono::milliseconds(1000 + 5 * i * i));
  }
  Delivery delivery;
  delivery.delivered = 20;
  delivery.late = 3;
  delivery.median_latency = std::chrono::microseconds(12500);
  shoulder.SetDelivery(delivery);
  const auto json = nlohmann::json::parse(FormatCameraReport({hand, shoulder}, 0.03));
  const auto& cameras = json["cameras"];
  ASSERT_EQ(cameras.size(), 2u);
  EXPECT_NEAR(json["keyframe_queue_latency_ms"].get<double>(), 30, 1e-9);
  EXPECT_EQ(cameras[0]["name"], "hand");
  EXPECT_EQ(cameras[0]["frames"], 102);
  EXPECT_EQ(cameras[0]["with_pose"], 100);
  EXPECT_EQ(cameras[0]["dropped"], 1);
  EXPECT_NEAR(cameras[0]["tracking_ms"]["median"].get<double>(), 50, 1);
  EXPECT_NEAR(cameras[0]["tracking_ms"]["p95"].get<double>(), 95, 1);
  EXPECT_EQ(cameras[0]["tracking_ms"]["max"], 100);
  EXPECT_TRUE(cameras[0]["latency_ms"]["tracked"].is_null()) << "the capture time of a recording is unknown";
  EXPECT_TRUE(cameras[0]["delivery"].is_null());
  EXPECT_NEAR(cameras[1]["latency_ms"]["tracked"]["median"].get<double>(), 100, 1);
  EXPECT_NEAR(cameras[1]["latency_ms"]["drawn"]["p95"].get<double>(), 194, 2);
  EXPECT_NEAR(cameras[1]["latency_ms"]["shown"]["max"].get<double>(), 205, 1e-9);
  EXPECT_TRUE(cameras[1]["latency_ms"]["taken"].is_null()) << "there is no window";
  EXPECT_EQ(cameras[1]["drawn_interval_ms"]["max"], 195) << "5 (20^2 - 19^2)";
  EXPECT_TRUE(cameras[0]["drawn_interval_ms"].is_null());
  EXPECT_EQ(cameras[1]["delivery"]["late"], 3);
  EXPECT_EQ(cameras[1]["delivery"]["latency_ms"], 12.5);
}

}  // namespace
}  // namespace docent::app
