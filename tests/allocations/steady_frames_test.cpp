// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <opencv2/core.hpp>
#include <vector>

#include "engine/tracking/tracker.h"
#include "tests/allocations/allocation_counter.h"
#include "tests/engine/rendered_world.h"

namespace docent::engine {
namespace {

using testing_allocations::AllocationsOfThisThread;
using testing_world::Camera;
using testing_world::CameraAt;
using testing_world::World;

constexpr int kFrames = 24;  // frames of one sideways oscillation
constexpr std::uint64_t kKey = 1;

Rigid3 Pose(int frame) {
  const double phase = 2 * M_PI * frame / kFrames;
  return CameraAt({0.06 * std::sin(phase), 0.02 * std::sin(2 * phase), 0}, {0, -1.5 * std::sin(phase), 0});
}

struct Scene {
  std::shared_ptr<const MapSnapshot> map;
  std::vector<cv::Mat> images;
};

const Scene& TheScene() {
  static const Scene scene = [] {
    Scene made;
    made.map = testing_world::TrueMap(World(), Camera(),
                                      {CameraAt({-0.1, 0, 0}), CameraAt({0, 0, 0}), CameraAt({0.1, 0, 0})})
                   .Snapshot();
    for (int i = 0; i < kFrames; ++i)
      made.images.push_back(World().Render(*Camera(), Pose(i), 1.5, static_cast<std::uint64_t>(i) + 1));
    return made;
  }();
  return scene;
}

class OneMap : public PlaceFinder {
 public:
  std::vector<PlaceCandidate> FindPlaces(const PlaceQuery&, int, int, std::uint64_t) const override {
    return {{kKey, TheScene().map, TheScene().map->keyframes[1].id, 0.0}};
  }
};

// Adding a keyframe allocates memory that the mapper keeps, so that keyframes are disabled here.
TrackerOptions WithoutKeyFrames() {
  TrackerOptions options;
  options.frames_between_keyframes = std::numeric_limits<int>::max();
  return options;
}

// Expects that no frame of an oscillation allocates memory, after a few identical oscillations.
void ExpectNoAllocations(const TrackerOptions& options) {
  cv::setNumThreads(1);
  const OneMap places;
  Tracker tracker(options, Camera(), 1);
  tracker.SetMap(TheScene().map, kKey);
  TrackedFrame tracked;
  constexpr int kWarmUp = 6 * kFrames;
  for (int i = 0; i < kWarmUp + kFrames; ++i) {
    const Frame frame = testing_world::MakeFrame(i, TheScene().images[static_cast<std::size_t>(i % kFrames)]);
    const std::size_t before = AllocationsOfThisThread();
    tracker.Track(frame, &places, &tracked);
    const std::size_t taken = AllocationsOfThisThread() - before;
    if (i < kWarmUp) continue;
    ASSERT_TRUE(HasPose(tracked.state)) << i;
    ASSERT_GT(tracked.quality, 0.5) << i;
    EXPECT_EQ(taken, 0u) << "in frame " << i;
  }
}

TEST(AllocationCounter, CountsAllocations) {
  static int* volatile number;  // volatile, because the compiler could otherwise remove the allocation
  const std::size_t before = AllocationsOfThisThread();
  number = new int(3);
  const std::size_t after = AllocationsOfThisThread();
  delete number;
  EXPECT_EQ(after - before, 1u);
  const cv::Mat image(10, 10, CV_8UC1);
  EXPECT_GT(AllocationsOfThisThread(), after);
}

TEST(SteadyFrames, AllocateNothingInAReadOnlyMap) {
  TrackerOptions options;
  options.build_maps = false;
  ExpectNoAllocations(options);
}

TEST(SteadyFrames, AllocateNothingWhileAMapIsBuilt) {
  ExpectNoAllocations(WithoutKeyFrames());
}

TEST(SteadyFrames, AllocateNothingWithoutPanoramaMaps) {
  TrackerOptions options = WithoutKeyFrames();
  options.hybrid = false;
  ExpectNoAllocations(options);
}

}  // namespace
}  // namespace docent::engine
