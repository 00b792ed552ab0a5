// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "app/command_line/options.h"
#include "app/script/commands.h"
#include "app/session/calibrated_camera.h"
#include "app/session/session.h"

namespace docent::app {

// Commands that come while the images run, from a window. Any thread.
class CommandInbox {
 public:
  // A command and the frame that the person saw when giving it: a pixel of it means what was seen there.
  struct Entry {
    Command command;
    std::shared_ptr<const engine::TrackedFrame> frame;
  };
  void Push(Entry entry) {
    const std::scoped_lock lock(mutex_);
    entries_.push_back(std::move(entry));
  }
  std::vector<Entry> TakeAll() {
    const std::scoped_lock lock(mutex_);
    return std::exchange(entries_, {});
  }

 private:
  std::mutex mutex_;
  std::vector<Entry> entries_;
};

// The clock by which recordings are played in realtime and the age of images is told: CLOCK_MONOTONIC,
// which devices stamp their images with, too. Tests bring one of their own. Any thread.
class PlayClock {
 public:
  virtual ~PlayClock() = default;
  virtual Timestamp Now();
  // Returns at `time`, or when stop is requested.
  virtual void WaitUntil(Timestamp time, const std::stop_token& stop);
};

// One camera's way through a session.
struct FrameLoopOptions {
  Pace pace = Pace::kEager;
  int camera = 0;                      // index in the session
  std::vector<TimedCommand> script;    // by ascending time
  std::string script_name;             // for sentences
  std::filesystem::path model_folder;  // where the script's models are
  CommandInbox* inbox = nullptr;       // may be null
  // Told of every command that was carried out, with its time from the first image, and of what was wrong
  // with one from the inbox (a script's fault ends the run instead). On the camera's thread; may be empty.
  std::function<void(const TimedCommand&)> carried_out;
  std::function<void(const std::string&)> refused;
  // Told when the source has no images to give, with a sentence for the wearer and the time on its clock,
  // and with an empty sentence when it is back. On the camera's thread; may be empty.
  std::function<void(const std::string&, Timestamp)> trouble;
  // Told of every image that was tracked, before it is handed on, how long ago it was taken: for a device
  // by its own stamp, for a recording in realtime by the time at which it was due. On the camera's thread;
  // may be empty.
  std::function<void(Timestamp)> latency;
  PlayClock* clock = nullptr;  // of the first camera, for all; null: the machine's
};

using FrameCallback = std::function<void(const engine::TrackedFrame&)>;

// Feeds the images of a source to a session until the source ends or stop is requested, carries out the
// script's commands, and hands every frame on, dropped ones too. `shown` runs on the calling thread, which is
// the camera's. Throws Error for what the source or a command's line has wrong; what was done before stands.
//
//   lockstep   one image after the other; the session runs its mapper in between
//   eager      as fast as the tracker is while the mapper rests, and no faster than the images' times while
//              it works: never further ahead of the mapper than a camera would be
//   realtime   by the images' times; what is overtaken by its successor before it is asked for is dropped,
//              as a camera drops it
//
// A live source drops by itself: what is missing between two of its images is handed on as dropped, each
// frame with its time and no image.
void RunFrames(CalibratedCamera* camera, Session* session, const FrameLoopOptions& options,
               const FrameCallback& shown, const std::stop_token& stop);

// One of several cameras of a session.
struct CameraRun {
  CalibratedCamera* camera = nullptr;
  FrameLoopOptions options;  // of one pace for all; options.camera is the place in the list
  FrameCallback shown;       // on this camera's thread
};

// The same for several cameras side by side, until the first one's images end: the first on the calling
// thread, each other on a thread of its own. In lockstep all take turns on the calling thread, by the times
// of their images, which also hold them together in the other paces: none runs further ahead of the others
// than one image. Cameras whose first images lie more than ten seconds apart have clocks of their own:
// they are taken to begin together, and times are the first camera's. The first fault stops all and is
// thrown.
void RunCameras(const std::vector<CameraRun>& cameras, Session* session, const std::stop_token& stop);

}  // namespace docent::app
