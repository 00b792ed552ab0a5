// SPDX-License-Identifier: Apache-2.0
// Tests of the maps that an application adds to a System and removes from it.
#include <gtest/gtest.h>

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

}  // namespace
}  // namespace docent::engine
