// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "engine/geometry/sim3.h"
#include "tests/engine/geometry/test_math.h"
#include "tests/engine/lockstep.h"
#include "tests/engine/mapping/panorama/panorama_scene.h"

// Runs a tracker with panorama maps, and its mapper, on images of a synthetic room: immediate initialization,
// a walk, a pure rotation far beyond the field of view of the walk, and the way back.
namespace docent::engine {
namespace {

using testing_world::Camera;
using testing_world::CameraAt;
using testing_world::RenderedWorld;

constexpr int kStillFrames = 6, kWalkFrames = 90, kTurnFrames = 80, kHoldFrames = 10, kWalkAgainFrames = 20;
constexpr int kTurnBegin = kStillFrames + kWalkFrames, kTurnEnd = kTurnBegin + 2 * kTurnFrames + kHoldFrames;
constexpr int kTourFrames = kTurnEnd + kWalkAgainFrames;
constexpr double kWallDistance = 3;  // metres to the walls

// The camera moves forwards, sideways and back to the centre, then rotates by 110 degrees to the right
// without translation, and back.
Rigid3 TourPose(int frame) {
  const auto walk = [](double part) {
    const double angle = 2 * kPi * part;
    return Eigen::Vector3d(0.4 * std::sin(angle), 0.05 * std::sin(2 * angle), 0.1 * (1 - std::cos(angle)));
  };
  if (frame < kStillFrames) return CameraAt({0, 0, 0});
  if (frame < kTurnBegin) {
    const Eigen::Vector3d place = walk(static_cast<double>(frame - kStillFrames) / kWalkFrames);
    return CameraAt(place, {4 * place.y(), -8 * place.x(), 0});
  }
  if (frame < kTurnEnd) {
    const int from_begin = frame - kTurnBegin, from_end = kTurnEnd - frame;
    const double part = std::min({from_begin, from_end, kTurnFrames}) / static_cast<double>(kTurnFrames);
    return CameraAt({0, 0, 0}, {0, 55 * (1 - std::cos(kPi * part)), 0});
  }
  return CameraAt(walk(static_cast<double>(frame - kTurnEnd) / kWalkFrames), {0, 0, 0});
}

const std::vector<cv::Mat>& TourImages() {
  static const std::vector<cv::Mat> images = [] {
    const RenderedWorld world = testing_world::Chamber(101);
    std::vector<cv::Mat> rendered;
    for (int i = 0; i < kTourFrames; ++i)
      rendered.push_back(world.Render(*Camera(), TourPose(i), 1.5, static_cast<std::uint64_t>(i) + 1));
    return rendered;
  }();
  return images;
}

Frame TourFrame(int index) {
  return testing_world::MakeFrame(index, TourImages()[static_cast<std::size_t>(index)]);
}

struct Tour {
  std::vector<TrackedFrame> frames;
  std::vector<MapperEvent> events;
  std::shared_ptr<const MapSnapshot> map;

  const TrackedFrame& At(int index) const { return frames[static_cast<std::size_t>(index)]; }
};

template <typename FrameAt>
Tour TakeFrames(bool hybrid, int frames, const FrameAt& frame_at) {
  TrackerOptions options;
  options.hybrid = hybrid;
  Lockstep lockstep(options, Camera(), 1);
  Tour tour;
  for (int i = 0; i < frames; ++i) tour.frames.push_back(lockstep.Feed(frame_at(i)));
  tour.map = lockstep.map();
  tour.events = lockstep.events();
  return tour;
}

Tour TakeTour(bool hybrid) {
  return TakeFrames(hybrid, kTourFrames, TourFrame);
}

const Tour& HybridTour() {
  static const Tour tour = TakeTour(true);
  return tour;
}

int FirstFrameWithDepth(const Tour& tour) {
  int first = 0;
  while (first < kTourFrames && !(tour.At(first).map && tour.At(first).map->HasFinitePoints())) ++first;
  return first;
}

TEST(HybridTracker, TracksFromTheFirstImage) {
  const Tour& tour = HybridTour();
  EXPECT_EQ(tour.At(0).state, TrackingState::kInitializing);
  for (int i = 1; i < kStillFrames; ++i) {
    ASSERT_EQ(tour.At(i).state, TrackingState::kPanorama) << i;
    EXPECT_EQ(tour.At(i).finite_points, 0);
    EXPECT_GT(tour.At(i).infinite_points, 50);
    // The camera has neither moved nor rotated.
    EXPECT_LT(tour.At(i).camera_from_map.OriginInSource().norm(), 1e-9) << i;
    EXPECT_LT(tour.At(i).camera_from_map.rotation.Angle(), Radians(0.05)) << i;
  }
  EXPECT_TRUE(std::holds_alternative<MapperEvent::PanoramaOpened>(tour.events.front().what));
}

TEST(HybridTracker, GainsDepthWithoutLosingFramesOrKeyframes) {
  const Tour& tour = HybridTour();
  const int first = FirstFrameWithDepth(tour);
  ASSERT_LT(first, kStillFrames + kWalkFrames / 2);
  ASSERT_GT(first, kStillFrames) << "no depth without parallax";
  for (int i = 1; i < kTurnBegin; ++i) {
    EXPECT_TRUE(HasPose(tour.At(i).state)) << i;
    EXPECT_EQ(tour.At(i).map_key, 1u) << i;
  }
  const auto before = tour.At(first - 1).map;
  ASSERT_FALSE(before->keyframes.empty());
  for (const KeyFrame& keyframe : before->keyframes) {
    const KeyFrame* still = tour.At(first).map->FindKeyFrame(keyframe.id);
    ASSERT_NE(still, nullptr) << keyframe.id;
    EXPECT_EQ(still->time, keyframe.time);
  }
}

// The mapper needs up to half a second for the first depth, and the camera does not wait for it.
TEST(HybridTracker, KeepsTheRotationOfTheImagesThatCameWhileTheFirstDepthWasMade) {
  constexpr int kImagesMeanwhile = 12;
  constexpr double kTurn_deg = 2;  // per image
  const RenderedWorld world = testing_world::Chamber(101);
  Tracker tracker({}, Camera(), 1);
  Mapper mapper({});
  tracker.StartNewMap();
  std::optional<InitialPair> pair;
  int image = 0;
  const auto map = [&] {
    for (int step = 0; step < 20 && !mapper.IsIdle(); ++step) mapper.Step();
    mapper.Step();
    if (mapper.Snapshot()) tracker.SetMap(mapper.Snapshot(), 1);
  };
  for (; image < kTurnBegin && !pair; ++image) {
    tracker.Track(TourFrame(image), nullptr);
    pair = tracker.TakeInitialPair();
    if (pair) break;
    if (auto candidate = tracker.TakeKeyFrameCandidate(); candidate && mapper.Offer(std::move(*candidate)))
      tracker.KeyFrameAccepted();
    map();
  }
  ASSERT_TRUE(pair);
  const auto turn_on = [&](int images) {
    const Rigid3 pose = CameraAt({0, 0, 0}, {0, kTurn_deg * images, 0}) * TourPose(image);
    return tracker.Track(testing_world::MakeFrame(image + images, world, pose), nullptr);
  };
  for (int i = 1; i <= kImagesMeanwhile; ++i) ASSERT_TRUE(HasPose(turn_on(i).state)) << i;
  ASSERT_TRUE(mapper.Start(std::move(*pair)));
  map();
  ASSERT_TRUE(mapper.Snapshot()->HasFinitePoints());
  const TrackedFrame tracked = turn_on(kImagesMeanwhile + 1);
  EXPECT_TRUE(HasPose(tracked.state));
  EXPECT_GT(tracked.finite_points, 30);
}

TEST(HybridTracker, TracksAPureRotationAndReturns) {
  const Tour& tour = HybridTour();
  const int first = FirstFrameWithDepth(tour);
  ASSERT_LT(first, kTurnBegin);
  int lost = 0, by_directions = 0;
  for (int i = kTurnBegin; i < kTourFrames; ++i) {
    lost += !HasPose(tour.At(i).state);
    by_directions +=
        tour.At(i).state == TrackingState::kPanorama || tour.At(i).state == TrackingState::kHybrid;
  }
  EXPECT_EQ(lost, 0);
  EXPECT_GT(by_directions, kTurnFrames);
  // Angles need no alignment with the truth. Checked are the rotation since the end of the walk at its
  // maximum and
  // after the return.
  const auto turn_error_deg = [&](int from, int to) {
    const Rotation3 tracked =
        tour.At(to).camera_from_map.rotation * tour.At(from).camera_from_map.rotation.inverse();
    const Rotation3 truth = TourPose(to).rotation * TourPose(from).rotation.inverse();
    return Degrees(AngleBetween(tracked, truth));
  };
  EXPECT_LT(turn_error_deg(kTurnBegin, kTurnBegin + kTurnFrames + kHoldFrames / 2), 1.0);
  EXPECT_LT(turn_error_deg(kTurnBegin, kTurnEnd), 0.5);
}

TEST(HybridTracker, KeepsItsPositionAccuracyAfterTheRotation) {
  const Tour& tour = HybridTour();
  const int first = FirstFrameWithDepth(tour);
  ASSERT_LT(first, kTurnBegin);
  std::vector<Eigen::Vector3d> in_map, in_truth;
  for (int i = first + 1; i < kTurnBegin; ++i) {
    if (tour.At(i).finite_points == 0) continue;
    in_map.push_back(tour.At(i).camera_from_map.OriginInSource());
    in_truth.push_back(TourPose(i).OriginInSource());
  }
  const auto truth_from_map = AlignSim3(in_truth, in_map);
  ASSERT_TRUE(truth_from_map);
  for (int i = kTurnEnd; i < kTourFrames; ++i) {
    EXPECT_GT(tour.At(i).finite_points, 0) << i;
    const Eigen::Vector3d center = *truth_from_map * tour.At(i).camera_from_map.OriginInSource();
    EXPECT_LT((center - TourPose(i).OriginInSource()).norm(), 0.02 * kWallDistance) << i;
  }
}

TEST(HybridTracker, MakesAMapWithFiniteAndInfinitePoints) {
  const Tour& tour = HybridTour();
  ASSERT_NE(tour.map, nullptr);
  EXPECT_EQ(Validate(*tour.map), "");
  EXPECT_TRUE(tour.map->HasFinitePoints());
  EXPECT_GE(tour.map->panoramas.size(), 2u) << "one from the initialization, one from the rotation";
  int dependent = 0, infinite = 0;
  for (const KeyFrame& keyframe : tour.map->keyframes) dependent += keyframe.kind == KeyFrameKind::kPanorama;
  for (const MapPoint& point : tour.map->points) infinite += point.infinite();
  EXPECT_GT(dependent, 2);
  EXPECT_GT(infinite, 200);
  // This camera rotates about its own centre: dependent keyframes have the position of their reference, up to
  // noise.
  for (const KeyFrame& keyframe : tour.map->keyframes) {
    if (keyframe.kind != KeyFrameKind::kPanorama) continue;
    const KeyFrame* reference = tour.map->FindKeyFrame(tour.map->FindPanorama(keyframe.panorama)->reference);
    EXPECT_LT(
        (keyframe.camera_from_map.OriginInSource() - reference->camera_from_map.OriginInSource()).norm(),
        0.01);
  }
}

// At the maximum rotation, where the map has infinite points only, the camera starts to move forwards.
TEST(HybridTracker, IsLostWhenTheCameraTranslatesWhereOnlyInfinitePointsAreMapped) {
  constexpr int kWalkBegins = kTurnBegin + kTurnFrames + kHoldFrames, kWalkAhead = 40;
  const auto world = testing_world::Chamber(101);
  const Rigid3 turned = TourPose(kWalkBegins);
  const Eigen::Vector3d ahead = turned.rotation.inverse() * Eigen::Vector3d(0, 0, 1);
  const Tour tour = TakeFrames(true, kWalkBegins + kWalkAhead, [&](int index) {
    if (index < kWalkBegins) return TourFrame(index);
    const Eigen::Vector3d center = 0.03 * (index - kWalkBegins + 1) * ahead;
    const Rigid3 pose(turned.rotation, -(turned.rotation * center));
    return testing_world::MakeFrame(index, world, pose);
  });
  EXPECT_EQ(tour.At(kWalkBegins - 1).state, TrackingState::kPanorama);
  int lost = 0, hints = 0;
  for (int i = kWalkBegins; i < kWalkBegins + kWalkAhead; ++i) {
    lost += tour.At(i).state == TrackingState::kLost;
    hints += tour.At(i).hint == Hint::kLeftMap;
    if (!HasPose(tour.At(i).state)) continue;
    // While there is a pose, the translation does not affect the rotation.
    EXPECT_LT(
        (tour.At(i).camera_from_map.rotation * tour.At(kWalkBegins - 1).camera_from_map.rotation.inverse())
            .Angle(),
        0.02)
        << i;
  }
  EXPECT_GT(lost, kWalkAhead / 2);
  EXPECT_GE(hints, 1);
}

// While a pose after a loss waits for confirmation, nothing is added to the map. When the camera then turns
// to where nothing is mapped, the image alone could tell its rotation for seconds.
// While the map has no depth, the camera returns from a loss to where it was, not to the map's first image.
TEST(HybridTracker, IsFoundAgainWhereItHasTurnedTo) {
  constexpr int kTurned = 50, kCovered = 2, kAgain = 10;
  const RenderedWorld world = testing_world::Chamber(101);
  const auto frame_at = [&](int i) {
    const bool covered = i >= kTurned && i < kTurned + kCovered;
    const double angle_deg = std::min(i, kTurned);
    const cv::Mat image = covered
                              ? cv::Mat(Camera()->height_px(), Camera()->width_px(), CV_8UC1, cv::Scalar(128))
                              : world.Render(*Camera(), CameraAt({0, 0, 0}, {0, angle_deg, 0}), 1.5,
                                             static_cast<std::uint64_t>(i) + 1);
    return testing_world::MakeFrame(i, image);
  };
  const Tour tour = TakeFrames(true, kTurned + kCovered + kAgain, frame_at);
  EXPECT_FALSE(tour.map->HasFinitePoints());
  for (int i = 1; i < kTurned; ++i) ASSERT_EQ(tour.At(i).state, TrackingState::kPanorama) << i;
  for (int i = kTurned + kCovered; i < kTurned + kCovered + kAgain; ++i) {
    EXPECT_TRUE(HasPose(tour.At(i).state)) << i;
    EXPECT_NEAR(tour.At(i).camera_from_map.rotation.Angle(), Radians(kTurned), Radians(0.5)) << i;
  }
}

TEST(HybridTracker, LeavesTheMapWhenAPoseThatWasNotConfirmedSeesNothingOfIt) {
  TrackerOptions options;
  options.confirming_frames = kTourFrames;
  Lockstep lockstep(options, Camera(), 1);
  bool left = false;
  int found_again = 0, by_image_alone = 0;
  for (int i = 0; i < kTurnBegin + kTurnFrames && !left; ++i) {
    Frame frame = TourFrame(i);
    const bool covered = i >= kTurnBegin - 6 && i < kTurnBegin - 3;
    if (covered) frame.image = cv::Mat::zeros(frame.image.size(), frame.image.type());
    const TrackedFrame tracked = lockstep.Feed(frame);
    if (i < kTurnBegin - 6) continue;
    found_again += tracked.state == TrackingState::kRelocalized;
    by_image_alone +=
        tracked.state == TrackingState::kPanorama && tracked.finite_points + tracked.infinite_points == 0;
    left = tracked.left_map;
    EXPECT_TRUE(!left || tracked.state == TrackingState::kLost);
  }
  EXPECT_EQ(found_again, 1);
  EXPECT_TRUE(left);
  EXPECT_EQ(by_image_alone, 0);
}

TEST(PlainTracker, MakesNoPanoramaMaps) {
  const Tour tour = TakeTour(false);
  ASSERT_NE(tour.map, nullptr);
  EXPECT_TRUE(tour.map->panoramas.empty());
  for (int i = 0; i < kTourFrames; ++i) {
    EXPECT_NE(tour.At(i).state, TrackingState::kPanorama) << i;
    EXPECT_NE(tour.At(i).state, TrackingState::kHybrid) << i;
    EXPECT_EQ(tour.At(i).infinite_points, 0) << i;
  }
}

}  // namespace
}  // namespace docent::engine
