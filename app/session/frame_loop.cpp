// SPDX-License-Identifier: Apache-2.0
#include "app/session/frame_loop.h"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>

#include "app/session/camera_feed.h"
#include "engine/base/error.h"
#include "engine/base/worker.h"

namespace docent::app {

namespace {

// Synchronizes cameras that are processed as fast as possible: none proceeds to an image that is later, by
// more than the slack, than one that another camera has not finished. Any thread.
class ImageGate {
 public:
  ImageGate(std::size_t cameras, Timestamp slack) : cameras_(cameras), slack_(slack) {}

  void Wait(std::size_t camera, Timestamp time, const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    cameras_[camera] = {time, false};
    changed_.notify_all();
    changed_.wait(lock, stop, [&] {
      // A difference of times is in range where the sum of a time and a long period is not.
      return std::all_of(cameras_.begin(), cameras_.end(), [&](const Camera& other) {
        return other.left || (other.time && time - *other.time <= slack_);
      });
    });
  }
  // The camera has no more images, or none for now.
  void Leave(std::size_t camera) {
    const std::scoped_lock lock(mutex_);
    cameras_[camera].left = true;
    changed_.notify_all();
  }

 private:
  struct Camera {
    std::optional<Timestamp> time;  // of the image that it is at
    bool left = false;
  };

  std::vector<Camera> cameras_;
  const Timestamp slack_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
};

void PreloadModels(const FrameLoopOptions& options, Session* session) {
  for (const TimedCommand& command : options.script) {
    try {
      session->Preload(command.command, options.model_folder);
    } catch (const Error& error) {
      throw Error(options.script_name + ", line " + std::to_string(command.line) + ": " + error.what());
    }
  }
}

// Runs all cameras on this thread, always the one with the oldest image next; the first one of equally old
// ones.
void RunInterleaved(std::vector<CameraFeed>* feeds, const std::stop_token& stop) {
  std::vector<CameraFeed*> running;
  for (CameraFeed& feed : *feeds) running.push_back(&feed);
  while (!stop.stop_requested()) {
    const auto oldest = std::min_element(running.begin(), running.end(),
                                         [](const auto* a, const auto* b) { return a->time() < b->time(); });
    (*oldest)->Handle(stop);
    (*oldest)->Pause(stop);
    if ((*oldest)->Fetch(stop)) continue;
    if (*oldest == &feeds->front()) return;
    (*oldest)->Disconnect();
    running.erase(oldest);
  }
}

void RunConcurrently(std::vector<CameraFeed>* feeds, Pace pace, std::stop_source* stopping) {
  const std::stop_token stop = stopping->get_token();
  ImageGate gate(feeds->size(), feeds->front().period());
  for (std::size_t i = 0; i < feeds->size(); ++i) {
    if ((*feeds)[i].live()) gate.Leave(i);  // devices need no synchronization
  }
  const auto run = [&](std::size_t i) {
    CameraFeed& feed = (*feeds)[i];
    try {
      do {
        if (pace == Pace::kEager && !feed.live()) gate.Wait(i, feed.time(), stop);
        feed.Handle(stop);
        feed.Pause(stop);
      } while (!stop.stop_requested() && feed.Fetch(stop));
      // With the images of the first camera, the run ends.
      if (i > 0 && !stop.stop_requested()) feed.Disconnect();
      gate.Leave(i);
    } catch (...) {
      gate.Leave(i);
      stopping->request_stop();
      throw;
    }
  };
  std::vector<std::unique_ptr<Worker>> others;
  for (std::size_t i = 1; i < feeds->size(); ++i) {
    others.push_back(std::make_unique<Worker>("camera " + std::to_string(i),
                                              [&run, i](const std::stop_token&) { run(i); }));
  }
  std::exception_ptr fault;
  try {
    run(0);
  } catch (...) {
    fault = std::current_exception();
  }
  stopping->request_stop();
  for (const auto& other : others) {
    try {
      other->Join();
    } catch (...) {
      if (!fault) fault = std::current_exception();
    }
  }
  if (fault) std::rethrow_exception(fault);
}

// After the last images, the person goes on working with them.
void StayAtEnd(std::vector<CameraFeed>* feeds, const std::stop_token& stop) {
  const auto begin = std::chrono::steady_clock::now();
  while (!stop.stop_requested()) {
    for (CameraFeed& feed : *feeds) feed.CarryOut(std::chrono::steady_clock::now() - begin, true);
    CameraFeed::Rest(stop);
  }
}

}  // namespace

void RunCameras(const std::vector<CameraRun>& cameras, Session* session, const std::stop_token& stop) {
  constexpr Timestamp kSameClock = std::chrono::seconds(10);
  for (const CameraRun& run : cameras) PreloadModels(run.options, session);
  std::stop_source stopping;
  const std::stop_callback forward(stop, [&stopping] { stopping.request_stop(); });
  PlayClock machine;
  RealtimeClock clock(cameras.front().options.clock ? cameras.front().options.clock : &machine);
  std::vector<CameraFeed> feeds;
  feeds.reserve(cameras.size());
  for (const CameraRun& run : cameras) {
    CameraFeed& feed = feeds.emplace_back(run, session, &clock);
    if (!feed.Fetch(stop)) {
      if (!stop.stop_requested()) feed.CheckAllDone();
      return;
    }
    const Timestamp ahead = feed.time() - feeds.front().time();
    if (ahead > kSameClock || ahead < -kSameClock) feed.SetClockOffset(ahead);
  }
  // Only after all first images are there; otherwise cameras that waited for the others would start late.
  clock.Start(feeds.front().time());
  const Pace pace = cameras.front().options.pace;
  if (pace == Pace::kLockstep) {
    RunInterleaved(&feeds, stopping.get_token());
  } else {
    RunConcurrently(&feeds, pace, &stopping);
  }
  if (!stop.stop_requested()) {
    for (const CameraFeed& feed : feeds) feed.CheckAllDone();
    if (cameras.front().options.stays) StayAtEnd(&feeds, stop);
  }
  // A person who quits has given these commands before.
  for (CameraFeed& feed : feeds) feed.CarryOutGiven(true);
}

void RunFrames(CalibratedCamera* camera, Session* session, const FrameLoopOptions& options,
               const FrameCallback& shown, const std::stop_token& stop) {
  RunCameras({{camera, options, shown}}, session, stop);
}

}  // namespace docent::app
