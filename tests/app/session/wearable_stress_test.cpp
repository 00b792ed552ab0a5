// SPDX-License-Identifier: Apache-2.0
// Two cameras, a mapper, and cameras that are unplugged: sessions begin and end, cameras leave and come back,
// in an order that a seed decides. Meant for ThreadSanitizer, which needs many orders: DOCENT_STRESS_MINUTES
// sets the duration; without it a few sessions are run.
#include <gmock/gmock.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <thread>

#include "app/session/frame_loop.h"
#include "app/session/session.h"
#include "app/simulator/simulation.h"
#include "engine/base/random.h"
#include "tests/app/support/rendered_walk.h"

namespace docent::app {
namespace {

using engine::CameraModel;
using engine::LensModel;

RenderedWalk ShortWalkWith(const std::string& scene, const CameraModel& camera) {
  SimulationOptions options;
  options.camera = camera;
  options.frame_rate_hz = 15;
  options.duration_s = 4;
  return {scene, options};
}

// A device that is unplugged at random: for a while it delivers no images and reports why, then it is back.
class ShakySource : public FrameSource {
 public:
  ShakySource(const RenderedWalk* walk, std::uint64_t seed, int images)
      : walk_(walk), random_(seed), images_(images) {
    info_.name = "shaky";
    info_.live = true;
    info_.nominal_fps = 15;
    info_.known_camera = *walk->camera();
  }

  bool Next(engine::Frame* frame) override {
    if (index_ >= static_cast<std::uint64_t>(images_)) return false;
    ++tick_;
    frame->time = FromSeconds(tick_ / 15.0);
    if (away_ == 0 && random_.Uniform(0, 1) < 0.03) away_ = 1 + static_cast<int>(random_.Uniform(0, 12));
    if (away_ > 0) {
      --away_;
      std::this_thread::sleep_for(std::chrono::microseconds(200));
      return true;
    }
    if (random_.Uniform(0, 1) < 0.05) index_ += 2;  // the driver dropped images
    frame->image = walk_->Image(index_);
    frame->index = index_++;
    return true;
  }
  std::string trouble() const override { return away_ > 0 ? "The camera is unplugged." : ""; }

 private:
  const RenderedWalk* const walk_;
  Random random_;
  const int images_;
  std::uint64_t index_ = 0;
  int tick_ = 0, away_ = 0;
};

struct Tally {
  std::atomic<int> frames = 0, posed = 0, troubles = 0;
};

void RunOneSession(const RenderedWalk walks[2], Random* random, Tally* tally) {
  CalibratedCamera cameras[2];
  const int images = 20 + static_cast<int>(random->Uniform(0, 100));
  for (int i = 0; i < 2; ++i) {
    cameras[i] =
        Calibrate(std::make_unique<ShakySource>(&walks[i], random->Next(), images + 10 * i), std::nullopt);
  }
  SessionOptions options;
  options.tracker.hybrid = random->Uniform(0, 1) < 0.5;
  options.first_map = "table";
  options.seed = random->Next();
  Session session(options, {cameras[0].model, cameras[1].model}, nullptr);
  std::stop_source stop;
  const int stop_after = random->Uniform(0, 1) < 0.4 ? static_cast<int>(random->Uniform(1, images)) : -1;
  CommandInbox inbox;
  std::vector<CameraRun> runs(2);
  std::atomic<int> shown = 0;
  for (int i = 0; i < 2; ++i) {
    runs[i].camera = &cameras[i];
    runs[i].options.camera = i;
    runs[i].options.pace = Pace::kRealtime;
    if (i == 0) runs[i].options.inbox = &inbox;
    runs[i].options.trouble = [tally](const std::string&, Timestamp) { ++tally->troubles; };
    runs[i].options.refused = [](const std::string&) {};
    runs[i].shown = [&, tally](const engine::TrackedFrame& frame) {
      ++tally->frames;
      tally->posed += engine::HasPose(frame.state);
      if (++shown == stop_after) stop.request_stop();
    };
  }
  // Another thread queries the session, as a window does, and starts a new map in between.
  const int new_map_at = static_cast<int>(random->Uniform(5, 150));
  std::jthread watcher([&](const std::stop_token& done) {
    bool asked = false;
    while (!done.stop_requested()) {
      session.Maps();
      session.Rig();
      session.MappingTimes();
      session.TakeEvents();
      if (!asked && shown > new_map_at) {
        inbox.Push({NewMap{"other"}, nullptr});
        asked = true;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  });
  RunCameras(runs, &session, stop.get_token());
  watcher.request_stop();
  watcher.join();
  if (random->Uniform(0, 1) < 0.7) session.Finish();  // otherwise the destructor does
}

TEST(WearableStress, EndsCleanlyWhenCamerasLeaveOrComeBack) {
  const RenderedWalk walks[2] = {
      ShortWalkWith(
          "hand",
          {LensModel::kRadialTangential, {320, 240, 179, 179.2, 159.1, 120.05}, {-0.18, 0.03, 0, 0, 0}}),
      ShortWalkWith("shoulder",
                    {LensModel::kFov, {320, 240, 182.15, 182.15, 160.35, 118.9}, {0.95, 0, 0, 0, 0}})};
  const char* const minutes = std::getenv("DOCENT_STRESS_MINUTES");
  const auto until = std::chrono::steady_clock::now() +
                     std::chrono::seconds(minutes ? static_cast<long>(60 * std::atof(minutes)) : 0);
  constexpr int kFewSessions = 6;
  Random random(2026);
  Tally tally;
  int sessions = 0;
  while (sessions < kFewSessions || std::chrono::steady_clock::now() < until) {
    RunOneSession(walks, &random, &tally);
    ++sessions;
  }
  RecordProperty("sessions", sessions);
  RecordProperty("frames", tally.frames.load());
  RecordProperty("posed", tally.posed.load());
  RecordProperty("troubles", tally.troubles.load());
  EXPECT_GT(tally.frames, 10 * sessions);
  EXPECT_GT(tally.posed, 0);
  EXPECT_GT(tally.troubles, 0);
}

}  // namespace
}  // namespace docent::app
