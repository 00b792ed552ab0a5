// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/tracker.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

#include "tests/engine/lockstep.h"
#include "tests/engine/rendered_world.h"
#include "tests/engine/some_maps.h"

namespace docent::engine {
namespace {

using testing_world::Camera;
using testing_world::CameraAt;
using testing_world::RenderedWorld;
using testing_world::SomeMaps;
using testing_world::World;

constexpr double kFramesPerSecond = 30;
constexpr int kFramesOfTheWalk = 110;  // frames of the first walk
constexpr int kCoveredFrames = 8;      // frames with a hand in front of the lens
constexpr int kFramesAfterwards = 20;
constexpr int kAllFrames = kFramesOfTheWalk + kCoveredFrames + kFramesAfterwards;

bool IsCovered(int frame) {
  return frame >= kFramesOfTheWalk && frame < kFramesOfTheWalk + kCoveredFrames;
}

// The hand-held camera moves sideways and back.
Rigid3 WalkPose(int frame) {
  const double t = frame / kFramesPerSecond;
  return CameraAt({0.45 * std::sin(0.9 * t), 0.05 * std::sin(2.1 * t), 0.15 * (1 - std::cos(1.3 * t))},
                  {1.5 * std::sin(1.7 * t), -4 * std::sin(0.9 * t), 2 * std::sin(1.1 * t)});
}

// The images of one walk, rendered once.
const std::vector<cv::Mat>& WalkImages() {
  static const std::vector<cv::Mat> images = [] {
    std::vector<cv::Mat> rendered;
    for (int i = 0; i < kAllFrames; ++i) {
      const auto seed = static_cast<std::uint64_t>(i) + 1;
      if (IsCovered(i)) {
        const RenderedWorld nothing{std::vector<testing_world::Wall>()};
        rendered.push_back(nothing.Render(*Camera(), WalkPose(i), 1.5, seed));
      } else {
        rendered.push_back(World().Render(*Camera(), WalkPose(i), 1.5, seed));
      }
    }
    return rendered;
  }();
  return images;
}

Frame WalkFrame(int index) {
  return testing_world::MakeFrame(index, WalkImages()[static_cast<std::size_t>(index)]);
}

// General motion alone: without panorama maps a map begins with its first depth. hybrid_tracker_test.cpp
// tests the tracker with them.
TrackerOptions WithoutPanoramas() {
  TrackerOptions options;
  options.hybrid = false;
  return options;
}

struct TrackedWalk {
  std::vector<TrackedFrame> frames;
  std::shared_ptr<const MapSnapshot> map;
};

TrackedWalk TakeWalk(std::uint64_t seed) {
  TrackedWalk walk;
  Lockstep lockstep(WithoutPanoramas(), Camera(), seed);
  for (int i = 0; i < kAllFrames; ++i) walk.frames.push_back(lockstep.Feed(WalkFrame(i)));
  walk.map = lockstep.map();
  return walk;
}

const TrackedWalk& OneWalk() {
  static const TrackedWalk walk = TakeWalk(1);
  return walk;
}

// The similarity that aligns the tracked camera centres with the true ones.
Eigen::Matrix4d WorldFromMap(const std::vector<TrackedFrame>& frames) {
  std::vector<Eigen::Vector3d> tracked, truth;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (!HasPose(frames[i].state)) continue;
    tracked.push_back(frames[i].camera_from_map.OriginInSource());
    truth.push_back(WalkPose(static_cast<int>(i)).OriginInSource());
  }
  Eigen::Matrix3Xd from(3, tracked.size()), to(3, truth.size());
  for (std::size_t i = 0; i < tracked.size(); ++i) {
    from.col(static_cast<Eigen::Index>(i)) = tracked[i];
    to.col(static_cast<Eigen::Index>(i)) = truth[i];
  }
  return Eigen::umeyama(from, to, true);
}

double DistanceFromTruth(const Eigen::Matrix4d& world_from_map, const Rigid3& camera_from_map,
                         const Rigid3& truth) {
  const Eigen::Vector4d center = camera_from_map.OriginInSource().homogeneous();
  return ((world_from_map * center).head<3>() - truth.OriginInSource()).norm();
}

TEST(Tracker, StartsAMapAndTracksAccurately) {
  const TrackedWalk& walk = OneWalk();
  ASSERT_NE(walk.map, nullptr) << "no map was started; last hint: "
                               << static_cast<int>(walk.frames[kFramesOfTheWalk - 1].hint);
  EXPECT_EQ(walk.frames[0].state, TrackingState::kInitializing);
  EXPECT_NE(walk.frames[1].hint, Hint::kNone);
  int first = 0;
  while (first < kFramesOfTheWalk && !HasPose(walk.frames[static_cast<std::size_t>(first)].state)) ++first;
  EXPECT_LT(first, 60);
  const Eigen::Matrix4d world_from_map = WorldFromMap(walk.frames);
  double squares = 0;
  for (int i = first; i < kFramesOfTheWalk; ++i) {
    const TrackedFrame& frame = walk.frames[static_cast<std::size_t>(i)];
    ASSERT_EQ(frame.state, TrackingState::kSixDof) << i << ": " << static_cast<int>(frame.hint);
    EXPECT_EQ(frame.map_key, 1u);
    ASSERT_NE(frame.map, nullptr);
    EXPECT_EQ(frame.frame.index, static_cast<std::uint64_t>(i));
    EXPECT_GE(frame.finite_points, TrackerOptions().min_inliers);
    EXPECT_GT(frame.quality, TrackerOptions().lost_quality);
    for (const PointMatch& match : frame.matches) EXPECT_NE(frame.map->FindPoint(match.point), nullptr);
    const double error = DistanceFromTruth(world_from_map, frame.camera_from_map, WalkPose(i));
    squares += error * error;
  }
  EXPECT_LT(std::sqrt(squares / (kFramesOfTheWalk - first)), 0.012) << "metres";
  EXPECT_GT(walk.map->keyframes.size(), 3u);
  EXPECT_EQ(Validate(*walk.map), "");
}

// Before this tracker learns of its map, another camera has added a keyframe that looks elsewhere.
TEST(Tracker, BeginsAtItsOwnNewestKeyframe) {
  Tracker tracker(WithoutPanoramas(), Camera(), 1);
  Mapper mapper({});
  tracker.StartNewMap();
  int i = 0;
  for (; i < kFramesOfTheWalk && !mapper.Snapshot(); ++i) {
    tracker.Track(WalkFrame(i), nullptr);
    if (auto pair = tracker.TakeInitialPair()) mapper.Start(std::move(*pair));
    mapper.Step();
  }
  ASSERT_TRUE(mapper.Snapshot());
  auto map = std::make_shared<MapSnapshot>(*mapper.Snapshot());
  KeyFrame other = map->keyframes.back();
  other.id = map->next_keyframe++;
  other.camera = testing_world::PinholeCamera(400, 300);
  other.camera_from_map = CameraAt({0, 0, 0}, {0, 120, 0}) * other.camera_from_map;
  map->keyframes.push_back(other);
  tracker.SetMap(map, 1);
  EXPECT_EQ(tracker.Track(WalkFrame(i), nullptr).state, TrackingState::kSixDof);
}

TEST(Tracker, PlacesMapPointsOnTheWalls) {
  const TrackedWalk& walk = OneWalk();
  ASSERT_NE(walk.map, nullptr);
  const Eigen::Matrix4d world_from_map = WorldFromMap(walk.frames);
  std::vector<double> distances;
  for (const MapPoint& point : walk.map->points)
    distances.push_back(World().DistanceToSurface((world_from_map * point.point_in_map).head<3>()));
  std::sort(distances.begin(), distances.end());
  ASSERT_GT(distances.size(), 200u);
  EXPECT_LT(distances[distances.size() / 2], 0.02);
  EXPECT_LT(distances[distances.size() * 9 / 10], 0.1);
}

TEST(Tracker, IsLostWhileTheLensIsCoveredAndRelocalizesAfterwards) {
  const TrackedWalk& walk = OneWalk();
  ASSERT_NE(walk.map, nullptr);
  for (int i = kFramesOfTheWalk; i < kFramesOfTheWalk + kCoveredFrames; ++i) {
    const TrackedFrame& frame = walk.frames[static_cast<std::size_t>(i)];
    EXPECT_EQ(frame.state, TrackingState::kLost) << i;
    EXPECT_NE(frame.hint, Hint::kNone);
  }
  int back = kFramesOfTheWalk + kCoveredFrames;
  while (back < kAllFrames && !HasPose(walk.frames[static_cast<std::size_t>(back)].state)) ++back;
  ASSERT_LT(back, kFramesOfTheWalk + kCoveredFrames + 6) << "not relocalized in time";
  EXPECT_EQ(walk.frames[static_cast<std::size_t>(back)].state, TrackingState::kRelocalized);
  const Eigen::Matrix4d world_from_map = WorldFromMap(walk.frames);
  for (int i = back; i < kAllFrames; ++i) {
    const TrackedFrame& frame = walk.frames[static_cast<std::size_t>(i)];
    EXPECT_TRUE(HasPose(frame.state)) << i;
    EXPECT_LT(DistanceFromTruth(world_from_map, frame.camera_from_map, WalkPose(i)), 0.05) << i;
  }
}

TEST(Tracker, IsBitIdenticalOnEveryRun) {
  const TrackedWalk again = TakeWalk(1);
  const TrackedWalk& walk = OneWalk();
  for (std::size_t i = 0; i < walk.frames.size(); ++i) {
    const TrackedFrame &a = walk.frames[i], &b = again.frames[i];
    ASSERT_EQ(a.state, b.state) << i;
    EXPECT_EQ(a.hint, b.hint);
    EXPECT_EQ(a.finite_points, b.finite_points);
    const Eigen::Matrix3d rotation_a = a.camera_from_map.rotation.matrix(),
                          rotation_b = b.camera_from_map.rotation.matrix();
    EXPECT_EQ(std::memcmp(rotation_a.data(), rotation_b.data(), sizeof(double) * 9), 0) << i;
    EXPECT_EQ(std::memcmp(a.camera_from_map.translation.data(), b.camera_from_map.translation.data(),
                          sizeof(double) * 3),
              0)
        << i;
    EXPECT_EQ(std::memcmp(a.covariance.data(), b.covariance.data(), sizeof(double) * 36), 0) << i;
  }
  ASSERT_EQ(walk.map->points.size(), again.map->points.size());
  for (std::size_t i = 0; i < walk.map->points.size(); ++i)
    EXPECT_EQ(std::memcmp(walk.map->points[i].point_in_map.data(), again.map->points[i].point_in_map.data(),
                          sizeof(double) * 4),
              0);
}

TEST(Tracker, RelocalizesInAGivenMapWithAPlaceFinder) {
  const TrackedWalk& walk = OneWalk();
  ASSERT_NE(walk.map, nullptr);
  SomeMaps places;
  places.Add(9, walk.map);
  TrackerOptions options;
  options.build_maps = false;
  Tracker tracker(options, Camera(), 3);
  tracker.SetMap(walk.map, 9);
  const Eigen::Matrix4d world_from_map = WorldFromMap(walk.frames);
  int first = -1;
  for (int i = 40; i < 60; ++i) {
    const TrackedFrame frame = tracker.Track(WalkFrame(i), &places);
    if (first < 0 && HasPose(frame.state)) {
      first = i;
      EXPECT_EQ(frame.state, TrackingState::kRelocalized);
    }
    if (first < 0) continue;
    EXPECT_TRUE(HasPose(frame.state)) << i;
    EXPECT_LT(DistanceFromTruth(world_from_map, frame.camera_from_map, WalkPose(i)), 0.05) << i;
  }
  EXPECT_GE(first, 40);
  EXPECT_LT(first, 46);
}

TEST(Tracker, RelocalizesInOverexposedImagesAndKeepsTrackingAtNormalExposure) {
  constexpr double kGain = 2.5;
  const TrackedWalk& walk = OneWalk();
  ASSERT_NE(walk.map, nullptr);
  SomeMaps places;
  places.Add(9, walk.map);
  TrackerOptions options;
  options.build_maps = false;
  Tracker tracker(options, Camera(), 3);
  tracker.SetMap(walk.map, 9);
  const Eigen::Matrix4d world_from_map = WorldFromMap(walk.frames);
  int first = -1;
  for (int i = 40; i < 80; ++i) {
    Frame frame = WalkFrame(i);
    cv::Mat bright;  // the images are shared by all tests
    frame.image.convertTo(bright, -1, kGain);
    if (i < 60) frame.image = bright;
    const TrackedFrame tracked = tracker.Track(frame, &places);
    if (first < 0 && HasPose(tracked.state)) first = i;
    if (first < 0) continue;
    EXPECT_TRUE(HasPose(tracked.state)) << i;
    EXPECT_LT(DistanceFromTruth(world_from_map, tracked.camera_from_map, WalkPose(i)), 0.05) << i;
  }
  EXPECT_GE(first, 40);
  EXPECT_LT(first, 48);
}

TEST(Tracker, RelocalizesOnlyAfterSeveralFramesAgree) {
  const TrackedWalk& walk = OneWalk();
  ASSERT_NE(walk.map, nullptr);
  SomeMaps places;
  places.Add(9, walk.map);
  TrackerOptions options;
  options.build_maps = false;
  Tracker tracker(options, Camera(), 3);
  int first = 0;
  for (int i = 40; i < 60 && first == 0; ++i) {
    const TrackedFrame frame = tracker.Track(WalkFrame(i), &places);
    if (!HasPose(frame.state)) continue;
    first = i;
    EXPECT_EQ(frame.map_key, 9u);
  }
  EXPECT_GE(first, 40 + options.confirming_frames - 1);
  EXPECT_LT(first, 50);
}

TEST(Tracker, IsLostAsSoonAsTheImageShowsAnotherPlace) {
  const TrackedWalk& walk = OneWalk();
  ASSERT_NE(walk.map, nullptr);
  SomeMaps places;
  places.Add(9, walk.map);
  const RenderedWorld other = RenderedWorld::Room(7177);
  TrackerOptions options;
  options.build_maps = false;
  Tracker tracker(options, Camera(), 3);
  tracker.SetMap(walk.map, 9);
  TrackedFrame last;
  for (int i = 40; i < 55; ++i) last = tracker.Track(WalkFrame(i), &places);
  ASSERT_EQ(last.state, TrackingState::kSixDof);
  for (int i = 55; i < 60; ++i) {
    Frame frame = WalkFrame(i);
    frame.image = other.Render(*Camera(), WalkPose(i), 1.5, static_cast<std::uint64_t>(i));
    EXPECT_EQ(tracker.Track(frame, &places).state, TrackingState::kLost) << i;
  }
}

// A device that was suspended, or whose camera was unplugged, may have been carried elsewhere.
TEST(Tracker, IsLostAfterAnInterruptionUntilThePlaceIsRecognized) {
  const TrackedWalk& walk = OneWalk();
  ASSERT_NE(walk.map, nullptr);
  SomeMaps places;
  places.Add(9, walk.map);
  for (const double seconds : {1.0, 3.0}) {
    Tracker tracker({}, Camera(), 3);
    tracker.SetMap(walk.map, 9);
    TrackedFrame tracked;
    for (int i = 40; i < 55; ++i) tracked = tracker.Track(WalkFrame(i), &places);
    ASSERT_EQ(tracked.state, TrackingState::kSixDof);
    Frame frame = WalkFrame(55);
    frame.time += FromSeconds(seconds);
    EXPECT_EQ(tracker.Track(frame, &places).state,
              seconds < 2 ? TrackingState::kSixDof : TrackingState::kRelocalized);
    EXPECT_FALSE(seconds > 2 && tracker.TakeKeyFrameCandidate());
  }
}

TEST(Tracker, DoesNotRelocalizeInAMapOfAnotherPlace) {
  const TrackedWalk& walk = OneWalk();
  ASSERT_NE(walk.map, nullptr);
  SomeMaps places;
  places.Add(9, walk.map);
  const RenderedWorld other = RenderedWorld::Room(7177);
  TrackerOptions options;
  options.build_maps = false;
  Tracker tracker(options, Camera(), 3);
  tracker.SetMap(walk.map, 9);
  for (int i = 40; i < 55; ++i) {
    Frame frame = WalkFrame(i);
    frame.image = other.Render(*Camera(), WalkPose(i), 1.5, static_cast<std::uint64_t>(i));
    EXPECT_EQ(tracker.Track(frame, &places).state, TrackingState::kLost);
  }
}

// Covers the image with a grid of tiles, of which one in `every` is left open.
void CoverTiles(int every, cv::Mat* image) {
  constexpr int kTile = 40;  // pixels
  int tile = 0;
  for (int y = 0; y < image->rows; y += kTile) {
    for (int x = 0; x < image->cols; x += kTile, ++tile) {
      const cv::Rect rectangle = cv::Rect(x, y, kTile, kTile) & cv::Rect(0, 0, image->cols, image->rows);
      if (tile % every != 0) (*image)(rectangle).setTo(128);
    }
  }
}

// A new map that has no depth yet is left for a known one: the search for its first depth ends with it.
TEST(Tracker, SearchesNoInitialPairAfterItHasEnteredAKnownMap) {
  const TrackedWalk& walk = OneWalk();
  ASSERT_NE(walk.map, nullptr);
  SomeMaps places;
  places.Add(9, walk.map);
  const RenderedWorld other = RenderedWorld::Room(7177);
  Tracker tracker({}, Camera(), 3);
  Mapper mapper({});
  tracker.StartNewMap();
  int entered = 0;
  for (int i = 0; i < kFramesOfTheWalk; ++i) {
    Frame frame = WalkFrame(i);
    if (i < 10) frame.image = other.Render(*Camera(), WalkPose(0), 1.5, static_cast<std::uint64_t>(i));
    const TrackedFrame tracked = tracker.Track(frame, &places);
    if (entered > 0 || (HasPose(tracked.state) && tracked.map_key == 9)) {
      ++entered;
      EXPECT_FALSE(tracker.TakeInitialPair()) << i;
      EXPECT_TRUE(HasPose(tracked.state)) << i;
      tracker.SetMap(walk.map, 9);
      continue;
    }
    if (auto candidate = tracker.TakeKeyFrameCandidate(); candidate && mapper.Offer(std::move(*candidate)))
      tracker.KeyFrameAccepted();
    for (int step = 0; step < 20 && !mapper.IsIdle(); ++step) mapper.Step();
    mapper.Step();
    if (mapper.Snapshot()) tracker.SetMap(mapper.Snapshot(), 1);
  }
  EXPECT_GT(entered, kFramesOfTheWalk / 2);
}

TEST(Tracker, KeepsAPoseWithConsensusAlthoughMostPointsAreOccluded) {
  const TrackedWalk& walk = OneWalk();
  ASSERT_NE(walk.map, nullptr);
  TrackerOptions options;
  const Eigen::Matrix4d world_from_map = WorldFromMap(walk.frames);
  for (const bool consensus_suffices : {true, false}) {
    if (!consensus_suffices) options.min_consensus_inliers = 100000;
    SomeMaps places;
    places.Add(9, walk.map);
    Tracker tracker(options, Camera(), 3);
    tracker.SetMap(walk.map, 9);
    for (int i = 40; i < 55; ++i) tracker.Track(WalkFrame(i), &places);
    constexpr int kCovered = 55;
    Frame frame = WalkFrame(kCovered);
    frame.image = frame.image.clone();
    CoverTiles(8, &frame.image);
    const TrackedFrame tracked = tracker.Track(frame, nullptr);
    if (consensus_suffices) {
      ASSERT_EQ(tracked.state, TrackingState::kSixDof);
      EXPECT_LT(tracked.quality, options.lost_quality);
      EXPECT_GE(tracked.finite_points, options.min_consensus_inliers);
      EXPECT_LT(DistanceFromTruth(world_from_map, tracked.camera_from_map, WalkPose(kCovered)), 0.02);
    } else {
      EXPECT_EQ(tracked.state, TrackingState::kLost);
    }
  }
}

TEST(Tracker, ExtendsItsMapAgainAfterAShortLossDespiteOcclusion) {
  constexpr int kCovered = 45, kLost = 78, kBack = 80;
  Lockstep lockstep(WithoutPanoramas(), Camera(), 1);
  std::size_t keyframes = 0;
  for (int i = 0; i < kFramesOfTheWalk; ++i) {
    Frame frame = WalkFrame(i);
    frame.image = frame.image.clone();
    if (i >= kCovered) CoverTiles(3, &frame.image);
    if (i >= kLost && i < kBack) frame.image.setTo(128);
    const TrackedFrame tracked = lockstep.Feed(frame);
    if (i == kBack - 1) keyframes = lockstep.map()->keyframes.size();
  }
  EXPECT_GT(lockstep.map()->keyframes.size(), keyframes + 1);
}

TEST(Tracker, ContinuesRightAfterAShortLossInAMapThatIsOnlyViewedDespiteOcclusion) {
  const TrackedWalk& walk = OneWalk();
  ASSERT_NE(walk.map, nullptr);
  constexpr int kFirst = 40, kLost = 55;
  TrackerOptions options;
  options.build_maps = false;
  SomeMaps places;
  places.Add(9, walk.map);
  Tracker tracker(options, Camera(), 3);
  tracker.SetMap(walk.map, 9);
  const Eigen::Matrix4d world_from_map = WorldFromMap(walk.frames);
  TrackedFrame tracked;
  for (int i = kFirst; i <= kLost + 1; ++i) {
    Frame frame = WalkFrame(i);
    frame.image = frame.image.clone();
    if (i >= kFirst + 5) CoverTiles(3, &frame.image);
    if (i == kLost) frame.image.setTo(128);
    tracked = tracker.Track(frame, &places);
    if (i == kLost - 1) {
      ASSERT_TRUE(HasPose(tracked.state));
    }
    if (i == kLost) {
      ASSERT_EQ(tracked.state, TrackingState::kLost);
    }
  }
  ASSERT_TRUE(HasPose(tracked.state));
  EXPECT_LT(DistanceFromTruth(world_from_map, tracked.camera_from_map, WalkPose(kLost + 1)), 0.02);
}

TEST(Tracker, OffersTheNextFrameAfterAKeyFrameWasRefusedAndWaitsAfterItWasAccepted) {
  const TrackedWalk& walk = OneWalk();
  ASSERT_NE(walk.map, nullptr);
  SomeMaps places;
  places.Add(9, walk.map);
  TrackerOptions options = WithoutPanoramas();
  options.keyframes.min_distance = 1e-6;    // every frame is a new view
  options.max_frames_without_keyframe = 0;  // the map stays as it is
  Tracker tracker(options, Camera(), 3);
  tracker.SetMap(walk.map, 9);
  std::vector<int> offered;
  for (int i = 40; i < 70; ++i) {
    tracker.Track(WalkFrame(i), &places);
    if (!tracker.TakeKeyFrameCandidate()) continue;
    offered.push_back(i);
    if (offered.size() == 2) tracker.KeyFrameAccepted();
  }
  ASSERT_GE(offered.size(), 3u);
  EXPECT_EQ(offered[1], offered[0] + 1);
  EXPECT_EQ(offered[2], offered[1] + options.frames_between_keyframes);
}

// The frames in which a camera that moves away from its map offers a keyframe.
std::vector<int> FramesThatOfferAKeyframe(const TrackerOptions& options) {
  const auto map =
      testing_world::TrueMap(World(), Camera(), {CameraAt({0, 0, 0}), CameraAt({0.1, 0, 0})}).Snapshot();
  SomeMaps places;
  places.Add(9, map);
  Tracker tracker(options, Camera(), 3);
  tracker.SetMap(map, 9);
  std::vector<int> offering;
  int tracked = 0;
  for (int i = 0; i < 36; ++i) {
    const Rigid3 pose = CameraAt({0.1 + 0.012 * i, 0.01, 0.02});
    tracked += HasPose(tracker.Track(testing_world::MakeFrame(i, World(), pose), &places).state);
    if (tracker.TakeKeyFrameCandidate()) {
      offering.push_back(i);
      tracker.KeyFrameAccepted();
    }
    EXPECT_FALSE(tracker.TakeKeyFrameCandidate()) << "it was taken already";
  }
  EXPECT_GT(tracked, 30);
  return offering;
}

TEST(Tracker, OffersEachKeyframeOnceAndWaitsBeforeTheNext) {
  TrackerOptions options;
  options.keyframes.min_distance = 0.05;
  const std::vector<int> offering = FramesThatOfferAKeyframe(options);
  ASSERT_GE(offering.size(), 2u);
  for (std::size_t i = 1; i < offering.size(); ++i)
    EXPECT_GE(offering[i] - offering[i - 1], options.frames_between_keyframes);
}

TEST(Tracker, OffersNoKeyframesToAReadOnlyMap) {
  TrackerOptions options;
  options.keyframes.min_distance = 0.05;
  options.build_maps = false;
  EXPECT_EQ(FramesThatOfferAKeyframe(options), std::vector<int>());
}

TEST(Tracker, OffersNoKeyframesBeforeThereIsAMap) {
  Tracker tracker(WithoutPanoramas(), Camera(), 1);
  tracker.StartNewMap();
  EXPECT_EQ(tracker.state(), CameraState::kStarting);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(tracker.Track(WalkFrame(i), nullptr).state, TrackingState::kInitializing);
    EXPECT_FALSE(tracker.TakeKeyFrameCandidate());
  }
  tracker.Reset();
  EXPECT_EQ(tracker.state(), CameraState::kNoMap);
}

}  // namespace
}  // namespace docent::engine
