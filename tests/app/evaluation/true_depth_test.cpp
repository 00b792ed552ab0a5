// SPDX-License-Identifier: Apache-2.0
#include "app/evaluation/true_depth.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "app/cameras/clipped_source.h"
#include "app/cameras/simulated_source.h"
#include "app/evaluation/simulated_truth.h"
#include "engine/base/error.h"

namespace docent::app {
namespace {

// A grid over the image of a simulated camera.
std::vector<Eigen::Vector2f> Grid(const engine::CameraModel& camera) {
  std::vector<Eigen::Vector2f> pixels;
  for (int x = 1; x < 14; ++x) {
    for (int y = 1; y < 10; ++y)
      pixels.emplace_back(camera.width_px() * x / 14.0F, camera.height_px() * y / 10.0F);
  }
  return pixels;
}

std::vector<double> RelativeErrors(const TrueDepths& measured, const TrueDepths& known) {
  std::vector<double> errors;
  for (std::size_t i = 0; i < measured.size(); ++i) {
    if (measured[i] && known[i]) errors.push_back(std::abs(measured[i]->inverse / known[i]->inverse - 1));
  }
  std::sort(errors.begin(), errors.end());
  return errors;
}

TrueDepths Follow(const std::shared_ptr<const Simulation>& simulation, int frame,
                  const std::vector<Eigen::Vector2f>& pixels, const std::vector<TimedPose>& truth) {
  TrueDepthOptions options;
  options.longest = std::chrono::seconds(1);
  options.truth_noise_m = 0.001;
  CalibratedCamera camera =
      Calibrate(WindowOf(OpenSimulation(simulation), static_cast<std::uint64_t>(frame), {}), std::nullopt);
  return FollowTrueDepths(&camera, truth, pixels, options);
}

TEST(TrueDepth, IsFoundByFollowingPixelsWithTheTruePoses) {
  const std::shared_ptr<const Simulation> simulation = MakeSimulation("room");
  constexpr int kFrame = 5;
  const auto pixels = Grid(simulation->camera());
  const TrueDepths known = SimulatedTrueDepths(*simulation, kFrame, pixels);
  const TrueDepths measured = Follow(simulation, kFrame, pixels, GroundTruthOf(*simulation));
  const std::vector<double> errors = RelativeErrors(measured, known);
  ASSERT_GT(errors.size(), pixels.size() / 3);
  EXPECT_LT(errors[errors.size() / 2], 0.05);
  // What it says of its own error must hold: two standard deviations and the flow's own error.
  int within = 0, counted = 0;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    if (!measured[i] || !known[i]) continue;
    ++counted;
    within += std::abs(measured[i]->inverse - known[i]->inverse) <
              2 * measured[i]->sigma + 0.05 * known[i]->inverse;
  }
  EXPECT_GT(within, 0.8 * counted);
}

TEST(TrueDepth, DoesNotHangOnTheOrientationsOfTheTruth) {
  const std::shared_ptr<const Simulation> simulation = MakeSimulation("room");
  constexpr int kFrame = 5;
  const auto pixels = Grid(simulation->camera());
  std::vector<TimedPose> truth = GroundTruthOf(*simulation);
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const double error = 0.005 * std::sin(0.7 * static_cast<double>(i));  // 0.3 degrees
    truth[i].truth_from_camera.rotation =
        truth[i].truth_from_camera.rotation * engine::Rotation3::Exp({error, -error, 0.5 * error});
  }
  const auto errors = RelativeErrors(Follow(simulation, kFrame, pixels, truth),
                                     SimulatedTrueDepths(*simulation, kFrame, pixels));
  ASSERT_GT(errors.size(), pixels.size() / 3);
  EXPECT_LT(errors[errors.size() / 2], 0.1);
}

TEST(TrueDepth, IsUnknownToACameraThatHasNotMoved) {
  const std::shared_ptr<const Simulation> simulation = MakeSimulation("room");
  const auto pixels = Grid(simulation->camera());
  std::vector<TimedPose> truth = GroundTruthOf(*simulation);
  for (TimedPose& pose : truth) pose.truth_from_camera.translation = truth[0].truth_from_camera.translation;
  for (const auto& depth : Follow(simulation, 5, pixels, truth)) EXPECT_FALSE(depth);
  for (const auto& depth : Follow(simulation, 5, pixels, {})) EXPECT_FALSE(depth) << "without a truth";
}

TEST(TrueDepth, RefusesOptionsThatMakeNoSense) {
  TrueDepthOptions options;
  EXPECT_FALSE(options.Validate());
  options.truth_noise_m = -1;
  EXPECT_TRUE(options.Validate());
  CalibratedCamera camera;
  EXPECT_THROW(FollowTrueDepths(&camera, {}, {}, options), Error);
}

}  // namespace
}  // namespace docent::app
