// SPDX-License-Identifier: Apache-2.0
// Many sessions, one after the other, that load a map, leave it, start another one and end: each finds what
// the one before saved, and starts and ends its own mapping thread.
#include <gmock/gmock.h>

#include "app/session/session.h"
#include "app/simulator/simulation.h"
#include "tests/app/support/rendered_walk.h"
#include "tests/app/support/temporary_folder.h"

namespace docent::app {
namespace {

constexpr int kCycles = 200;

RenderedWalk ShortWalk() {
  SimulationOptions options;
  options.camera = engine::CameraModel(engine::LensModel::kRadialTangential,
                                       {320, 240, 179, 179.2, 159.1, 120.05}, {-0.18, 0.03, 0, 0, 0});
  options.frame_rate_hz = 15;
  options.duration_s = 4;
  return {"hand", options};
}

maps::Library OpenForWriting(const std::filesystem::path& path) {
  return maps::Library::Open(path, maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
}

// Builds the map "table" and saves it.
void BuildTable(const RenderedWalk& walk, const std::filesystem::path& path) {
  maps::Library library = OpenForWriting(path);
  SessionOptions options;
  options.threaded = false;
  options.first_map = "table";
  Session session(options, {walk.camera()}, &library);
  for (std::uint64_t i = 0; i < walk.length(); ++i) session.Process(walk.Frame(i));
  session.Finish();
}

TEST(SessionCycle, StartsLoadsLeavesAndEndsTwoHundredTimes) {
  const TemporaryFolder folder;
  const std::filesystem::path path = folder / "l.docent";
  const RenderedWalk walk = ShortWalk();
  BuildTable(walk, path);
  const std::uint64_t built = OpenForWriting(path).FindByName("table").keyframes;
  ASSERT_GT(built, 1u);
  int posed = 0;
  for (int cycle = 0; cycle < kCycles; ++cycle) {
    maps::Library library = OpenForWriting(path);
    SessionOptions options;
    options.tracker.hybrid = cycle % 2 == 0;
    options.may_write = cycle % 5 != 4;
    options.seed = static_cast<std::uint64_t>(cycle) + 1;
    Session session(options, {walk.camera()}, &library);
    std::uint64_t next = static_cast<std::uint64_t>(cycle) % walk.length();
    engine::TrackedFrame frame;
    const auto feed = [&](int count) {
      for (; count > 0; --count) {
        frame = session.Process(walk.Frame(next++));
        posed += engine::HasPose(frame.state);
      }
    };
    feed(1);
    session.Execute(UseMap{"table"}, frame);
    feed(2);
    if (options.may_write) {
      session.Execute(NewMap{"other " + std::to_string(cycle)}, frame);
      feed(1 + cycle % 3);
      session.Execute(StopMap{}, frame);
      feed(1);
      session.Execute(UseMap{"table"}, frame);
      feed(1);
    }
    if (cycle % 3 != 0) session.Finish();  // otherwise the destructor does
  }
  EXPECT_GT(posed, kCycles);
  maps::Library library = OpenForWriting(path);
  EXPECT_THAT(library.Verify(), ::testing::IsEmpty());
  EXPECT_GE(library.FindByName("table").keyframes, built);
}

}  // namespace
}  // namespace docent::app
