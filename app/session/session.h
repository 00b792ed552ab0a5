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
#include "engine/tracking/tracker.h"
#include "maps/library.h"
#include "maps/map_pager.h"
#include "maps/place_index.h"
#include "maps/saver.h"

namespace docent::app {

struct SessionOptions {
  engine::TrackerOptions tracker;  // build_maps is set by the session from its rights
  engine::MapperOptions mapper;
  bool threaded = true;   // mapper on its own thread; false: lockstep, equal to the byte between runs
  bool may_write = true;  // false: maps are used as they are, nothing grows and nothing is placed
  std::string first_map;  // begin a map of this name by itself; empty: wait for `map new`
  std::uint64_t seed = 1;
  // Of the images' time; a map that is left, and the end, are saved in any case, and 0 saves at these
  // alone.
  Timestamp autosave_interval = std::chrono::seconds(10);
  // A new map with depth is confirmed after this time, or once it has so many keyframes, unless
  // InitializationMonitor finds fault with it. One that is lost for `probation_loss` before, or found false,
  // is discarded and begun again.
  Timestamp probation = std::chrono::seconds(2);
  Timestamp probation_loss = std::chrono::milliseconds(400);
  std::size_t probation_keyframes = 5;
  // A map of directions alone that is lost for so long begins again with the next image.
  Timestamp first_image_loss = std::chrono::milliseconds(150);
  // A camera that is lost for `lost_patience` where no map explains what it sees begins a new map.
  bool new_map_when_lost = false;
  Timestamp lost_patience = std::chrono::milliseconds(200);
  // Maps in memory that nobody is in are adjusted while there is nothing else to do; needs `threaded`.
  bool maintenance = true;
  double signpost_height = 0.12;  // of the distance at which it is put up
  maps::PagerOptions memory;      // how many of the library's maps are in memory at once
  // Metres between the first two cameras of a rigid rig, measured by hand; 0 when nobody did. A recognised
  // rig then tells how many metres a map's unit has.
  double baseline_m = 0;
};

// What stands behind authoring, touring, evaluating and demonstrating alike: cameras that are tracked in the
// maps of a library, one map at a time that grows, and the content of all of them. The ways of using Docent
// differ in what they pass to it: a library or none, the right to write or not.
//
// Threads: Process(frame) and Execute() belong to the thread of the frame's camera (frame.camera says which);
// everything else may be called from any thread. Process never waits for the mapper or for a disk. Times are
// those of the images; no clock of the machine has any influence on what happens.
//
// What holds: a map grows only while its policy and the session's rights allow it, and only by frames that
// are tracked in it. Whoever recovers into another map takes the session there: that map then grows, and its
// content is what is shown. Several cameras are those of one wearer and work in one map together: see
// CameraAssociation. A start that does not hold (see SessionOptions::probation) is given up and looked
// for again under the same name, with an event that says why. A camera that is lost begins another map where
// SessionOptions::new_map_when_lost says so; once it is back in the first one, the two become one where they
// overlap.
class Session {
 public:
  // library may be null (nothing is kept) and must outlive the session. Its maps are known from the start and
  // read when they are wanted (see maps::MapPager); throws Error when one that is read at the start does not
  // hold. A session that may write needs a library opened for writing.
  Session(const SessionOptions& options, std::vector<std::shared_ptr<const engine::CameraModel>> cameras,
          maps::Library* library);
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  // The whole way of one image.
  engine::TrackedFrame Process(const engine::Frame& frame);
  // All about the frame that Process answered last with `frame`; on the thread of its camera.
  engine::FrameInspection Inspect(const engine::TrackedFrame& frame) const {
    return cameras_.at(static_cast<std::size_t>(frame.frame.camera)).tracker->Inspect(frame);
  }
  // Holds a feeder back that is faster than a camera; see MappingThread::WaitUntilIdle.
  void WaitUntilIdle(std::chrono::steady_clock::time_point latest, const std::stop_token& stop) {
    mapping_.WaitUntilIdle(latest, stop);
  }

  // Carries out a command at a frame that was processed before; a pixel means what that frame shows. Throws
  // Error with one sentence, without its full stop, when it cannot be carried out; then nothing has changed.
  // Relative model files are looked for in model_folder first (a script's own folder), then in the working
  // folder.
  void Execute(const Command& command, const engine::TrackedFrame& frame,
               const std::filesystem::path& model_folder = {});
  // Reads the model of a command ahead of its time, so that its fault shows before anything is built, and no
  // frame waits for it. Throws Error.
  void Preload(const Command& command, const std::filesystem::path& model_folder);

  // What is shown with a frame: the name of its map, how far that has come, and what stands in it. Scene null
  // when there is none.
  struct Shown {
    std::string map_name;
    std::shared_ptr<const content::Scene> scene;
    std::optional<MappingStatus> mapping;  // where the session may write
    std::string advice;                    // a sentence about the frame's camera; often empty
  };
  Shown ShownWith(const engine::TrackedFrame& frame) const;
  std::vector<std::string> MapNames() const;
  // What the session knows of a map.
  struct MapState {
    std::uint64_t key = 0;
    std::string name;
    maps::Policy policy = maps::Policy::kOpen;
    std::shared_ptr<const engine::MapSnapshot> snapshot;  // null: not begun yet, or not in memory
    std::shared_ptr<const content::Scene> scene;
    bool discarded = false;         // given up
    std::uint64_t joined_into = 0;  // the key of the map that it is a part of now; 0 for none
  };
  std::vector<MapState> Maps() const;  // by key, those that are no more too
  // How the first two cameras stand to each other in the present map; empty while that is not known.
  std::optional<RigEstimate> Rig() const;
  // What tracking leaves over, by rings of the image; see CalibrationMonitor.
  CalibrationMonitor::Profile LensErrors(std::size_t camera) const;
  engine::MapperTimes MappingTimes() const { return mapping_.Times(); }
  std::vector<Event> TakeEvents();

  // Ends the mapper, saves what is unsaved or could not be saved before, and waits for the disk. Throws the
  // first failure of either, after everything else was done.
  void Finish();

 private:
  // Where a camera is and where it was told to go. Guarded by mutex_ except for tracker, which is its
  // thread's.
  struct Camera {
    enum class Order { kNone, kStart, kStartAfterLoss, kStartAgain, kLeave, kGo };
    std::unique_ptr<engine::Tracker> tracker;
    std::shared_ptr<const engine::CameraModel> model;
    std::unique_ptr<CalibrationMonitor> lens;
    std::uint64_t map_key = 0;  // of the map it is tracked in; 0 while it looks in all maps
    Order order = Order::kNone;
    bool starting = false;                // it looks for the first views of map_key
    bool began = false;                   // the present map is, or was, started by this camera
    std::optional<Timestamp> lost_since;  // while it is lost in map_key
    Timestamp last_time{};
    std::string advice;  // shown until advice_end
    Timestamp advice_end{};
    RelocalizationMessage doubts;
  };

  // session.cpp
  void LoadMaps();
  void AddLoadedMap(const maps::StoredMap& stored);
  bool Evict(std::uint64_t key);
  void LoadIntoMemory(const Command& command);  // without mutex_
  void PinMapsInUse();
  void ExpectNeighbours(const SessionMap& map);
  // What its camera does next, and where it may look for itself.
  CameraPlaceFinder FollowOrders(std::size_t index, Timestamp time);
  void HandleResult(std::size_t index, engine::TrackedFrame* frame);
  void RejectPose(Camera* camera, engine::TrackedFrame* frame);
  void ReportRejection(Camera* camera, engine::TrackedFrame* frame);
  void WatchRig(std::size_t index, const engine::TrackedFrame& frame);
  void WatchLens(std::size_t index, const engine::TrackedFrame& frame);
  void OfferToMapper(Camera* camera, const engine::TrackedFrame& frame);
  bool MayExtend(const SessionMap& map, const engine::Rigid3& camera_from_map) const;
  void WatchProbation(Camera* camera, const engine::TrackedFrame& frame);
  void WatchLoss(Camera* camera, const engine::TrackedFrame& frame);
  void Discard(std::uint64_t key, Timestamp time, const std::string& reason);
  std::string FreeMapName(const std::string& name) const;
  static void Advise(Camera* camera, const std::string& sentence);
  void OnMapperUpdate(const MappingThread::MapperUpdate& news);
  void EnterMap(Camera* camera, std::uint64_t key, Timestamp time);
  void AddEvent(Timestamp time, std::string event, std::string detail);

  // session_commands.cpp; all with mutex_ held unless they say otherwise
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
  void AskToJoin(const SessionMap& into);
  bool Expects(const MappingThread::MapperUpdate::Join& news, const SessionMap& into);
  void EndJoining(const engine::MapJoinAttempt& attempt, SessionMap* into);
  void AbsorbMap(SessionMap* from, const engine::JoinedMap& joined, SessionMap* into);

  // session_saving.cpp
  static void ReportSaved(const maps::MapRecord& record);
  void StartSaver();
  void SaveMap(SessionMap* map, Timestamp time);
  void Autosave(Timestamp time);
  void ReportSaveFailure(Timestamp time);
  Timestamp LastTime() const;  // of any camera

  // session_maintenance.cpp; RunMaintenance on the saver's thread and without mutex_
  bool RunMaintenance(const std::atomic<bool>& interrupt);
  bool IsIdle(const SessionMap& map) const;
  std::vector<IdleMap> MapsForMaintenance() const;
  SessionMap* FindIdleMap(const IdleMap& resting);

  const SessionOptions options_;
  maps::Library* const library_;
  maps::PlaceIndex index_;

  mutable std::mutex mutex_;  // guards all that follows but the mapping thread; never held while tracking
  std::vector<Camera> cameras_;
  std::map<std::uint64_t, SessionMap> maps_;
  CameraAssociation association_;
  CameraRig rig_;
  bool rig_told_ = false;           // that it is rigid
  std::uint64_t extended_key_ = 0;  // the map that the mapper works on; 0 for none
  // The map that the mapper is to take into the one that it works on; see session_joining.cpp.
  struct Joining {
    std::uint64_t number = 0, from = 0;
    std::shared_ptr<const engine::MapSnapshot> snapshot;
  };
  std::optional<Joining> joining_;
  std::uint64_t joins_asked_ = 0;
  std::uint64_t next_key_ = 1;  // without a library
  std::vector<Event> events_;
  AssetCache assets_;                                                    // by id
  std::map<std::string, std::shared_ptr<const content::Asset>> models_;  // by the file as commands name it
  std::filesystem::path model_folder_;
  std::optional<Timestamp> last_save_;
  bool finished_ = false;
  MaintenanceOrder maintenance_order_;  // the saver's thread alone touches it
  // Last, because their threads call back into the rest.
  std::optional<maps::MapPager> pager_;  // with a library
  MappingThread mapping_;
  std::optional<maps::Saver> saver_;  // with a library opened for writing
};

}  // namespace docent::app
