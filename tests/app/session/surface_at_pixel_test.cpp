// SPDX-License-Identifier: Apache-2.0
#include "app/session/surface_at_pixel.h"

#include <gtest/gtest.h>

#include <cmath>
#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/random.h"
#include "engine/geometry/sim3.h"
#include "tests/app/support/simulated_session.h"

namespace docent::app {
namespace {

using namespace simulated_session;

// The scale of a growing map: world metres per map unit, from the camera's path of the last two seconds.
class MapScale {
 public:
  void Add(const Eigen::Vector3d& in_world, const Eigen::Vector3d& in_map) {
    constexpr std::size_t kImages = 60;
    in_world_.push_back(in_world);
    in_map_.push_back(in_map);
    if (in_world_.size() <= kImages) return;
    in_world_.pop_front();
    in_map_.pop_front();
    const auto world_from_map = engine::AlignSim3(std::vector(in_world_.begin(), in_world_.end()),
                                                  std::vector(in_map_.begin(), in_map_.end()));
    if (world_from_map) metres_per_unit_ = world_from_map->scale;
  }
  std::optional<double> metres_per_unit() const { return metres_per_unit_; }

 private:
  std::deque<Eigen::Vector3d> in_world_, in_map_;
  std::optional<double> metres_per_unit_;
};

// Distances that are found at random pixels while a map of a museum is built, divided by the true ones.
std::vector<double> FoundDistances(int* asked) {
  const auto simulation = Room(15);
  CalibratedCamera camera = CameraOf(simulation);
  Session session(Options(Pace::kLockstep, "Bay"), {camera.model}, nullptr);
  FrameLoopOptions loop;
  loop.pace = Pace::kLockstep;
  MapScale scale;
  Random random(7);
  std::vector<double> ratios;
  int image = -1;
  const auto ask = [&](const engine::TrackedFrame& frame) {
    const Eigen::Vector3d from = simulation->world_from_camera(++image).translation;
    if (!engine::HasPose(frame.state) || frame.finite_points == 0) return;
    scale.Add(from, frame.camera_from_map.OriginInSource());
    constexpr int kEvery = 15, kPixels = 20, kMargin_px = 20;
    if (!scale.metres_per_unit() || image % kEvery != 0) return;
    for (int i = 0; i < kPixels; ++i) {
      const Eigen::Vector2d pixel(random.Uniform(kMargin_px, camera.model->width_px() - kMargin_px),
                                  random.Uniform(kMargin_px, camera.model->height_px() - kMargin_px));
      const auto truth = simulation->SurfaceAt(image, pixel);
      if (!truth) continue;
      ++*asked;
      try {
        const content::SurfaceHit hit = SurfaceAtPixel(frame, *camera.model, pixel);
        const double found = (hit.point - frame.camera_from_map.OriginInSource()).norm();
        ratios.push_back(found * *scale.metres_per_unit() / (*truth - from).norm());
      } catch (const Error&) {
        // Nothing is placed there, and the author is told why.
      }
    }
  };
  RunFrames(&camera, &session, loop, ask, {});
  session.Finish();
  return ratios;
}

// Measured in four simulated scenes at 6,025 random pixels: 6 to 11 % are wrong by more than a tenth, in the
// median 0.3 to 0.4 %. Where the images of keyframes tell the distance, at 80 to 90 % of the pixels, 1.5 to 3
// % are; elsewhere, where only map points do, 37 to 48 %.
TEST(SurfaceAtPixel, IsWithinATenthOfTheTrueDistanceAtMostPixels) {
  int asked = 0, within = 0;
  const std::vector<double> ratios = FoundDistances(&asked);
  ASSERT_GE(asked, 300);
  EXPECT_GE(static_cast<double>(ratios.size()), 0.95 * asked);
  for (const double ratio : ratios) within += std::abs(ratio - 1) < 0.1;
  RecordProperty("asked", asked);
  RecordProperty("within_a_tenth", within);
  EXPECT_GE(within, 0.85 * static_cast<double>(ratios.size()));
}

}  // namespace
}  // namespace docent::app
