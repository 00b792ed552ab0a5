// SPDX-License-Identifier: Apache-2.0
// Tests of what a lost tracker returns where places resemble its image: a pose, or a rejection reason.
#include "engine/tracking/relocalization_result.h"

#include <gtest/gtest.h>

#include <vector>

#include "engine/tracking/tracker.h"
#include "tests/engine/rendered_world.h"
#include "tests/engine/some_maps.h"

namespace docent::engine {
namespace {

using testing_world::Camera;
using testing_world::CameraAt;
using testing_world::RenderedWorld;
using testing_world::SomeMaps;
using testing_world::World;

// A map with three keyframes, in which `wrong` of every ten points are displaced.
std::shared_ptr<const MapSnapshot> MapWithWrongPoints(std::size_t wrong) {
  return testing_world::MapWithDisplacedPoints(
      World(), Camera(), {CameraAt({0, 0, 0}), CameraAt({0.1, 0, 0}), CameraAt({0.2, 0, 0})},
      [=](std::size_t i) { return i % 10 < wrong; });
}

// The map without errors, reduced to the points in one corner of its first keyframe's image.
std::shared_ptr<const MapSnapshot> MapOfACorner() {
  auto map = std::make_shared<MapSnapshot>(*MapWithWrongPoints(0));
  const KeyFrame first = map->keyframes.front();
  std::erase_if(map->points, [&](const MapPoint& point) {
    const auto pixel = Camera()->Project(first.camera_from_map * point.position());
    return !pixel || pixel->x() > 145 || pixel->y() > 110;
  });
  std::erase_if(map->observations,
                [&](const Observation& observation) { return !map->FindPoint(observation.point); });
  return map;
}

constexpr double kBetweenPlaces = 10;  // metres

// One map of two places, the second kBetweenPlaces metres to the right of the first.
std::shared_ptr<const MapSnapshot> TwoPlaces(const MapSnapshot& first, const MapSnapshot& second) {
  auto both = std::make_shared<MapSnapshot>(first);
  const Eigen::Vector3d shift(kBetweenPlaces, 0, 0);
  for (KeyFrame keyframe : second.keyframes) {
    keyframe.id += first.next_keyframe;
    keyframe.fixed = false;
    keyframe.camera_from_map = keyframe.camera_from_map * Rigid3(Rotation3(), -shift);
    both->keyframes.push_back(keyframe);
  }
  for (MapPoint point : second.points) {
    point.id += first.next_point;
    point.source_keyframe += first.next_keyframe;
    point.point_in_map.head<3>() += shift;
    both->points.push_back(point);
  }
  for (Observation observation : second.observations) {
    observation.keyframe += first.next_keyframe;
    observation.point += first.next_point;
    both->observations.push_back(observation);
  }
  both->next_keyframe += second.next_keyframe;
  both->next_point += second.next_point;
  return both;
}

Frame VisitorFrame(int index, const RenderedWorld& world = World()) {
  return testing_world::MakeFrame(index, world, CameraAt({0.06 + 0.002 * index, 0.02, 0.03}));
}

// The frames of a new visitor, who has not been localized in any map before.
std::vector<TrackedFrame> Visit(const SomeMaps& maps, int frames, const RenderedWorld& world = World()) {
  TrackerOptions options;
  options.build_maps = false;
  Tracker tracker(options, Camera(), 3);
  std::vector<TrackedFrame> seen;
  for (int i = 0; i < frames; ++i) seen.push_back(tracker.Track(VisitorFrame(i, world), &maps));
  return seen;
}

TEST(RelocalizationResult, IsUnconfirmedUntilSeveralFramesAgree) {
  SomeMaps maps;
  maps.Add(1, MapWithWrongPoints(0));
  const auto frames = Visit(maps, 4);
  const auto wanted = static_cast<std::size_t>(TrackerOptions().confirming_frames);
  for (std::size_t i = 0; i + 1 < wanted; ++i) {
    EXPECT_EQ(frames[i].state, TrackingState::kLost);
    EXPECT_EQ(frames[i].relocalization.rejection, RejectionReason::kUnconfirmed);
    EXPECT_EQ(frames[i].relocalization.map_key, 1u);
    EXPECT_EQ(frames[i].relocalization.frames, static_cast<int>(i) + 1);
  }
  EXPECT_EQ(frames[wanted - 1].state, TrackingState::kRelocalized);
  EXPECT_EQ(frames[wanted - 1].relocalization.rejection, RejectionReason::kNone);
}

TEST(RelocalizationResult, ReportsTooFewPointsInAnotherPlace) {
  SomeMaps maps;
  maps.Add(1, MapWithWrongPoints(0));
  for (const TrackedFrame& frame : Visit(maps, 6, RenderedWorld::Room(7177))) {
    EXPECT_EQ(frame.state, TrackingState::kLost);
    EXPECT_EQ(frame.relocalization.rejection, RejectionReason::kFewPoints);
    EXPECT_LT(frame.relocalization.inliers, TrackerOptions().min_relocalization_inliers);
  }
}

TEST(RelocalizationResult, ReportsPointsInOneCornerOnly) {
  SomeMaps maps;
  maps.Add(1, MapOfACorner());
  ASSERT_GT(maps.At(1)->points.size(), 60u);
  for (const TrackedFrame& frame : Visit(maps, 6)) {
    EXPECT_EQ(frame.state, TrackingState::kLost);
    EXPECT_EQ(frame.relocalization.rejection, RejectionReason::kClustered);
    EXPECT_GE(frame.relocalization.inliers, TrackerOptions().min_relocalization_inliers);
  }
}

TEST(RelocalizationResult, ReportsTwoMapsThatLookAlike) {
  SomeMaps maps;
  maps.Add(1, MapWithWrongPoints(0));
  maps.Add(2, MapWithWrongPoints(0));
  for (const TrackedFrame& frame : Visit(maps, 30)) {
    EXPECT_EQ(frame.state, TrackingState::kLost) << frame.frame.index;
    EXPECT_EQ(frame.relocalization.rejection, RejectionReason::kAmbiguous);
    EXPECT_EQ(frame.relocalization.map_key + frame.relocalization.competitor_key, 3u);
  }
}

TEST(RelocalizationResult, AcceptsAClearlyBetterMapInAnyOrder) {
  for (const std::uint64_t right : {1u, 2u}) {
    SomeMaps maps;
    maps.Add(right, MapWithWrongPoints(0));
    maps.Add(3 - right, MapWithWrongPoints(5));
    const auto frames = Visit(maps, 5);
    EXPECT_TRUE(HasPose(frames.back().state));
    EXPECT_EQ(frames.back().map_key, right);
  }
}

TEST(RelocalizationResult, AcceptsAMapThatIsBetterInManyFrames) {
  SomeMaps maps;
  maps.Add(1, MapWithWrongPoints(1));
  maps.Add(2, MapWithWrongPoints(0));
  const auto frames = Visit(maps, 30);
  const auto waited = static_cast<std::size_t>(TrackerOptions().min_leading_frames - 1);
  for (std::size_t i = 0; i < waited; ++i)
    EXPECT_EQ(frames[i].relocalization.rejection, RejectionReason::kAmbiguous) << i;
  EXPECT_TRUE(HasPose(frames.back().state));
  EXPECT_EQ(frames.back().map_key, 2u);
}

TEST(RelocalizationResult, PrefersThePreviousMapUnlessAnotherIsClearlyBetter) {
  for (const std::size_t wrong : {1u, 5u}) {
    SomeMaps maps;
    maps.Add(1, MapWithWrongPoints(wrong));
    maps.Add(2, MapWithWrongPoints(0));
    TrackerOptions options;
    options.build_maps = false;
    Tracker tracker(options, Camera(), 3);
    tracker.SetMap(maps.At(1), 1);
    TrackedFrame last;
    for (int i = 0; i < 4; ++i) last = tracker.Track(VisitorFrame(i), &maps);
    EXPECT_TRUE(HasPose(last.state));
    EXPECT_EQ(last.map_key, wrong == 1 ? 1u : 2u);
  }
}

TEST(RelocalizationResult, DelaysMapExtensionAfterRelocalization) {
  SomeMaps maps;
  maps.Add(1, MapWithWrongPoints(0));
  const RenderedWorld nothing{std::vector<testing_world::Wall>()};
  TrackerOptions options;
  options.keyframes.min_distance = 0.05;
  Tracker tracker(options, Camera(), 3);
  tracker.SetMap(maps.At(1), 1);
  // The camera is lost for longer than the minimum keyframe interval, and then relocalizes far enough from
  // all
  // keyframes for a new one.
  for (int i = 0; i < 8; ++i) EXPECT_FALSE(HasPose(tracker.Track(VisitorFrame(i, nothing), &maps).state));
  int first_pose = -1, first_keyframe = -1, first_reports = -1;
  for (int i = 100; i < 130; ++i) {
    Frame frame = VisitorFrame(i);
    frame.image = World().Render(*Camera(), CameraAt({0.45, 0.02, 0.03}), 1.5, frame.index + 1);
    if (HasPose(tracker.Track(frame, &maps).state) && first_pose < 0) first_pose = i;
    if (tracker.TakeKeyFrameCandidate() && first_keyframe < 0) first_keyframe = i;
    if (!tracker.TakeReports().empty() && first_reports < 0) first_reports = i;
  }
  ASSERT_GE(first_pose, 0);
  ASSERT_GE(first_keyframe, 0);
  EXPECT_EQ(first_keyframe, first_pose + options.confirming_frames + 1);
  EXPECT_EQ(first_reports, first_keyframe);
}

TEST(RelocalizationResult, AcceptsTheBetterOfTwoSimilarPlacesInOneMap) {
  for (const bool second : {false, true}) {
    SomeMaps maps;
    maps.Add(1, second ? TwoPlaces(*MapWithWrongPoints(5), *MapWithWrongPoints(0))
                       : TwoPlaces(*MapWithWrongPoints(0), *MapWithWrongPoints(5)));
    ASSERT_EQ(Validate(*maps.At(1)), "");
    const TrackedFrame last = Visit(maps, 5).back();
    ASSERT_TRUE(HasPose(last.state));
    EXPECT_NEAR(last.camera_from_map.OriginInSource().x(), second ? kBetweenPlaces : 0, 0.3);
  }
}

TEST(RelocalizationResult, ReportsTwoPlacesInOneMapThatLookAlike) {
  SomeMaps maps;
  maps.Add(1, TwoPlaces(*MapWithWrongPoints(0), *MapWithWrongPoints(0)));
  for (const TrackedFrame& frame : Visit(maps, 10)) {
    EXPECT_EQ(frame.state, TrackingState::kLost) << frame.frame.index;
    EXPECT_EQ(frame.relocalization.rejection, RejectionReason::kAmbiguous);
    EXPECT_EQ(frame.relocalization.map_key, 1u);
    EXPECT_EQ(frame.relocalization.competitor_key, 1u);
  }
}

// The camera first relocalizes at a similar but wrong place, and then sees what only the right place shows.
TEST(RelocalizationResult, SwitchesToThePlaceWithMoreInliers) {
  SomeMaps maps;
  maps.Add(1, TwoPlaces(*MapWithWrongPoints(5), *MapWithWrongPoints(10)));
  TrackerOptions options;
  options.build_maps = false;
  Tracker tracker(options, Camera(), 3);
  TrackedFrame frame;
  int index = 0;
  while (index < 10 && !HasPose(frame.state)) frame = tracker.Track(VisitorFrame(index++), &maps);
  ASSERT_TRUE(HasPose(frame.state));
  EXPECT_LT(frame.quality, options.poor_visible_ratio);
  EXPECT_NEAR(frame.camera_from_map.OriginInSource().x(), 0, 0.3);
  auto both = TwoPlaces(*MapWithWrongPoints(5), *MapWithWrongPoints(0));
  maps.Add(1, both);
  tracker.SetMap(both, 1);
  for (int i = 0; i < 5; ++i) frame = tracker.Track(VisitorFrame(index++), &maps);
  ASSERT_TRUE(HasPose(frame.state));
  EXPECT_NEAR(frame.camera_from_map.OriginInSource().x(), kBetweenPlaces, 0.3);
  EXPECT_GT(frame.quality, options.poor_visible_ratio);
}

}  // namespace
}  // namespace docent::engine
