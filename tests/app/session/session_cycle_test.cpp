// SPDX-License-Identifier: Apache-2.0
// Many sessions, one after the other, that load a map, leave it, start another one and end: each finds what
// the one before saved, and starts and ends its own mapping thread.
#include <gmock/gmock.h>

#include "app/session/session.h"
#include "app/simulator/simulation.h"
#include "tests/app/support/temporary_folder.h"

namespace docent::app {
namespace {

using engine::CameraModel;
using engine::LensModel;

constexpr int kCycles = 200;
constexpr double kFramesASecond = 15;

// A short walk around the table, rendered once and played forwards and backwards.
class Film {
 public:
  Film() {
    SimulationOptions options;
    options.camera = CameraModel(LensModel::kRadialTangential, {320, 240, 179, 179.2, 159.1, 120.05},
                                 {-0.18, 0.03, 0, 0, 0});
    options.frame_rate_hz = kFramesASecond;
    options.duration_s = 4;
    const auto simulation = MakeSimulation("hand", options);
    for (int i = 0; i < simulation->frame_count(); ++i) simulation->Render(i, &images_.emplace_back());
    camera_ = std::make_shared<CameraModel>(simulation->camera());
  }
  engine::Frame At(std::uint64_t index) const {
    const std::uint64_t length = images_.size(), turn = index % (2 * length);
    engine::Frame frame;
    frame.index = index;
    frame.time = FromSeconds(static_cast<double>(index) / kFramesASecond);
    frame.image = images_[turn < length ? turn : 2 * length - 1 - turn];
    return frame;
  }
  std::uint64_t length() const { return images_.size(); }
  const std::shared_ptr<const CameraModel>& camera() const { return camera_; }

 private:
  std::vector<cv::Mat> images_;
  std::shared_ptr<const CameraModel> camera_;
};

maps::Library OpenLibrary(const std::filesystem::path& path) {
  return maps::Library::Open(path, maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
}

// Builds the map "table" and saves it.
void BuildTable(const Film& film, const std::filesystem::path& path) {
  maps::Library library = OpenLibrary(path);
  SessionOptions options;
  options.threaded = false;
  options.tracker.hybrid = true;
  options.first_map = "table";
  Session session(options, {film.camera()}, &library);
  for (std::uint64_t i = 0; i < film.length(); ++i) session.Process(film.At(i));
  session.Finish();
}

TEST(SessionCycle, StartsLoadsLeavesAndEndsTwoHundredTimes) {
  const TemporaryFolder folder;
  const std::filesystem::path path = folder / "l.docent";
  const Film film;
  BuildTable(film, path);
  const std::uint64_t built = OpenLibrary(path).FindByName("table").keyframes;
  ASSERT_GT(built, 1u);
  int posed = 0;
  for (int cycle = 0; cycle < kCycles; ++cycle) {
    maps::Library library = OpenLibrary(path);
    SessionOptions options;
    options.tracker.hybrid = cycle % 2 == 0;
    options.may_write = cycle % 5 != 4;
    options.seed = static_cast<std::uint64_t>(cycle) + 1;
    Session session(options, {film.camera()}, &library);
    std::uint64_t next = static_cast<std::uint64_t>(cycle) % film.length();
    engine::TrackedFrame frame;
    const auto feed = [&](int count) {
      for (; count > 0; --count) {
        frame = session.Process(film.At(next++));
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
  maps::Library library = OpenLibrary(path);
  EXPECT_THAT(library.Verify(), ::testing::IsEmpty());
  EXPECT_GE(library.FindByName("table").keyframes, built);
}

}  // namespace
}  // namespace docent::app
