// SPDX-License-Identifier: Apache-2.0
// The bays of the simulated museum have the same cabinets, walls and floors, and differ in their exhibits
// only.
#include <gtest/gtest.h>

#include "tests/end_to_end/mapped_museum.h"

namespace docent::app {
namespace {

// An author maps the first bay and passes by three others, of which no map exists.
TEST(UnmappedPlaces, AreNotTakenForAMappedPlaceWithTheSameFurniture) {
  MappedMuseum mapped("museum:4,fps=8");
  const TrueMuseum& museum = mapped.museum();
  const double bay_ends = museum.End("build0");
  mapped.Author("0 map new \"Bay 0\"\n" + FormatNumber(bay_ends) + " map stop\n", museum.End("build3"));
  const std::vector<Row> frames = ReadFrames(mapped.folder() / "author/frames.csv");
  const engine::Sim3 world_from_map = WorldFromMap(museum, frames, "Bay 0");
  int named = 0, elsewhere = 0;
  for (const Row& row : frames) {
    const Timestamp time = *ParseSeconds(row.at("timestamp"));
    if (ToSeconds(time) > museum.Begin("build1")) ++elsewhere;
    if (row.at("map").empty() || row.at("tx").empty() || row.at("state") == "panorama") continue;
    const Eigen::Vector3d camera = world_from_map * VectorIn(row, "tx", "ty", "tz");
    const double error_m = (camera - museum.CameraAt(time).translation).norm();
    EXPECT_LT(error_m, 0.3) << testing::PrintToString(row);
    ++named;
  }
  EXPECT_GT(named, 30);
  EXPECT_GT(elsewhere, 100);
}

}  // namespace
}  // namespace docent::app
