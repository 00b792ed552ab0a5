// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "app/output/run_output.h"
#include "app/script/commands.h"
#include "app/session/content_commands.h"
#include "app/session/map_commands.h"
#include "app/session/map_keys.h"
#include "app/session/mapping_status.h"
#include "app/session/session_assets.h"
#include "app/session/session_memory.h"
#include "app/session/session_options.h"
#include "app/session/session_saving.h"
#include "app/session/session_state.h"
#include "app/session/system_event_handler.h"
#include "engine/system/system.h"
#include "maps/library/library.h"

namespace docent::app {

// The common core of authoring, touring, evaluation and the demo: an engine::System with what an application
// adds to it: maps that have names and policies and are kept in a library, and their content. The uses differ
// only in their options: with or without a library, with or without the right to write.
//
// Threads: Process(frame) and Execute() are called on the thread of the frame's camera (frame.camera);
// everything else may be called from any thread. Process waits neither for the mapper nor for a disk. Times
// are those of the images; no system clock influences the results.
//
// Invariants: a map is extended only while its policy and the session's rights allow it. A map that replaces
// a discarded one takes over its name; a map that was started after a loss gets the name of the previous one
// with a number. What happens in the system becomes events in words and, where maps change, moves their
// content along.
class Session {
 public:
  // library may be null (nothing is saved) and must outlive the session. Its index is read at the start and
  // its maps when they are needed (see maps::MapPager); throws Error when a map that is read at the start is
  // invalid. A session that may write needs a library opened for writing.
  Session(const SessionOptions& options, std::vector<std::shared_ptr<const engine::CameraModel>> cameras,
          maps::Library* library);
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  // Tracks one image, offers it to the mapper and applies the result to the session.
  engine::TrackedFrame Process(const engine::Frame& frame);
  // Does what is due while no images come, for instance because a recording is paused: applies what the
  // mapper has done meanwhile, and saves. `time` is that of the last image and what has passed since then.
  void Idle(Timestamp time);
  // The camera delivers no images until the next Process with one of them (see engine::System::Disconnect).
  void Disconnect(std::size_t camera) { system_.Disconnect(camera); }
  // Details of the frame that Process returned last as `frame`; on the thread of its camera.
  engine::FrameInspection Inspect(const engine::TrackedFrame& frame) const { return system_.Inspect(frame); }
  // Delays a source that delivers faster than a camera; see engine::System::WaitUntilIdle.
  void WaitUntilIdle(std::chrono::steady_clock::time_point latest, const std::stop_token& stop) {
    system_.WaitUntilIdle(latest, stop);
  }

  // Executes a command at a frame that was processed before; its pixel refers to that frame. Throws Error
  // with one sentence, without full stop, when it cannot be executed; then nothing has changed. Relative
  // model files are searched in model_folder first (a script's own folder), then in the working folder.
  void Execute(const Command& command, const engine::TrackedFrame& frame,
               const std::filesystem::path& model_folder = {});
  // Whether the command's model, image or sound is not known yet, or was written anew since.
  bool MustRead(const Command& command, const std::filesystem::path& model_folder);
  // Reads the model, image or sound of a command in advance, so that an error shows before anything is built,
  // and no frame waits for it. Any thread. Throws Error.
  void Preload(const Command& command, const std::filesystem::path& model_folder);

  // Shows the content that other programs have stored for these maps of the library since. Call it on a
  // thread that may wait for the disk, of a session that does not write.
  void ReloadContent(const std::vector<std::uint64_t>& keys);
  // Adds a sentence to the events.
  void AddEvent(const std::string& event, const std::string& sentence);

  // What is displayed with a frame: the name of its map, its mapping status and its content. The scene is
  // null when there is none.
  struct Shown {
    std::string map_name;
    std::shared_ptr<const content::Scene> scene;
    std::shared_ptr<const engine::SurfaceMesh> surfaces;  // behind which the scene is hidden; null for none
    bool occluders = false;                               // whether those of the scene hide it
    std::shared_ptr<const engine::LightEstimate> light;   // of the room; null where it is not known
    bool room_light = false;                              // whether models belong to the light of the room
    std::optional<MappingStatus> mapping;                 // only where the session may write
    std::string advice;                                   // a sentence about the frame's camera; often empty
    std::string hint;  // what to do so that the camera is tracked, as one sentence in English; often empty
    RejectionMessage rejection;  // why a lost camera is not recognized, which `hint` says then
    std::optional<maps::Bounds>
        bounds;                // outside of which the map is not extended; empty where there are none
    std::string starting_map;  // the map that is being initialized; empty once it has points, and for none
  };
  Shown ShownWith(const engine::TrackedFrame& frame) const;
  // The content of a map in memory as it is now, also while no camera is tracked in it; null if the map is
  // not in memory or exists no longer.
  std::shared_ptr<const content::Scene> SceneOf(std::uint64_t map_key) const;
  // A keyframe that resembles an image, for a visitor who is looking for a place.
  struct SimilarView {
    std::string map_name;
    cv::Mat image;  // CV_8UC1, half the size of the keyframe's image
  };
  // At most `count` of those in memory, the most similar first, at most one of each place if there are
  // several. With `entrances` those that stand for their maps instead, in the same order. Takes some
  // milliseconds.
  std::vector<SimilarView> SimilarViews(const engine::Frame& frame, std::size_t count,
                                        bool entrances = false);
  // The session's state of a map.
  struct MapState {
    std::uint64_t key = 0;
    std::string name;
    maps::Policy policy = maps::Policy::kOpen;
    std::shared_ptr<const engine::MapSnapshot> snapshot;  // null: not initialized yet, or not in memory
    std::shared_ptr<const content::Scene> scene;
    bool in_library = false;  // when the session began
    bool discarded = false;
    std::uint64_t joined_into = 0;  // key of the map that it was joined into; 0 for none
  };
  std::vector<MapState> Maps() const;  // by key, including discarded and joined ones
  // The relative pose of the first two cameras in the current map; empty while it is unknown.
  std::optional<engine::RigEstimate> Rig() const { return system_.Rig(); }
  // Mean radial reprojection errors by ring of the image; see engine::CalibrationMonitor.
  engine::CalibrationMonitor::Profile LensErrors(std::size_t camera) const {
    return system_.RadialErrors(camera);
  }
  // The current estimate of a camera with an unknown calibration; empty for a known one.
  std::optional<engine::EstimatedLens> EstimatedLensOf(std::size_t camera) const {
    return system_.EstimatedLensOf(camera);
  }
  engine::MapperTimes MappingTimes() const { return system_.MappingTimes(); }
  std::vector<Event> TakeEvents();

  // Whether something is not on disk yet, and when something was written last.
  using Saving = SavingStatus;
  Saving SavingNow() const { return saving_.Status(); }
  // From now on nothing is saved any more, neither by itself nor by Finish. What was saved stays.
  void DiscardChanges();

  // Stops the mapper, saves all unsaved changes, and waits for the disk. Throws the first failure of either,
  // after everything else was done.
  void Finish();

 private:
  const SessionOptions options_;
  MapKeys keys_;
  engine::System system_;  // its lock may be taken while mutex_ is held, never the other way round
  bool finished_ = false;

  // Guards the members below, as far as they do not say otherwise; never held while tracking or waiting for
  // another thread.
  mutable std::mutex mutex_;
  SessionState state_;
  SessionAssets assets_;
  SystemEventHandler event_handler_;
  MapCommands map_commands_;
  ContentCommands content_commands_;
  // Last, because their threads call back into the other members.
  SessionMemory memory_;  // opened only with a library
  SessionSaving saving_;  // started only with a library opened for writing
};

}  // namespace docent::app
