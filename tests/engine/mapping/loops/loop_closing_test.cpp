// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/loops/loop_closing.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "engine/mapping/mapper.h"
#include "engine/vision/features.h"
#include "tests/engine/geometry/test_math.h"
#include "tests/engine/mapping/true_pair.h"
#include "tests/engine/rendered_world.h"

// A camera goes around a room, looking outwards, with a calibration that is wrong by two per cent. When it
// returns, the map is off by some degrees and contains the beginning twice (ptamm §6.2, Fig. 15).
namespace docent::engine {
namespace {

using testing_world::CameraAt;
using testing_world::PaintedWall;
using testing_world::RenderedWorld;
using testing_world::Wall;

constexpr double kStep_deg = 6;
constexpr int kRound = 60;
constexpr double kRadius = 0.8;

const std::shared_ptr<const CameraModel>& TrueCamera() {
  static const auto camera = testing_world::PinholeCamera(400, 300);
  return camera;
}
const std::shared_ptr<const CameraModel>& BelievedCamera() {
  static const auto camera = [] {
    CameraModel::Intrinsics intrinsics{400, 300, 252 * 1.02, 252 * 1.02, 199.5, 149.5};
    return std::make_shared<const CameraModel>(LensModel::kRadialTangential, intrinsics,
                                               std::array<double, 5>{});
  }();
  return camera;
}

// Four walls, each with a smaller one in front of it.
const RenderedWorld& Hall() {
  static const RenderedWorld hall = [] {
    std::vector<Wall> walls;
    for (int side = 0; side < 4; ++side) {
      const double yaw = side * kPi / 2;
      const Eigen::Vector3d out(std::sin(yaw), 0, std::cos(yaw)), right(std::cos(yaw), 0, -std::sin(yaw)),
          down(0, 1, 0);
      const auto seed = static_cast<std::uint64_t>(side);
      walls.push_back(PaintedWall(2.6 * out, right, down, 2.6, 1.8, 100 + seed));
      walls.push_back(
          PaintedWall(2.0 * out + (side % 2 == 0 ? 0.9 : -0.7) * right + Eigen::Vector3d(0, 0.3, 0), right,
                      down, 0.45, 0.5, 200 + seed));
    }
    return RenderedWorld(std::move(walls));
  }();
  return hall;
}

Rigid3 OnTheRound(int step) {
  const double angle = Radians(step * kStep_deg);
  return CameraAt({kRadius * std::sin(angle), 0, kRadius * std::cos(angle)}, {0, step * kStep_deg, 0});
}

// The result of a walk: the map after each step, and the loops that were closed.
struct MappedWalk {
  std::vector<std::shared_ptr<const MapSnapshot>> maps;
  std::vector<ClosedLoop> loops;
};

// Each keyframe is offered at the pose of the last one in the map, moved by the true step.
MappedWalk GoAlong(const RenderedWorld& world, const std::vector<Rigid3>& poses, const MapperOptions& options,
                   const std::shared_ptr<const CameraModel>& assumed_camera) {
  MappedWalk walk;
  Mapper mapper(options);
  InitialPair pair = testing_world::TruePair(world, *TrueCamera(), assumed_camera, poses[0], poses[1], 250);
  pair.b.time = FromSeconds(1);
  pair.baseline_m = (poses[1] * poses[0].inverse()).translation.norm();
  mapper.Start(std::move(pair));
  mapper.Step();
  for (std::size_t i = 2; i < poses.size(); ++i) {
    const auto map = mapper.Snapshot();
    if (!map) break;
    KeyFrameCandidate candidate;
    candidate.time = FromSeconds(static_cast<double>(i));
    candidate.camera = assumed_camera;
    candidate.features = MakeFeatures(world.Render(*TrueCamera(), poses[i], 1.5, i));
    candidate.camera_from_map = poses[i] * poses[i - 1].inverse() * map->keyframes.back().camera_from_map;
    candidate.map_revision = map->revision;
    candidate.reference_keyframe = map->keyframes.back().id;
    mapper.Offer(std::move(candidate));
    for (int step = 0; step < 200 && mapper.Step(); ++step) {
    }
    walk.maps.push_back(mapper.Snapshot());
    for (const MapperEvent& event : mapper.TakeEvents()) {
      if (const auto* const closed = std::get_if<MapperEvent::LoopClosed>(&event.what))
        walk.loops.push_back(closed->loop);
    }
  }
  return walk;
}

std::vector<Rigid3> Round(int steps) {
  std::vector<Rigid3> poses;
  for (int step = 0; step < steps; ++step) poses.push_back(OnTheRound(step));
  return poses;
}

const KeyFrame& KeyFrameAtTime(const MapSnapshot& map, double seconds) {
  return *std::find_if(map.keyframes.begin(), map.keyframes.end(),
                       [&](const KeyFrame& keyframe) { return keyframe.time == FromSeconds(seconds); });
}

// The error of the map after a full round, between the keyframe and the keyframe at the same place one round
// earlier. Degrees, and map units.
struct Gap {
  double rotation_deg, distance;
};
Gap GapAfterARound(const MapSnapshot& map, int step) {
  const Rigid3 now = KeyFrameAtTime(map, kRound + step).camera_from_map,
               then = KeyFrameAtTime(map, step).camera_from_map;
  return {RotationErrorDeg(now, then), (now.OriginInSource() - then.OriginInSource()).norm()};
}

MapperOptions WithLoops(bool enabled) {
  MapperOptions options;
  options.loops.enabled = enabled;
  options.culling.min_keyframes = 1000;  // keep all, for comparison
  return options;
}

const MappedWalk& ClosedWalk() {
  static const MappedWalk walk = GoAlong(Hall(), Round(kRound + 6), WithLoops(true), BelievedCamera());
  return walk;
}

TEST(LoopClosing, WithoutItTheMapContainsTheBeginningTwice) {
  const MappedWalk walk = GoAlong(Hall(), Round(kRound + 6), WithLoops(false), BelievedCamera());
  const Gap gap = GapAfterARound(*walk.maps.back(), 4);
  EXPECT_GT(gap.rotation_deg, 2.0);
  EXPECT_TRUE(walk.loops.empty());
}

TEST(LoopClosing, CorrectsTheMapWhenTheCameraReturns) {
  const MappedWalk& walk = ClosedWalk();
  ASSERT_EQ(walk.loops.size(), 1u);
  const ClosedLoop& loop = walk.loops[0];
  EXPECT_GT(loop.keyframe, loop.place);
  EXPECT_GT(loop.rotation * 180 / std::numbers::pi, 1) << "the error without loop closing is above 2 degrees";
  EXPECT_GT(loop.drift, 0);
  EXPECT_GT(loop.fused, 0);
  EXPECT_LE(loop.found, static_cast<std::size_t>(loop.expected));
  const MapSnapshot& map = *walk.maps.back();
  EXPECT_EQ(Validate(map), "");
  const Gap gap = GapAfterARound(map, 4);
  EXPECT_LT(gap.rotation_deg, 0.25);
  EXPECT_LT(gap.distance, 0.03);
  // The whole round agrees with the true poses, in the first keyframe's frame.
  for (int step = 0; step < kRound; step += 6) {
    const Rigid3 estimated = KeyFrameAtTime(map, step).camera_from_map,
                 truth = OnTheRound(step) * OnTheRound(0).inverse();
    EXPECT_LT(RotationErrorDeg(estimated, truth), 1.5) << "step " << step;
  }
  // Duplicates are fused: keyframes of both rounds observe the same points.
  Map linked(map);
  int shared = 0;
  for (const auto& [id, count] : linked.Covisible(KeyFrameAtTime(map, kRound + 4).id)) {
    if (id == KeyFrameAtTime(map, 4).id) shared = count;
  }
  EXPECT_GE(shared, 60);
}

TEST(LoopClosing, RecordsTheCorrectionForHoldersOfPoses) {
  const MappedWalk& walk = ClosedWalk();
  const auto moved = std::find_if(walk.maps.begin(), walk.maps.end(),
                                  [](const auto& map) { return !map->corrections.empty(); });
  ASSERT_NE(moved, walk.maps.end());
  ASSERT_NE(moved, walk.maps.begin());
  const MapSnapshot &before = **(moved - 1), &after = **moved;
  const MapCorrection& correction = *after.corrections.back();
  EXPECT_GT(correction.revision, before.revision);
  EXPECT_LE(correction.revision, after.revision);
  // A camera that stood at the newest keyframe of the map before moves to where that keyframe is now.
  const KeyFrame& newest = before.keyframes.back();
  const Rigid3 carried = CorrectedPose(newest.camera_from_map, correction.after_from_before.at(newest.id));
  const Rigid3 now = after.FindKeyFrame(newest.id)->camera_from_map;
  // The adjustments afterwards move the keyframe slightly, too.
  EXPECT_LT(RotationErrorDeg(carried, now), 1.0);
  EXPECT_GT(RotationErrorDeg(newest.camera_from_map, now), 2.0);
}

TEST(LoopClosing, NeverClosesALoopBetweenSimilarPlaces) {
  // One pattern repeats along a wall, so the view is the same every two metres.
  const Wall panel = PaintedWall({0, 0, 1.3}, {1, 0, 0}, {0, 1, 0}, 1.0, 1.2, 7);
  const Wall stand = PaintedWall({0.3, 0.2, 1.0}, {1, 0, 0}, {0, 1, 0}, 0.2, 0.25, 8);
  std::vector<Wall> walls;
  for (int i = -1; i < 6; ++i) {
    for (Wall wall : {panel, stand}) {
      wall.center.x() += 2.0 * i;
      walls.push_back(std::move(wall));
    }
  }
  std::vector<Rigid3> poses;
  for (int i = 0; i < 42; ++i) poses.push_back(CameraAt({0.18 * i, 0.02 * std::sin(i), 0}));
  MapperOptions options = WithLoops(true);
  const MappedWalk walk = GoAlong(RenderedWorld(walls), poses, options, TrueCamera());
  ASSERT_EQ(walk.maps.size(), 40u);
  EXPECT_TRUE(walk.loops.empty()) << "keyframe " << walk.loops.front().keyframe;
  // Such loops are rejected because the implied error is implausible, or because the map would have to be
  // bent. If any error were accepted, false loops would be closed.
  options.loops.detector.max_translation = 10;
  EXPECT_TRUE(GoAlong(RenderedWorld(walls), poses, options, TrueCamera()).loops.empty());
  options.loops.correction.max_loop_residual = options.loops.correction.max_edge_residual = 10;
  EXPECT_FALSE(GoAlong(RenderedWorld(walls), poses, options, TrueCamera()).loops.empty());
}

}  // namespace
}  // namespace docent::engine
