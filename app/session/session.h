// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "app/output/run_output.h"
#include "app/script/commands.h"
#include "app/session/calibration_monitor.h"
#include "app/session/camera_association.h"
#include "app/session/camera_place_finder.h"
#include "app/session/camera_rig.h"
#include "app/session/initialization_monitor.h"
#include "app/session/library_scene.h"
#include "app/session/maintenance_order.h"
#include "app/session/mapping_status.h"
#include "app/session/mapping_thread.h"
#include "app/session/relocalization_message.h"
#include "app/session/session_map.h"
#include "engine/recognition/place_index.h"
#include "engine/tracking/tracker.h"
#include "maps/library.h"
#include "maps/map_pager.h"
#include "maps/saver.h"

namespace docent::app {

struct SessionOptions {
  engine::TrackerOptions tracker;  // build_maps is set by the session from may_write
  engine::MapperOptions mapper;
  bool threaded = true;   // mapper on its own thread; false: lockstep, runs are byte-identical
  bool may_write = true;  // false: no map is extended and no content is edited
  std::string first_map;  // a map of this name is started without a command; empty: wait for `map new`
  std::uint64_t seed = 1;
  // In image time. A map is also saved when it is left and at the end; 0 saves only then.
  Timestamp autosave_interval = std::chrono::seconds(10);
  // A new map with finite points is provisional until this time has passed or it has this many keyframes. It
  // is discarded and initialized again when tracking is lost for `provisional_loss_time` before that, or when
  // InitializationMonitor finds its depth false.
  Timestamp provisional_time = std::chrono::seconds(2);
  Timestamp provisional_loss_time = std::chrono::milliseconds(400);
  std::size_t provisional_keyframes = 5;
  // A map without finite points is discarded and started again with the next image when tracking is lost for
  // this time.
  Timestamp panorama_loss_time = std::chrono::milliseconds(150);
  // Whether a camera that is lost for `lost_time_before_new_map`, and recognises no map, starts a new map.
  bool new_map_when_lost = false;
  Timestamp lost_time_before_new_map = std::chrono::milliseconds(200);
  // Idle maps in memory are adjusted while there is nothing else to do; needs `threaded`.
  bool maintenance = true;
  double signpost_height = 0.12;  // ratio of its distance at placement
  maps::PagerOptions memory;      // how much of the library is in memory at once
  // Measured distance in metres between the first two cameras of a rigid rig; 0 when not measured. Once the
  // rig is recognised, it gives the length of a map unit in metres.
  double baseline_m = 0;
};

// The common core of authoring, touring, evaluation and the demo: cameras that are tracked in the maps of a
// library, one active map that is extended, and the content of all maps. The uses differ only in their
// options: with or without a library, with or without the right to write.
//
// Threads: Process(frame) and Execute() are called on the thread of the frame's camera (frame.camera);
// everything else may be called from any thread. Process waits neither for the mapper nor for a disk. Times
// are those of the images; no system clock influences the results.
//
// Invariants: a map is extended only while its policy and the session's rights allow it, and only by frames
// that are tracked in it. A camera that relocalizes in another map takes the session there: that map becomes
// the active one, and its content is shown. Several cameras belong to one wearer and work in one map
// together: see CameraAssociation. A false initialization (see SessionOptions::provisional_time) is discarded
// and repeated under the same name, with an event that says why. With SessionOptions::new_map_when_lost, a
// lost camera starts another map; once it is back in the first one, the two maps are joined where they
// overlap.
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
  // Details of the frame that Process returned last as `frame`; on the thread of its camera.
  engine::FrameInspection Inspect(const engine::TrackedFrame& frame) const {
    return cameras_.at(static_cast<std::size_t>(frame.frame.camera)).tracker->Inspect(frame);
  }
  // Delays a source that delivers faster than a camera; see MappingThread::WaitUntilIdle.
  void WaitUntilIdle(std::chrono::steady_clock::time_point latest, const std::stop_token& stop) {
    mapping_.WaitUntilIdle(latest, stop);
  }

  // Executes a command at a frame that was processed before; its pixel refers to that frame. Throws Error
  // with one sentence, without full stop, when it cannot be executed; then nothing has changed. Relative
  // model files are searched in model_folder first (a script's own folder), then in the working folder.
  void Execute(const Command& command, const engine::TrackedFrame& frame,
               const std::filesystem::path& model_folder = {});
  // Reads the model of a command in advance, so that an error shows before anything is built, and no frame
  // waits for it. Throws Error.
  void Preload(const Command& command, const std::filesystem::path& model_folder);

  // What is displayed with a frame: the name of its map, its mapping status and its content. The scene is
  // null when there is none.
  struct Shown {
    std::string map_name;
    std::shared_ptr<const content::Scene> scene;
    std::optional<MappingStatus> mapping;  // only where the session may write
    std::string advice;                    // a sentence about the frame's camera; often empty
  };
  Shown ShownWith(const engine::TrackedFrame& frame) const;
  std::vector<std::string> MapNames() const;
  // The session's state of a map.
  struct MapState {
    std::uint64_t key = 0;
    std::string name;
    maps::Policy policy = maps::Policy::kOpen;
    std::shared_ptr<const engine::MapSnapshot> snapshot;  // null: not initialized yet, or not in memory
    std::shared_ptr<const content::Scene> scene;
    bool discarded = false;
    std::uint64_t joined_into = 0;  // key of the map that it was joined into; 0 for none
  };
  std::vector<MapState> Maps() const;  // by key, including discarded and joined ones
  // The relative pose of the first two cameras in the current map; empty while it is unknown.
  std::optional<RigEstimate> Rig() const;
  // Mean radial reprojection errors by ring of the image; see CalibrationMonitor.
  CalibrationMonitor::Profile LensErrors(std::size_t camera) const;
  engine::MapperTimes MappingTimes() const { return mapping_.Times(); }
  std::vector<Event> TakeEvents();

  // Stops the mapper, saves all unsaved changes, and waits for the disk. Throws the first failure of either,
  // after everything else was done.
  void Finish();

 private:
  // State of a camera and its pending order. Guarded by mutex_ except for tracker, which belongs to the
  // camera's thread.
  struct Camera {
    enum class Order { kNone, kStart, kStartAfterLoss, kStartAgain, kLeave, kEnter };
    std::unique_ptr<engine::Tracker> tracker;
    std::shared_ptr<const engine::CameraModel> model;
    std::unique_ptr<CalibrationMonitor> calibration_monitor;
    std::uint64_t map_key = 0;  // the map it is tracked in; 0 while it searches all maps
    Order order = Order::kNone;
    bool initializing = false;            // it searches for the initial views of map_key
    bool started_map = false;             // this camera started the current map
    std::optional<Timestamp> lost_since;  // while it is lost in map_key
    Timestamp last_time{};
    std::string advice;  // shown until advice_end
    Timestamp advice_end{};
    RelocalizationMessage relocalization_message;
  };

  // session.cpp, session_memory.cpp and session_growth.cpp
  void LoadMaps();
  void AddLoadedMap(const maps::StoredMap& stored);
  bool Evict(std::uint64_t key);
  void LoadIntoMemory(const Command& command);  // without mutex_
  void PinMapsInUse();
  void ExpectNeighbours(const SessionMap& map);
  // Applies the pending order to the camera's tracker, and returns the places that it may search.
  CameraPlaceFinder ApplyOrder(std::size_t index, Timestamp time);
  void HandleResult(std::size_t index, engine::TrackedFrame* frame);
  void RejectPose(Camera* camera, engine::TrackedFrame* frame);
  void ReportRejection(Camera* camera, engine::TrackedFrame* frame);
  void UpdateRig(std::size_t index, const engine::TrackedFrame& frame);
  void CheckCalibration(std::size_t index, const engine::TrackedFrame& frame);
  void OfferToMapper(Camera* camera, const engine::TrackedFrame& frame);
  bool MayExtend(const SessionMap& map, const engine::Rigid3& camera_from_map) const;
  void CheckProvisionalMap(Camera* camera, const engine::TrackedFrame& frame);
  void CheckLoss(Camera* camera, const engine::TrackedFrame& frame);
  void Discard(std::uint64_t key, Timestamp time, const std::string& reason);
  std::string FreeMapName(const std::string& name) const;
  static void Advise(Camera* camera, const std::string& sentence);
  void OnMapperUpdate(const MappingThread::MapperUpdate& update);
  void EnterMap(Camera* camera, std::uint64_t key, Timestamp time);
  void AddEvent(Timestamp time, std::string event, std::string detail);

  // session_commands.cpp; all with mutex_ held unless noted
  void Apply(const NewMap& command, const engine::TrackedFrame& frame);
  void Apply(const StopMap& command, const engine::TrackedFrame& frame);
  void Apply(const UseMap& command, const engine::TrackedFrame& frame);
  void Apply(const SetPolicy& command, const engine::TrackedFrame& frame);
  void Apply(const PlaceModel& command, const engine::TrackedFrame& frame);
  void Apply(const PlaceSignpost& command, const engine::TrackedFrame& frame);
  void Apply(const MoveEntity& command, const engine::TrackedFrame& frame);
  void Apply(const RotateEntity& command, const engine::TrackedFrame& frame);
  void Apply(const ScaleEntity& command, const engine::TrackedFrame& frame);
  void Apply(const RemoveEntity& command, const engine::TrackedFrame& frame);
  void Apply(const Undo& command, const engine::TrackedFrame& frame);
  void Apply(const Redo& command, const engine::TrackedFrame& frame);
  void Apply(const Save& command, const engine::TrackedFrame& frame);
  SessionMap& AddMap(const std::string& name);
  SessionMap* FindByName(const std::string& name);
  SessionMap& MapToEdit(const engine::TrackedFrame& frame);
  void Edit(SessionMap* map, std::unique_ptr<content::Edit> edit);
  std::shared_ptr<const content::Asset> LoadAsset(const std::string& file);
  void LeaveMap(std::uint64_t key);
  void ExtendMap(const SessionMap& map);
  void AssignMapper(std::uint64_t key, std::shared_ptr<const engine::MapSnapshot> snapshot);

  // session_joining.cpp; all with mutex_ held
  void RequestJoin(const SessionMap& into);
  bool IsAwaited(const MappingThread::MapperUpdate::Join& update, const SessionMap& into);
  void HandleJoinAttempt(const engine::MapJoinAttempt& attempt, SessionMap* into);
  void AbsorbMap(SessionMap* from, const engine::JoinedMap& joined, SessionMap* into);

  // session_saving.cpp
  static void ReportSaved(const maps::MapRecord& record);
  void StartSaver();
  void SaveMap(SessionMap* map, Timestamp time);
  void Autosave(Timestamp time);
  void ReportSaveFailure(Timestamp time);
  Timestamp LastTime() const;  // the latest of any camera

  // session_maintenance.cpp; RunMaintenance on the saver's thread and without mutex_
  bool RunMaintenance(const std::atomic<bool>& interrupt);
  bool IsIdle(const SessionMap& map) const;
  std::vector<IdleMap> MapsForMaintenance() const;
  SessionMap* FindIdleMap(const IdleMap& idle);

  const SessionOptions options_;
  maps::Library* const library_;
  engine::PlaceIndex index_;

  mutable std::mutex mutex_;  // guards the members below except the mapping thread; never held while tracking
  std::vector<Camera> cameras_;
  std::map<std::uint64_t, SessionMap> maps_;
  CameraAssociation association_;
  CameraRig rig_;
  bool rig_reported_ = false;     // whether the rig was last reported as rigid
  std::uint64_t active_key_ = 0;  // the map that the mapper works on; 0 for none
  // The map that the mapper was asked to join into the active map; see session_joining.cpp.
  struct Joining {
    std::uint64_t number = 0, from = 0;
    std::shared_ptr<const engine::MapSnapshot> snapshot;
  };
  std::optional<Joining> joining_;
  std::uint64_t joins_requested_ = 0;
  std::uint64_t next_key_ = 1;  // only without a library
  std::vector<Event> events_;
  AssetCache assets_;                                                    // by id
  std::map<std::string, std::shared_ptr<const content::Asset>> models_;  // by file name in commands
  std::filesystem::path model_folder_;
  std::optional<Timestamp> last_save_;
  bool finished_ = false;
  MaintenanceOrder maintenance_order_;  // accessed only by the saver's thread
  // Last, because their threads call back into the other members.
  std::optional<maps::MapPager> pager_;  // only with a library
  MappingThread mapping_;
  std::optional<maps::Saver> saver_;  // only with a library opened for writing
};

}  // namespace docent::app
