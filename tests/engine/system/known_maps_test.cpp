// SPDX-License-Identifier: Apache-2.0
// Tests of the maps that an application adds to a System and removes from it.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <utility>
#include <variant>

#include "engine/system/system.h"
#include "tests/engine/rendered_world.h"

namespace docent::engine {
namespace {

using testing_world::Camera;
using testing_world::CameraAt;

std::shared_ptr<const MapSnapshot> MapOfOneView() {
  return testing_world::TrueMap(testing_world::World(), Camera(), {CameraAt({0, 0, 0})}, 50).Snapshot();
}

class KnownMaps : public ::testing::Test {
 protected:
  static SystemOptions Options() {
    SystemOptions options;
    options.threaded = false;
    return options;
  }

  System system_{Options(), {Camera()}};
};

TEST_F(KnownMaps, AreRemovedFromThePlaceIndexAlthoughTheyAreNotInMemory) {
  system_.place_index().SetMap(1, MapOfOneView());
  system_.place_index().ReleaseMap(1);
  system_.AddMap(1, nullptr, MapPermissions());
  system_.RemoveMap(1);
  EXPECT_EQ(system_.place_index().maps(), 0u);
  for (const SystemEvent& event : system_.TakeEvents()) {
    const auto* const left = std::get_if<MapLeft>(&event.what);
    EXPECT_TRUE(left == nullptr || !left->forgotten) << "it was initialized in an earlier session";
  }
}

TEST_F(KnownMaps, AreFreedWhenTheyAreRemoved) {
  auto map = MapOfOneView();
  const std::weak_ptr<const MapSnapshot> watched = map;
  system_.AddMap(1, std::move(map), MapPermissions());
  system_.RemoveMap(1);
  EXPECT_TRUE(watched.expired());
  auto late = MapOfOneView();
  const std::weak_ptr<const MapSnapshot> loaded_late = late;
  system_.SetSnapshot(1, std::move(late));
  EXPECT_TRUE(loaded_late.expired());
}

TEST(DisconnectedCamera, LetsTheOtherCameraStartAMap) {
  SystemOptions options;
  options.threaded = false;
  options.new_map_when_lost = true;
  System system(options, {Camera(), Camera()});
  const auto map = testing_world::TrueMap(testing_world::World(), Camera(),
                                          {CameraAt({-0.1, 0, 0}), CameraAt({0.1, 0, 0})})
                       .Snapshot();
  system.AddMap(1, map, MapPermissions());
  system.place_index().SetMap(1, map);
  system.EnterMap(1, 0);
  int image = 0;
  TrackedFrame tracked;
  for (; image < 5; ++image)
    tracked = system.Process(testing_world::MakeFrame(image, testing_world::World(), CameraAt({0, 0, 0})));
  ASSERT_TRUE(HasPose(tracked.state));
  const auto starts_a_map = [&] {
    for (const int last = image + 30; image < last; ++image) {
      Frame dark = testing_world::MakeFrame(image, cv::Mat::zeros(480, 640, CV_8UC1));
      dark.camera = 1;
      system.Process(dark);
    }
    const auto events = system.TakeEvents();
    return std::any_of(events.begin(), events.end(), [](const SystemEvent& event) {
      return std::holds_alternative<MapStartedAfterLoss>(event.what);
    });
  };
  EXPECT_FALSE(starts_a_map()) << "the first camera is tracked";
  system.Disconnect(0);
  EXPECT_TRUE(starts_a_map());
}

}  // namespace
}  // namespace docent::engine
