// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "app/script/commands.h"
#include "app/session/calibrated_camera.h"
#include "app/session/pace.h"
#include "app/session/play_clock.h"
#include "app/session/session.h"

namespace docent::app {

// Commands given from a window while images are processed. Any thread.
class CommandInbox {
 public:
  // A command and the frame that the user saw when giving it, to which its pixel refers.
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

// How one camera is fed to a session.
struct FrameLoopOptions {
  Pace pace = Pace::kEager;
  int camera = 0;                      // index in the session
  std::vector<TimedCommand> script;    // by ascending time
  std::string script_name;             // for error messages
  std::filesystem::path model_folder;  // folder of the script's models
  CommandInbox* inbox = nullptr;       // may be null
  // Carries out a command that does not concern the session, and returns true; throws Error when it cannot be
  // carried out. On the camera's thread; may be empty.
  std::function<bool(const Command&, const engine::TrackedFrame&)> take;
  // `carried_out` is called after every executed command, with its time from the first image. `refused` is
  // called with the error of a command from the inbox; an error of a script ends the run instead. Both run on
  // the camera's thread and may be empty.
  std::function<void(const TimedCommand&)> carried_out;
  std::function<void(const std::string&)> refused;
  // Called once with the name of a file that a command of the inbox places, when reading it has taken half a
  // second. On the camera's thread; may be empty.
  std::function<void(const std::string&)> reading;
  // Called when the source cannot deliver images, with a sentence for the wearer and the time on its clock,
  // and with an empty sentence when it delivers again. On the camera's thread; may be empty.
  std::function<void(const std::string&, Timestamp)> trouble;
  // Called a few times a second while a device is disconnected, with the last tracked frame, or null before
  // the first one. The commands of the inbox are carried out and what has changed is saved in between. On the
  // camera's thread; may be empty.
  std::function<void(const engine::TrackedFrame* last)> disconnected;
  // Called for every tracked image, before its frame is passed on, with its age: for a device since its
  // timestamp, for a recording in realtime since the time at which it was due. On the camera's thread; may be
  // empty.
  std::function<void(Timestamp)> latency;
  // In realtime: called with images that are fetched while an older one is tracked for long, so that a person
  // sees a window that goes on (UntrackedImages). On another thread, while that of the camera waits. They
  // are passed on as dropped, without their image, after the one that is tracked. Empty: none are fetched.
  std::function<void(const engine::Frame&)> untracked;
  // Of a recording in lockstep or eager pace: no image is processed before as much time has passed since the
  // one before as lies between them, so that a person can follow, unless the clock is in fast forward. None
  // is dropped.
  bool no_faster_than_times = false;
  PlayClock* clock = nullptr;  // the first camera's is used for all; null: the system clock
  // Called about thirty times a second with the last tracked frame while no image is processed: while the
  // clock is stopped, and with `at_end` after the last image, as long as the loop stays there. The commands
  // of the inbox are carried out in between. On the camera's thread, after the last image on that of the
  // first camera; empty: the loop does not pause.
  std::function<void(const engine::TrackedFrame&, bool at_end)> idle;
  bool stays = false;  // after the last image, until stop is requested; of the first camera, for all
};

using FrameCallback = std::function<void(const engine::TrackedFrame&)>;

// Feeds the images of a source to a session until the source ends or stop is requested, executes the script's
// commands, and passes every frame on, including dropped ones. `shown` runs on the calling thread, which is
// the camera's. Throws Error for a fault of the source or of a command's line; everything done before
// remains.
//
//   lockstep   one image after the other; the session runs its mapper in between
//   eager      as fast as the tracker while the mapper is idle, and no faster than the images' times while
//              it works, so never further ahead of the mapper than a camera would be
//   realtime   by the images' times; an image whose successor is due before it is requested is dropped, as
//              a camera would drop it
//
// A stopped clock (PlayClock::IsStopped) holds every pace after the present image.
//
// A live source drops images by itself: images missing between two others are passed on as dropped, each
// frame with its time and no image.
void RunFrames(CalibratedCamera* camera, Session* session, const FrameLoopOptions& options,
               const FrameCallback& shown, const std::stop_token& stop);

// One of several cameras of a session.
struct CameraRun {
  CalibratedCamera* camera = nullptr;
  FrameLoopOptions options;  // all of one pace; options.camera is the index in the list
  FrameCallback shown;       // called on this camera's thread
};

// The same for several cameras in parallel, until the images of the first one end. The first camera runs on
// the calling thread, each other one on a thread of its own. In lockstep all run interleaved on the calling
// thread, by the times of their images; in the eager pace none runs further ahead of the others than one
// image. Cameras whose first images are more than ten seconds apart have separate clocks: they are assumed to
// start together, and times are those of the first camera. The first error stops all cameras and is thrown.
void RunCameras(const std::vector<CameraRun>& cameras, Session* session, const std::stop_token& stop);

}  // namespace docent::app
