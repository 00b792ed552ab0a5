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

using ::testing::AllOf;
using ::testing::Each;
using ::testing::Eq;
using ::testing::SizeIs;

// A grid of pixels over the image of a simulated camera.
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

TrueDepths MeasureDepths(const std::shared_ptr<const Simulation>& simulation, int frame,
                         const std::vector<Eigen::Vector2f>& pixels, const std::vector<TimedPose>& truth) {
  TrueDepthOptions options;
  options.max_duration = std::chrono::seconds(1);
  options.truth_noise_m = 0.001;
  CalibratedCamera camera =
      Calibrate(WindowOf(OpenSimulation(simulation), static_cast<std::uint64_t>(frame), {}), std::nullopt);
  return MeasureTrueDepths(&camera, truth, pixels, options);
}

TEST(TrueDepth, IsMeasuredByTrackingPixelsWithTheTruePoses) {
  const std::shared_ptr<const Simulation> simulation = MakeSimulation("room");
  constexpr int kFrame = 5;
  const auto pixels = Grid(simulation->camera());
  const TrueDepths known = SimulatedTrueDepths(*simulation, kFrame, pixels);
  const TrueDepths measured = MeasureDepths(simulation, kFrame, pixels, GroundTruthOf(*simulation));
  const std::vector<double> errors = RelativeErrors(measured, known);
  ASSERT_GT(errors.size(), pixels.size() / 3);
  EXPECT_LT(errors[errors.size() / 2], 0.05);
  // The reported uncertainty must hold: two standard deviations plus 5 % for the error of the optical flow.
  int within = 0, counted = 0;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    if (!measured[i] || !known[i]) continue;
    ++counted;
    within += std::abs(measured[i]->inverse - known[i]->inverse) <
              2 * measured[i]->sigma + 0.05 * known[i]->inverse;
  }
  EXPECT_GT(within, 0.8 * counted);
}

TEST(TrueDepth, IsRobustToOrientationErrorsOfTheGroundTruth) {
  const std::shared_ptr<const Simulation> simulation = MakeSimulation("room");
  constexpr int kFrame = 5;
  const auto pixels = Grid(simulation->camera());
  std::vector<TimedPose> truth = GroundTruthOf(*simulation);
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const double error = 0.005 * std::sin(0.7 * static_cast<double>(i));  // 0.3 degrees
    truth[i].truth_from_camera.rotation =
        truth[i].truth_from_camera.rotation * engine::Rotation3::Exp({error, -error, 0.5 * error});
  }
  const auto errors = RelativeErrors(MeasureDepths(simulation, kFrame, pixels, truth),
                                     SimulatedTrueDepths(*simulation, kFrame, pixels));
  ASSERT_GT(errors.size(), pixels.size() / 3);
  EXPECT_LT(errors[errors.size() / 2], 0.1);
}

TEST(TrueDepth, IsUnknownWithoutTranslation) {
  const std::shared_ptr<const Simulation> simulation = MakeSimulation("room");
  const auto pixels = Grid(simulation->camera());
  std::vector<TimedPose> truth = GroundTruthOf(*simulation);
  for (TimedPose& pose : truth) pose.truth_from_camera.translation = truth[0].truth_from_camera.translation;
  const auto all_unknown = AllOf(SizeIs(pixels.size()), Each(Eq(std::nullopt)));
  EXPECT_THAT(MeasureDepths(simulation, 5, pixels, truth), all_unknown);
  EXPECT_THAT(MeasureDepths(simulation, 5, pixels, {}), all_unknown) << "without ground truth";
}

TEST(TrueDepth, RejectsInvalidOptions) {
  TrueDepthOptions options;
  EXPECT_FALSE(options.Validate());
  options.truth_noise_m = -1;
  EXPECT_TRUE(options.Validate());
  CalibratedCamera camera;
  EXPECT_THROW(MeasureTrueDepths(&camera, {}, {}, options), Error);
}

}  // namespace
}  // namespace docent::app
