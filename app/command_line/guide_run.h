// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <span>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "app/command_line/guide_files.h"
#include "app/command_line/guide_window.h"
#include "app/command_line/run_guide.h"
#include "app/command_line/run_hub.h"
#include "app/command_line/run_sounds.h"
#include "app/command_line/run_watch.h"
#include "app/command_line/visitor_frames.h"
#include "app/command_line/visitor_host.h"
#include "app/evaluation/camera_report.h"

namespace docent::app {

// One run of RunGuide: the session, the frame loops of its cameras and the files they write. What draws the
// frames is up to the caller.
class GuideRun {
 public:
  // Throws Error if a pan-tilt head is requested and no camera has one. The arguments must outlive the run.
  GuideRun(const GuideRequest& request, std::span<CalibratedCamera> cameras);

  // Called on the thread of the frame's camera.
  using Show = std::function<void(std::shared_ptr<const ShownFrame>)>;
  // Saves the maps and closes the files in any case; then throws the first error that occurred, and logs
  // the others. The first camera runs on the calling thread.
  void Run(const Show& show, std::stop_token window_closed);

  // Records the latency of a frame that has reached this stage; see WindowLink::reached. Any thread, as all
  // below.
  void Reached(FrameStage stage, const ShownFrame& frame);
  // See WindowLink::lead.
  std::shared_ptr<const ShownFrame> Lead(std::size_t camera, const GuideVisitor& guide);
  // See WindowLink::used.
  void Used();
  // Adds to the events what the window does about the machine's load.
  void Adapted(const std::string& text) { session_.AddEvent("load", text); }
  std::span<CommandInbox> inboxes() { return inboxes_; }
  // For the author's window; without one they are not filled.
  NoticeQueue* notices() { return &notices_; }
  SavingState Saving() const;
  std::vector<ui::MapFacts> MapsForWindow() const;  // by name
  // See Session::SceneOf.
  std::shared_ptr<const content::Scene> SceneOf(std::uint64_t map_key) const {
    return session_.SceneOf(map_key);
  }
  void DiscardChanges() { session_.DiscardChanges(); }
  // Pauses recordings that are played for an author, or lets them go on.
  void TogglePause();
  // Plays recordings as fast as they can be tracked, or by their times again. Nothing happens with other
  // cameras.
  void ToggleFastForward();
  std::vector<Session::MapState> Maps() const { return session_.Maps(); }

 private:
  // State of one camera; used on its thread only.
  struct CameraState {
    std::optional<Timestamp> first_time;
    std::optional<Timestamp> age;  // Age of the last tracked image when its tracking ended.
    std::string message;
    std::optional<double> message_end_s;  // When a visitor no longer needs it; empty for never.
    std::shared_ptr<const ShownFrame> last;
    bool has_ended = false;  // The recording; its last image stays.
  };

  void WarnAboutUnknownLenses();
  CameraRun RunOf(std::size_t i, const Show& show);
  void HandleRefused(const std::string& reason, CameraState* state);
  void HandleCarriedOut(const TimedCommand& command, std::size_t camera, CameraState* state);
  void HandleTrouble(const std::string& sentence, Timestamp time, const Show& show, CameraState* state);
  void HandleFrame(const engine::TrackedFrame& tracked, const Show& show, CameraState* state);
  // Shows the visitor an image while an older one is tracked. See FrameLoopOptions::untracked.
  void HandleUntracked(const engine::Frame& image, const Show& show);
  // Shows for a while why the visitor's last step was refused, if Lead has an answer since. With files_mutex_
  // held.
  void TakeAnswer(const ShownFrame& frame, CameraState* state);
  // Between images of a paused recording, and after its last one.
  void HandleIdle(const engine::TrackedFrame& tracked, bool at_end, const Show& show, CameraState* state);
  // See FrameLoopOptions::disconnected.
  void HandleDisconnected(const engine::TrackedFrame* last, const Show& show, CameraState* state);
  // Shows the last image with its content as it is now, if that has changed. `message`: where there is no
  // other.
  void ShowAgain(const engine::TrackedFrame& tracked, const std::string& message, const Show& show,
                 CameraState* state);
  bool has_author_window() const { return request_.may_write && !request_.headless; }
  void Warn(const std::vector<Event>& events);
  void Direct(const std::shared_ptr<const ShownFrame>& frame);
  // The sounds that are near the first camera, and their captions. With files_mutex_ held.
  void PlaySounds(ShownFrame* frame);
  // Adds the sentence, if there is one, to the events and to the window's warnings. With files_mutex_ held.
  void ReportProblem(const std::string& problem, Timestamp time);
  std::shared_ptr<ShownFrame> MakeShown(const engine::TrackedFrame& tracked, CameraState* state);
  void WriteDelivery();
  // Reports what goes wrong with the cameras. With files_mutex_ held.
  void Watch(const engine::TrackedFrame& tracked);

  const GuideRequest& request_;
  const std::span<CalibratedCamera> cameras_;
  const bool is_paced_;  // The author works with recordings, which can be paused.
  PausableClock clock_;  // Of recordings.
  RunHub hub_;
  Session session_;
  std::vector<CommandInbox> inboxes_;  // By camera, like camera_states_.
  std::vector<CameraState> camera_states_;
  RunSounds sounds_;                                 // Used with files_mutex_ held.
  std::optional<VisitorHost> host_;                  // Only on a tour. Used with files_mutex_ held.
  std::vector<std::unique_ptr<HeadControl>> heads_;  // Of the cameras that have a pan-tilt head.
  std::stop_source stop_;
  NoticeQueue notices_;
  std::mutex
      files_mutex_;  // Guards files_, tallies_, visitor_frames_, warnings_, host_, watch_ and noticed_.
  std::set<std::string> warnings_;    // Those that the window was told of.
  std::set<std::string> logged_;      // Those of a tour, which has no such window; guarded like these.
  std::vector<CameraTally> tallies_;  // By camera.
  VisitorFrames visitor_frames_;      // Only on a tour it has any.
  std::uint64_t serial_ = 0;          // Of the last frame that was made; guarded like these.
  RunWatch watch_;
  std::string noticed_;  // What the person at the first camera is told next; empty for nothing.
  std::optional<GuideFiles> files_;
};

}  // namespace docent::app
