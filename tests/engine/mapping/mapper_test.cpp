// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/mapper.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "engine/vision/features.h"
#include "tests/engine/initialization/rolled_scene.h"
#include "tests/engine/mapping/true_pair.h"
#include "tests/engine/rendered_world.h"

namespace docent::engine {
namespace {

using testing_world::CameraAt;
using testing_world::RenderedWorld;

// Metres: the mapper's own unit, so that its map has the scale of the world.
constexpr double kBaseline = 0.1;

const std::shared_ptr<const CameraModel>& MapperCamera() {
  static const auto camera = testing_world::PinholeCamera(400, 300);
  return camera;
}

InitialPair FirstPair(const RenderedWorld& world, std::size_t max_matches) {
  InitialPair pair = testing_world::TruePair(world, *MapperCamera(), MapperCamera(), CameraAt({0, 0, 0}),
                                             CameraAt({kBaseline, 0, 0}), max_matches);
  pair.b.time = FromSeconds(0.5);
  return pair;
}

// A frame with a perfect pose in the mapper's map, whose coordinate frame is that of the first view.
KeyFrameCandidate TrueCandidate(const RenderedWorld& world, const MapSnapshot& map, const Rigid3& pose,
                                double seconds) {
  KeyFrameCandidate candidate;
  candidate.time = FromSeconds(seconds);
  candidate.camera = MapperCamera();
  candidate.features =
      MakeFeatures(world.Render(*MapperCamera(), pose, 1.5, static_cast<std::uint64_t>(1000 * seconds)));
  candidate.camera_from_map = pose;
  for (const MapPoint& point : map.points) {
    const auto pixel = MapperCamera()->Project(pose * point.position());
    if (pixel && MapperCamera()->IsInside(*pixel, 10) && point.id % 2 == 0)
      candidate.matches.push_back({point.id, pixel->cast<float>(), point.source_level, true});
  }
  return candidate;
}

template <typename What>
int CountEvents(Mapper* mapper) {
  const auto events = mapper->TakeEvents();
  return static_cast<int>(std::count_if(events.begin(), events.end(), [](const MapperEvent& event) {
    return std::holds_alternative<What>(event.what);
  }));
}

void WorkUntilIdle(Mapper* mapper) {
  for (int step = 0; step < 200 && mapper->Step(); ++step) {
  }
}

class MapperTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    world_ = new RenderedWorld(RenderedWorld::Room(61));
    pair_ = new InitialPair(FirstPair(*world_, 250));
    Mapper mapper({});
    mapper.Start(*pair_);
    mapper.Step();
    started_ = mapper.Snapshot();
  }
  static void TearDownTestSuite() {
    delete world_;
    delete pair_;
    world_ = nullptr;
    pair_ = nullptr;
    started_.reset();
  }
  static double MedianDistanceToSurface(const MapSnapshot& map) {
    std::vector<double> distances;
    for (const MapPoint& point : map.points) distances.push_back(world_->DistanceToSurface(point.position()));
    const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
    std::nth_element(distances.begin(), middle, distances.end());
    return *middle;
  }

  static RenderedWorld* world_;
  static InitialPair* pair_;
  static std::shared_ptr<const MapSnapshot> started_;
};
RenderedWorld* MapperTest::world_ = nullptr;
InitialPair* MapperTest::pair_ = nullptr;
std::shared_ptr<const MapSnapshot> MapperTest::started_;

TEST_F(MapperTest, StartsAMapFromTwoViews) {
  Mapper mapper({});
  EXPECT_EQ(mapper.Snapshot(), nullptr);
  EXPECT_TRUE(mapper.IsIdle());
  EXPECT_FALSE(mapper.Step());
  ASSERT_TRUE(mapper.Start(*pair_));
  EXPECT_FALSE(mapper.IsIdle());
  EXPECT_TRUE(mapper.Step());
  EXPECT_EQ(CountEvents<MapperEvent::MapStarted>(&mapper), 1);
  EXPECT_EQ(CountEvents<MapperEvent::MapStarted>(&mapper), 0) << "events are returned once";
  const auto map = mapper.Snapshot();
  ASSERT_NE(map, nullptr);
  EXPECT_EQ(Validate(*map), "");
  ASSERT_EQ(map->keyframes.size(), 2u);
  EXPECT_TRUE(map->keyframes[0].fixed);
  EXPECT_TRUE(IsNear(map->keyframes[0].camera_from_map, Rigid3(), 1e-12, 1e-12));
  EXPECT_LT((map->keyframes[1].camera_from_map.OriginInSource() - Eigen::Vector3d(kBaseline, 0, 0)).norm(),
            0.012);
  EXPECT_GT(map->points.size(), pair_->matches.size() * 3 / 4);
  EXPECT_LT(MedianDistanceToSurface(*map), 0.05);
  EXPECT_TRUE(mapper.IsIdle());
}

// Two synchronized cameras, of which the other one has the first keyframe of the panorama map.
TEST_F(MapperTest, TakesNoKeyframeOfAnotherCameraForTheFirstView) {
  Mapper mapper({});
  KeyFrameCandidate candidate;
  candidate.time = pair_->a.time;
  candidate.camera = testing_world::PinholeCamera(420, 320);
  const Rigid3 pose = CameraAt({0, 0, 0}, {0, 10, 0});
  candidate.features = MakeFeatures(world_->Render(*candidate.camera, pose, 1.5, 5));
  candidate.camera_from_map = pose;
  candidate.choice = KeyFrameChoice::kFirst;
  ASSERT_TRUE(mapper.Offer(candidate));
  WorkUntilIdle(&mapper);
  ASSERT_TRUE(mapper.Snapshot());
  ASSERT_EQ(mapper.Snapshot()->keyframes.size(), 1u);
  ASSERT_TRUE(mapper.Start(*pair_));
  WorkUntilIdle(&mapper);
  const MapSnapshot& map = *mapper.Snapshot();
  EXPECT_EQ(Validate(map), "");
  ASSERT_EQ(map.keyframes.size(), 3u);
  EXPECT_TRUE(map.keyframes[0].camera->HasSameLens(*candidate.camera));
  const KeyFrame& first = map.keyframes[1];
  EXPECT_TRUE(first.fixed);
  EXPECT_EQ(first.features, pair_->a.features);
  EXPECT_TRUE(first.camera->HasSameLens(*MapperCamera()));
}

TEST_F(MapperTest, ReportsAFailedStart) {
  InitialPair poor = FirstPair(*world_, 30);
  // A blank second image: no points can be added to the thirty.
  poor.b.features = MakeFeatures(cv::Mat(300, 400, CV_8UC1, cv::Scalar(120)));
  Mapper mapper({});
  mapper.Start(poor);
  WorkUntilIdle(&mapper);
  const auto events = mapper.TakeEvents();
  ASSERT_EQ(events.size(), 1u);
  const auto* const failed = std::get_if<MapperEvent::StartFailed>(&events[0].what);
  ASSERT_NE(failed, nullptr);
  EXPECT_LT(failed->points, static_cast<std::size_t>(MapperOptions().min_initial_points));
  EXPECT_EQ(mapper.Snapshot(), nullptr);
  EXPECT_TRUE(mapper.IsIdle());
  // A keyframe that comes too late is ignored, and the next start succeeds.
  mapper.Offer(TrueCandidate(*world_, *started_, CameraAt({0.2, 0, 0}), 1));
  WorkUntilIdle(&mapper);
  EXPECT_EQ(mapper.Snapshot(), nullptr);
  mapper.Start(*pair_);
  mapper.Step();
  EXPECT_EQ(CountEvents<MapperEvent::MapStarted>(&mapper), 1);
}

TEST_F(MapperTest, ExtendsTheMapByKeyframesUntilIdle) {
  Mapper mapper({});
  mapper.Adopt(started_);
  EXPECT_EQ(mapper.Snapshot(), started_);
  const std::vector<Rigid3> poses = {CameraAt({0.3, 0, 0}), CameraAt({0.5, 0.1, 0}, {0, -5, 0}),
                                     CameraAt({-0.2, 0, 0.2}), CameraAt({-0.4, -0.1, 0.1}, {0, 8, 0})};
  double seconds = 1;
  for (const Rigid3& pose : poses) {
    const auto before = mapper.Snapshot();
    ASSERT_TRUE(mapper.Offer(TrueCandidate(*world_, *before, pose, seconds++)));
    EXPECT_FALSE(mapper.IsIdle());
    WorkUntilIdle(&mapper);
    EXPECT_TRUE(mapper.IsIdle());
    const auto after = mapper.Snapshot();
    EXPECT_EQ(after->keyframes.size(), before->keyframes.size() + 1);
    EXPECT_GT(after->revision, before->revision);
    EXPECT_EQ(Validate(*after), "");
    EXPECT_GT(after->points.size(), before->points.size());
    EXPECT_LT((after->keyframes.back().camera_from_map.OriginInSource() - pose.OriginInSource()).norm(),
              0.03);
  }
  EXPECT_EQ(CountEvents<MapperEvent::KeyFrameAdded>(&mapper), 4);
  EXPECT_LT(MedianDistanceToSurface(*mapper.Snapshot()), 0.04);
  EXPECT_GT(mapper.Times().bundle_adjustment, 0);
  EXPECT_GT(mapper.Times().other, 0);
}

TEST_F(MapperTest, FindsThePoseOfAKeyframeAnewIfTheMapHasMovedSinceItWasTracked) {
  const Rigid3 pose = CameraAt({0.45, 0, 0}), offered = CameraAt({0.48, 0.02, 0});
  const auto error_of_newest = [&](bool is_old) {
    Mapper mapper({});
    mapper.Adopt(started_);
    mapper.Offer(TrueCandidate(*world_, *started_, CameraAt({0.25, 0, 0}), 1));
    WorkUntilIdle(&mapper);
    KeyFrameCandidate candidate = TrueCandidate(*world_, *started_, pose, 2);
    candidate.camera_from_map = offered;
    candidate.map_revision = is_old ? started_->revision : mapper.Snapshot()->revision;
    mapper.Offer(candidate);
    mapper.Step();
    const Rigid3& newest = mapper.Snapshot()->keyframes.back().camera_from_map;
    return (newest.OriginInSource() - pose.OriginInSource()).norm();
  };
  EXPECT_LT(error_of_newest(true), 0.015);
  EXPECT_NEAR(error_of_newest(false), (offered.OriginInSource() - pose.OriginInSource()).norm(), 1e-9)
      << "the pose fits the present map";
}

TEST_F(MapperTest, AdjustsTwoKeyframesBeforeItInsertsAThird) {
  Mapper mapper({});
  mapper.Adopt(started_);
  for (int i = 0; i < 3; ++i)
    ASSERT_TRUE(mapper.Offer(TrueCandidate(*world_, *started_, CameraAt({0.2 + 0.1 * i, 0, 0}), 1 + i)));
  mapper.Step();
  mapper.Step();
  ASSERT_EQ(mapper.Snapshot()->keyframes.size(), started_->keyframes.size() + 2);
  EXPECT_NE(mapper.Snapshot()->first_unadjusted, kNoId);
  for (int step = 0; step < 10 && mapper.Snapshot()->first_unadjusted != kNoId; ++step) mapper.Step();
  EXPECT_EQ(mapper.Snapshot()->keyframes.size(), started_->keyframes.size() + 2);
  WorkUntilIdle(&mapper);
  EXPECT_EQ(mapper.Snapshot()->keyframes.size(), started_->keyframes.size() + 3);
}

// The first two views of a camera that turned meanwhile, with this readout time.
InitialPair TurningPair(const InitialPair& views, double readout_s) {
  const auto camera = [&](double rate) {
    return std::make_shared<CameraModel>(
        CameraModel::WithReadout(MapperCamera(), {{0, rate, 0}, {0, readout_s}}));
  };
  InitialPair pair = views;
  pair.a.camera = camera(0.2);
  pair.b.camera = camera(-0.2);
  return pair;
}

// Corners before a camera whose readout takes 20 ms.
TrackedCorners CornersOfARollingShutter() {
  testing_world::RolledScene scene;
  scene.camera = *MapperCamera();
  return {MapperCamera(), ShowCorners(scene)};
}

Eigen::Vector2d ReadoutOfNewest(const Mapper& mapper) {
  return mapper.Snapshot()->keyframes.back().camera->readout_motion().readout_s;
}

TEST_F(MapperTest, LearnsTheReadoutTimeFromCornersAfterItsStart) {
  const TrackedCorners corners = CornersOfARollingShutter();
  Mapper mapper({});
  mapper.Offer(corners);
  WorkUntilIdle(&mapper);
  EXPECT_EQ(mapper.Snapshot(), nullptr) << "there is no map yet";
  mapper.Start(TurningPair(*pair_, 0));
  WorkUntilIdle(&mapper);
  ASSERT_NE(mapper.Snapshot(), nullptr);
  ASSERT_TRUE(ReadoutOfNewest(mapper).isZero(0));
  mapper.Offer(corners);
  WorkUntilIdle(&mapper);
  EXPECT_NEAR(ReadoutOfNewest(mapper).y(), 0.02, 0.004);
  EXPECT_EQ(ReadoutOfNewest(mapper).x(), 0);
  EXPECT_EQ(Validate(*mapper.Snapshot()), "");
}

TEST_F(MapperTest, AdjustsTheMapToANewReadoutTimeAlthoughAnotherRequestWaits) {
  const TrackedCorners corners = CornersOfARollingShutter();
  const auto after_one_step = [&](int requests) {
    Mapper mapper({});
    mapper.Start(TurningPair(*pair_, 0));
    WorkUntilIdle(&mapper);
    for (int i = 0; i < requests; ++i) mapper.Offer(corners);
    mapper.Step();
    return mapper.Snapshot();
  };
  const auto before = after_one_step(0), alone = after_one_step(1), with_another = after_one_step(2);
  const auto position = [](const MapSnapshot& map) -> Eigen::Vector3d {
    return map.keyframes.back().camera_from_map.OriginInSource();
  };
  ASSERT_GT((position(*alone) - position(*before)).norm(), 1e-4) << "the readout time moves the camera";
  EXPECT_EQ(position(*with_another), position(*alone));
}

TEST_F(MapperTest, CorrectsAReadoutTimeThatWasNotEstimatedFromCorners) {
  Mapper mapper({});
  mapper.Start(TurningPair(*pair_, 0.035));
  WorkUntilIdle(&mapper);
  ASSERT_NE(mapper.Snapshot(), nullptr);
  ASSERT_FALSE(ReadoutOfNewest(mapper).isZero(0));
  ASSERT_GT(std::abs(ReadoutOfNewest(mapper).y() - 0.02), 0.006);
  mapper.Offer(CornersOfARollingShutter());
  WorkUntilIdle(&mapper);
  EXPECT_NEAR(ReadoutOfNewest(mapper).y(), 0.02, 0.004);
}

TEST_F(MapperTest, AcceptsNoMoreThanItsQueueHolds) {
  MapperOptions options;
  options.max_queue = 2;
  Mapper mapper(options);
  mapper.Adopt(started_);
  EXPECT_TRUE(mapper.Offer(TrueCandidate(*world_, *started_, CameraAt({0.25, 0, 0}), 1)));
  EXPECT_TRUE(mapper.Offer(TrueCandidate(*world_, *started_, CameraAt({0.45, 0, 0}), 2)));
  EXPECT_FALSE(mapper.Offer(TrueCandidate(*world_, *started_, CameraAt({0.65, 0, 0}), 3)));
  EXPECT_FALSE(mapper.Start(*pair_));
  EXPECT_EQ(mapper.QueueLength(), 2u);
  mapper.Adopt(started_);
  EXPECT_EQ(mapper.QueueLength(), 0u);
  EXPECT_FALSE(mapper.Step());
}

TEST_F(MapperTest, InsertsAQueuedKeyframeBeforeItAdjusts) {
  Mapper mapper({});
  mapper.Adopt(started_);
  mapper.Offer(TrueCandidate(*world_, *started_, CameraAt({0.25, 0, 0}), 1));
  ASSERT_TRUE(mapper.Step());
  EXPECT_FALSE(mapper.IsIdle()) << "the newest keyframe is not adjusted yet";
  mapper.Offer(TrueCandidate(*world_, *started_, CameraAt({0.45, 0, 0}), 2));
  ASSERT_TRUE(mapper.Step());
  EXPECT_EQ(mapper.Snapshot()->keyframes.size(), 4u);
  WorkUntilIdle(&mapper);
  EXPECT_TRUE(mapper.IsIdle());
}

// As the keyframes of two cameras that look in different directions.
TEST_F(MapperTest, AdjustsAKeyframeAlthoughOneThatSharesNothingWithItFollows) {
  const Eigen::Vector3d center(0.25, 0, 0);
  KeyFrameCandidate moved = TrueCandidate(*world_, *started_, CameraAt(center), 1);
  moved.camera_from_map = CameraAt(center + Eigen::Vector3d(0, 0.02, 0));
  KeyFrameCandidate elsewhere = TrueCandidate(*world_, *started_, CameraAt(center, {0, 180, 0}), 2);
  elsewhere.matches.clear();
  Mapper mapper({});
  mapper.Adopt(started_);
  ASSERT_TRUE(mapper.Offer(moved));
  ASSERT_TRUE(mapper.Offer(elsewhere));
  WorkUntilIdle(&mapper);
  EXPECT_TRUE(mapper.IsIdle());
  EXPECT_EQ(CountEvents<MapperEvent::GloballyAdjusted>(&mapper), 0);
  const MapSnapshot& map = *mapper.Snapshot();
  ASSERT_EQ(map.keyframes.size(), 4u);
  EXPECT_LT((map.keyframes[2].camera_from_map.OriginInSource() - center).norm(), 0.008);
}

TEST_F(MapperTest, KeepsTheMapValidWhileKeyframesInterruptIt) {
  Mapper mapper({});
  mapper.Adopt(started_);
  std::vector<KeyFrameCandidate> candidates;
  for (int i = 0; i < 5; ++i)
    candidates.push_back(TrueCandidate(*world_, *started_, CameraAt({0.2 + 0.1 * i, 0.03 * i, 0}), 1 + i));
  std::jthread tracker([&](std::stop_token stop) {
    for (const KeyFrameCandidate& candidate : candidates)
      while (!mapper.Offer(candidate) && !stop.stop_requested()) std::this_thread::yield();
  });
  // A mapper that stops taking keyframes fails the test instead of hanging it.
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (mapper.Snapshot()->keyframes.size() < 7 && std::chrono::steady_clock::now() < deadline) {
    mapper.Step();
    EXPECT_EQ(Validate(*mapper.Snapshot()), "");
    std::this_thread::yield();
  }
  tracker.request_stop();
  tracker.join();
  WorkUntilIdle(&mapper);
  EXPECT_TRUE(mapper.IsIdle());
  EXPECT_EQ(mapper.Snapshot()->keyframes.size(), 7u);
  EXPECT_EQ(Validate(*mapper.Snapshot()), "");
}

TEST_F(MapperTest, KeepsTheAdoptedKeyframesOfATemporaryMapAndTheNewestOfTheOthers) {
  MapperOptions options;
  options.temporary = true;
  options.max_temporary_keyframes = 2;
  Mapper mapper(options);
  mapper.Adopt(started_);
  for (int i = 0; i < 5; ++i) {
    ASSERT_TRUE(
        mapper.Offer(TrueCandidate(*world_, *started_, CameraAt({0.2 + 0.1 * i, 0.03 * i, 0}), 1 + i)));
    WorkUntilIdle(&mapper);
    EXPECT_EQ(Validate(*mapper.Snapshot()), "");
  }
  const MapSnapshot& map = *mapper.Snapshot();
  ASSERT_EQ(map.keyframes.size(), started_->keyframes.size() + 2);
  for (const KeyFrame& before : started_->keyframes) {
    const KeyFrame* const after = map.FindKeyFrame(before.id);
    ASSERT_NE(after, nullptr);
    EXPECT_EQ(after->camera_from_map.rotation.matrix(), before.camera_from_map.rotation.matrix());
    EXPECT_EQ(after->camera_from_map.translation, before.camera_from_map.translation);
  }
  EXPECT_EQ(map.keyframes[map.keyframes.size() - 2].time, FromSeconds(4));
  EXPECT_EQ(map.keyframes.back().time, FromSeconds(5));
  EXPECT_GT(map.points.size(), started_->points.size());
  EXPECT_LT(MedianDistanceToSurface(map), 0.02);
}

// A visitor who turns beyond what the map shows depends on the reference, however many keyframes follow it.
TEST_F(MapperTest, KeepsThePanoramaOfATemporaryMapWhileTheCameraTurns) {
  MapperOptions options;
  options.temporary = true;
  options.max_temporary_keyframes = 3;
  Mapper mapper(options);
  mapper.Adopt(started_);
  const auto offer = [&](KeyFrameChoice choice, PanoramaId panorama, double turn_deg, double seconds) {
    KeyFrameCandidate candidate =
        TrueCandidate(*world_, *started_, CameraAt({0.2, 0, 0}, {0, turn_deg, 0}), seconds);
    candidate.choice = choice;
    candidate.panorama = panorama;
    ASSERT_TRUE(mapper.Offer(candidate));
    WorkUntilIdle(&mapper);
    EXPECT_EQ(Validate(*mapper.Snapshot()), "");
  };
  offer(KeyFrameChoice::kLocalizedPanorama, kNoId, 0, 1);
  ASSERT_EQ(mapper.Snapshot()->panoramas.size(), 1u);
  const PanoramaMap opened = mapper.Snapshot()->panoramas.front();
  for (int i = 1; i <= 5; ++i) offer(KeyFrameChoice::kPanorama, opened.id, 4.0 * i, 1.0 + i);
  const MapSnapshot& map = *mapper.Snapshot();
  ASSERT_EQ(map.panoramas.size(), 1u);
  EXPECT_EQ(map.panoramas.front().reference, opened.reference);
  ASSERT_EQ(map.keyframes.size(), started_->keyframes.size() + 3);
  EXPECT_EQ(map.keyframes[map.keyframes.size() - 3].id, opened.reference);
  EXPECT_EQ(map.keyframes[map.keyframes.size() - 2].time, FromSeconds(5));
  EXPECT_EQ(map.keyframes.back().time, FromSeconds(6));
  EXPECT_TRUE(std::ranges::any_of(map.points, [](const MapPoint& point) { return point.infinite(); }));
}

TEST_F(MapperTest, RemovesPointsThatTheTrackersReportAsOutliers) {
  Mapper mapper({});
  mapper.Adopt(started_);
  const MapPointId bad = started_->points[3].id, good = started_->points[5].id;
  mapper.Report({{bad, 1, 40, 3}, {good, 40, 3, 3}, {123456, 0, 99, 0}});
  mapper.Offer(TrueCandidate(*world_, *started_, CameraAt({0.25, 0, 0}), 1));
  ASSERT_TRUE(mapper.Step());
  EXPECT_EQ(mapper.Snapshot()->FindPoint(bad), nullptr);
  EXPECT_NE(mapper.Snapshot()->FindPoint(good), nullptr);
  EXPECT_EQ(Validate(*mapper.Snapshot()), "");
}

TEST_F(MapperTest, IsDeterministic) {
  std::shared_ptr<const MapSnapshot> maps[2];
  for (auto& map : maps) {
    Mapper mapper({});
    mapper.Start(*pair_);
    mapper.Step();
    mapper.Offer(TrueCandidate(*world_, *started_, CameraAt({0.25, 0, 0}), 1));
    WorkUntilIdle(&mapper);
    map = mapper.Snapshot();
  }
  ASSERT_EQ(maps[0]->points.size(), maps[1]->points.size());
  ASSERT_EQ(maps[0]->observations.size(), maps[1]->observations.size());
  for (std::size_t i = 0; i < maps[0]->points.size(); ++i)
    EXPECT_EQ(maps[0]->points[i].point_in_map, maps[1]->points[i].point_in_map);
}

}  // namespace
}  // namespace docent::engine
