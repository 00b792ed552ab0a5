// SPDX-License-Identifier: Apache-2.0
#include "engine/system/calibration_monitor.h"

#include <gmock/gmock.h>

#include <chrono>
#include <cmath>
#include <optional>

#include "app/session/session.h"
#include "app/simulator/simulation.h"
#include "engine/base/random.h"

namespace docent::app {
namespace {

using engine::CameraModel;
using engine::LensModel;
using ::testing::HasSubstr;

// Frames of a camera that rotates in front of a wall of points. Each point is found `outwards_px(radius)`
// farther from the principal point than predicted, with noise.
class Wall {
 public:
  explicit Wall(std::shared_ptr<const CameraModel> camera) : camera_(std::move(camera)) {
    auto map = std::make_shared<engine::MapSnapshot>();
    Random random(5);
    for (engine::MapPointId id = 0; id < 3000; ++id) {
      engine::MapPoint& point = map->points.emplace_back();
      point.id = id;
      point.point_in_map << random.Uniform(-4, 4), random.Uniform(-3, 3), random.Uniform(1.8, 2.2), 1;
    }
    map_ = map;
  }

  template <typename Outwards>
  engine::TrackedFrame Next(const Outwards& outwards_px, double turned_rad, double noise_px = 0.7) {
    engine::TrackedFrame frame;
    frame.state = engine::TrackingState::kSixDof;
    frame.quality_class = engine::TrackingQuality::kGood;
    frame.map = map_;
    frame.camera_from_map.rotation = engine::Rotation3::Exp({0, turned_rad, 0});
    const Eigen::Vector2d center(camera_->intrinsics().cx, camera_->intrinsics().cy);
    for (const engine::MapPoint& point : map_->points) {
      const auto pixel = camera_->Project(frame.camera_from_map * point.position());
      if (!pixel || !camera_->IsInside(*pixel, 4)) continue;
      const double radius = (*pixel - center).norm();
      const Eigen::Vector2d found =
          *pixel + outwards_px(radius) / radius * (*pixel - center) +
          noise_px * Eigen::Vector2d(random_.Uniform(-1, 1), random_.Uniform(-1, 1));
      frame.matches.push_back({point.id, found.cast<float>(), 0, true});
    }
    return frame;
  }

 private:
  const std::shared_ptr<const CameraModel> camera_;
  std::shared_ptr<const engine::MapSnapshot> map_;
  Random random_{9};
};

std::shared_ptr<const CameraModel> Lens() {
  return std::make_shared<CameraModel>(SimulatedCamera());
}

TEST(CalibrationMonitor, MeasuresTheErrorOfEachRing) {
  engine::CalibrationMonitor monitor(Lens());
  Wall wall(Lens());
  for (int i = 0; i < 400; ++i)
    monitor.Add(wall.Next([](double radius) { return radius < 200 ? -0.3 : 0.4; }, 0.3 * std::sin(i)));
  EXPECT_NEAR(monitor.profile()[1].mean_px, -0.3, 0.03);
  EXPECT_NEAR(monitor.profile()[4].mean_px, 0.4, 0.03);
  EXPECT_GE(monitor.profile()[1].samples, 90u);
  EXPECT_LE(monitor.profile()[1].samples, 134u) << "one frame in three is sampled";
}

TEST(CalibrationMonitor, ReportsAConsistentPatternOnce) {
  engine::CalibrationMonitor monitor(Lens());
  Wall wall(Lens());
  int warnings = 0;
  for (int i = 0; i < 800; ++i) {
    monitor.Add(wall.Next([](double radius) { return radius < 200 ? -0.5 : 0.6; }, 0.3 * std::sin(i)));
    const auto mismatch = monitor.TakeMismatch();
    if (!mismatch) continue;
    ++warnings;
    EXPECT_NEAR(mismatch->outward_px, 0.6, 0.1);
    EXPECT_NEAR(mismatch->inward_px, 0.5, 0.1);
    EXPECT_GT(mismatch->outward_radius_px, 200);
    EXPECT_LT(mismatch->inward_radius_px, 200);
  }
  EXPECT_EQ(warnings, 1);
}

TEST(CalibrationMonitor, DoesNotWarnAboutNoiseOrErrorsOfAlternatingSign) {
  engine::CalibrationMonitor monitor(Lens());
  Wall wall(Lens());
  for (int i = 0; i < 800; ++i) {
    const double sign = i / 3 % 2 == 0 ? 1 : -1;
    monitor.Add(
        wall.Next([&](double radius) { return sign * (radius < 200 ? -1.0 : 1.0); }, 0.3 * std::sin(i), 2.5));
  }
  EXPECT_FALSE(monitor.TakeMismatch());
}

TEST(CalibrationMonitor, SamplesAStationaryCameraOnlyOnce) {
  engine::CalibrationMonitor monitor(Lens());
  Wall wall(Lens());
  for (int i = 0; i < 400; ++i) monitor.Add(wall.Next([](double) { return 0.0; }, 0.001 * i / 400));
  EXPECT_EQ(monitor.profile()[2].samples, 1u);
}

// Runs the simulated walk around the table with an assumed camera model instead of the true one. Returns the
// warnings about the calibration, up to two seconds after the first.
std::vector<std::string> WarningsWith(const CameraModel& assumed) {
  SimulationOptions simulated;
  simulated.frame_rate_hz = 15;
  const auto simulation = MakeSimulation("hand", simulated);
  SessionOptions options;
  options.threaded = false;
  options.first_map = "table";
  Session session(options, {std::make_shared<CameraModel>(assumed)}, nullptr);
  std::vector<std::string> warnings;
  std::optional<Timestamp> enough;
  for (int i = 0; i < simulation->frame_count() && (!enough || simulation->time(i) < *enough); ++i) {
    engine::Frame frame;
    frame.time = simulation->time(i);
    frame.index = static_cast<std::uint64_t>(i);
    simulation->Render(i, &frame.image);
    const auto tracked = session.Process(frame);
    for (const Event& event : session.TakeEvents()) {
      if (event.event != "warning" || event.detail.find("calibration") == std::string::npos) continue;
      warnings.push_back(event.detail);
      enough = frame.time + std::chrono::seconds(2);
      EXPECT_THAT(session.ShownWith(tracked).advice, testing::HasSubstr("docent calibrate"))
          << "authors must read it on the screen";
    }
  }
  return warnings;
}

CameraModel HandLens() {
  return MakeSimulation("hand")->camera();
}

TEST(CalibrationMonitor, DoesNotWarnWithTheCorrectCalibration) {
  EXPECT_TRUE(WarningsWith(HandLens()).empty());
}

TEST(CalibrationMonitor, WarnsAboutAFocalLengthThatIsFivePercentOff) {
  for (const double factor : {0.95, 1.05}) {
    const CameraModel right = HandLens();
    CameraModel::Intrinsics intrinsics = right.intrinsics();
    intrinsics.fx *= factor;
    intrinsics.fy *= factor;
    EXPECT_EQ(WarningsWith({right.lens(), intrinsics, right.distortion()}).size(), 1u) << factor;
  }
}

TEST(CalibrationMonitor, WarnsAboutMissingDistortion) {
  const CameraModel right = HandLens();
  EXPECT_EQ(WarningsWith({LensModel::kRadialTangential, right.intrinsics(), {}}).size(), 1u);
}

}  // namespace
}  // namespace docent::app
