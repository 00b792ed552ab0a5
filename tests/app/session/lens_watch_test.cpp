// SPDX-License-Identifier: Apache-2.0
#include "app/session/lens_watch.h"

#include <gmock/gmock.h>

#include <cmath>

#include "app/simulator/simulation.h"
#include "engine/base/random.h"

namespace docent::app {
namespace {

using engine::CameraModel;
using ::testing::HasSubstr;

// A frame of a camera that turns before a wall of points, found `outwards_px(radius)` farther from the middle
// than they are expected, with noise.
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
    const Eigen::Vector2d middle(camera_->intrinsics().cx, camera_->intrinsics().cy);
    for (const engine::MapPoint& point : map_->points) {
      const auto pixel = camera_->Project(frame.camera_from_map * point.position());
      if (!pixel || !camera_->IsInside(*pixel, 4)) continue;
      const double radius = (*pixel - middle).norm();
      const Eigen::Vector2d found =
          *pixel + outwards_px(radius) / radius * (*pixel - middle) +
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

TEST(LensWatch, MeasuresTheErrorOfEachRing) {
  LensWatch watch(Lens());
  Wall wall(Lens());
  for (int i = 0; i < 400; ++i)
    watch.Add(wall.Next([](double radius) { return radius < 200 ? -0.3 : 0.4; }, 0.3 * std::sin(i)));
  EXPECT_NEAR(watch.profile()[1].mean_px, -0.3, 0.03);
  EXPECT_NEAR(watch.profile()[4].mean_px, 0.4, 0.03);
  EXPECT_GE(watch.profile()[1].samples, 60u);
  EXPECT_LE(watch.profile()[1].samples, 80u) << "one frame in five is enough";
}

TEST(LensWatch, TellsOfAPatternOnceAndWhatToDo) {
  LensWatch watch(Lens());
  Wall wall(Lens());
  int told = 0;
  for (int i = 0; i < 800; ++i) {
    watch.Add(wall.Next([](double radius) { return radius < 200 ? -0.5 : 0.6; }, 0.3 * std::sin(i)));
    const auto warning = watch.TakeWarning();
    if (!warning) continue;
    ++told;
    EXPECT_THAT(*warning, HasSubstr("docent calibrate"));
  }
  EXPECT_EQ(told, 1);
}

TEST(LensWatch, IsSilentAboutNoiseAndAboutErrorsThatChangeTheirSign) {
  LensWatch watch(Lens());
  Wall wall(Lens());
  for (int i = 0; i < 800; ++i) {
    const double sign = i / 5 % 2 == 0 ? 1 : -1;
    watch.Add(
        wall.Next([&](double radius) { return sign * (radius < 200 ? -1.0 : 1.0); }, 0.3 * std::sin(i), 2.5));
  }
  EXPECT_FALSE(watch.TakeWarning());
}

TEST(LensWatch, TakesNoPictureOfACameraThatStandsStillTwice) {
  LensWatch watch(Lens());
  Wall wall(Lens());
  for (int i = 0; i < 400; ++i) watch.Add(wall.Next([](double) { return 0.0; }, 0.001 * i / 400));
  EXPECT_EQ(watch.profile()[2].samples, 1u);
}

}  // namespace
}  // namespace docent::app
