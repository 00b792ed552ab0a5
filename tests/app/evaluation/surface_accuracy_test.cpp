// SPDX-License-Identifier: Apache-2.0
#include "tests/app/support/surface_accuracy.h"

#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "engine/base/error.h"
#include "tests/app/support/simulated_map.h"
#include "tests/support/must_run.h"
#include "ui/context.h"

namespace docent::app {
namespace {

// The simulated table, and a map of it without error. The limits are what was measured, with a margin.
class SurfaceAccuracy : public ::testing::Test {
 protected:
  SurfaceAccuracy() {
    SimulationOptions options;
    options.duration_s = 8;
    simulation_ = MakeSimulation("room", options);
    frames_ = EvenlySpacedFrames(*simulation_, 14);
    map_ = SimulatedMap(*simulation_, frames_);
  }

  std::unique_ptr<Simulation> simulation_;
  std::vector<int> frames_;
  std::shared_ptr<const engine::MapSnapshot> map_;
};

TEST_F(SurfaceAccuracy, DepthIsTrueWhereTwoKeyFramesSeeASurface) {
  const DepthFigures figures = MeasureDepthMaps(*simulation_, map_, frames_, {});
  EXPECT_GT(figures.Completeness(), 0.90) << "measured: 0.916";
  EXPECT_GT(figures.Accuracy(), 0.92) << "measured: 0.932";
}

TEST_F(SurfaceAccuracy, SurfacesHideTheContentBehindThemAndNoOther) {
  std::unique_ptr<ui::OffscreenContext> context;
  try {
    context = std::make_unique<ui::OffscreenContext>();
  } catch (const Error& error) {
    SKIP_OR_FAIL(error.what());
  }
  ui::Renderer renderer;
  const auto mesh = engine::DensifyMap(map_);
  ASSERT_TRUE(mesh);
  const DepthFigures depth = MeasureMesh(*simulation_, map_, mesh->mesh, 3, frames_, {});
  EXPECT_GT(depth.Completeness(), 0.93) << "measured: 0.957";
  EXPECT_GT(depth.Accuracy(), 0.95) << "measured: 0.969";
  const auto surfaces = std::make_shared<const engine::SurfaceMesh>(mesh->mesh);
  OcclusionFigures figures, without;
  for (std::size_t i = 0; i + 1 < frames_.size(); i += 2) {
    const int frame = (frames_[i] + frames_[i + 1]) / 2;  // Between two keyframes.
    const engine::Rigid3 camera_from_map = simulation_->world_from_camera(frame).inverse();
    AddOcclusion(*simulation_, frame, camera_from_map, 1, frames_, surfaces, &renderer, &figures, nullptr);
    AddFlicker(*simulation_, frame, {camera_from_map, simulation_->world_from_camera(frame + 1).inverse()}, 1,
               surfaces, &renderer, &figures);
    if (i == 0)
      AddOcclusion(*simulation_, frame, camera_from_map, 1, frames_, nullptr, &renderer, &without, nullptr);
  }
  EXPECT_EQ(without.hidden, 0U) << "nothing is hidden without surfaces";
  EXPECT_GT(figures.HiddenShare(), 0.95) << "measured: 0.968";
  EXPECT_LT(figures.WronglyHiddenShare(), 0.01) << "measured: 0.003";
  EXPECT_LT(figures.MedianEdgeError_px(), 1.5) << "measured: 1.0";
}

}  // namespace
}  // namespace docent::app
