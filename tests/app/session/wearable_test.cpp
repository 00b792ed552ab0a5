// SPDX-License-Identifier: Apache-2.0
// Two cameras in one session, on the simulated wearable.
#include <gmock/gmock.h>

#include <algorithm>
#include <mutex>
#include <set>

#include "app/cameras/simulated_source.h"
#include "app/output/engine_text.h"
#include "app/session/frame_loop.h"
#include "app/session/session.h"
#include "app/simulator/scene.h"
#include "app/simulator/simulation.h"
#include "tests/app/support/temporary_folder.h"

namespace docent::app {
namespace {

using ::testing::HasSubstr;

// The scene's camera model at half the resolution, to save time.
engine::CameraModel Halved(const engine::CameraModel& camera) {
  engine::CameraModel::Intrinsics intrinsics = camera.intrinsics();
  intrinsics.width_px /= 2;
  intrinsics.height_px /= 2;
  intrinsics.fx /= 2;
  intrinsics.fy /= 2;
  intrinsics.cx = (intrinsics.cx + 0.5) / 2 - 0.5;
  intrinsics.cy = (intrinsics.cy + 0.5) / 2 - 0.5;
  return {camera.lens(), intrinsics, camera.distortion()};
}

std::shared_ptr<const Simulation> View(const std::string& scene, double seconds) {
  SimulationOptions options;
  options.camera = Halved(MakeSimulation(scene, options)->camera());
  options.frame_rate_hz = 20;
  options.duration_s = seconds;
  return MakeSimulation(scene, options);
}

struct WalkOfTwoCameras {
  std::vector<engine::TrackedFrame> frames[2];
  std::vector<Session::MapState> maps;
  std::vector<Event> events;
  std::optional<engine::RigEstimate> rig;
};

// Feeds both views of a walk to one session that builds a map.
WalkOfTwoCameras Take(const std::string& hand, const std::string& shoulder, double seconds, Pace pace,
                      double baseline_m = 0) {
  CalibratedCamera cameras[2] = {Calibrate(OpenSimulation(View(hand, seconds)), std::nullopt),
                                 Calibrate(OpenSimulation(View(shoulder, seconds)), std::nullopt)};
  SessionOptions options;
  options.threaded = pace != Pace::kLockstep;
  options.first_map = "table";
  options.baseline_m = baseline_m;
  Session session(options, {cameras[0].model, cameras[1].model}, nullptr);
  WalkOfTwoCameras walk;
  std::vector<CameraRun> runs(2);
  for (int i = 0; i < 2; ++i) {
    runs[i].camera = &cameras[i];
    runs[i].options.camera = i;
    runs[i].options.pace = pace;
    runs[i].shown = [&walk, i](const engine::TrackedFrame& frame) {
      walk.frames[i].push_back(frame);
      walk.frames[i].back().frame.image.release();
    };
  }
  RunCameras(runs, &session, {});
  walk.rig = session.Rig();
  session.Finish();
  walk.maps = session.Maps();
  walk.events = session.TakeEvents();
  return walk;
}

// Ratio of frames with a pose, from the first pose on.
double TrackedAfterJoining(const std::vector<engine::TrackedFrame>& frames) {
  const auto tracked = [](const engine::TrackedFrame& frame) { return engine::HasPose(frame.state); };
  const auto first = std::find_if(frames.begin(), frames.end(), tracked);
  if (first == frames.end()) return 0;
  return static_cast<double>(std::count_if(first, frames.end(), tracked)) /
         static_cast<double>(frames.end() - first);
}

TEST(Wearable, BuildsOneMapWithBothCamerasAndEachTracksWhatTheOtherMapped) {
  const WalkOfTwoCameras walk = Take("hand", "shoulder", 24, Pace::kLockstep);
  RecordProperty("tracked_0", std::to_string(TrackedAfterJoining(walk.frames[0])));
  RecordProperty("tracked_1", std::to_string(TrackedAfterJoining(walk.frames[1])));
  EXPECT_GE(TrackedAfterJoining(walk.frames[0]), 0.98);
  EXPECT_GE(TrackedAfterJoining(walk.frames[1]), 0.98);
  ASSERT_FALSE(walk.maps.empty());
  const Session::MapState& map = walk.maps.back();
  ASSERT_TRUE(map.snapshot && !map.discarded);
  // The camera model of a keyframe tells which camera took it. Redundant keyframes are removed again later.
  std::map<engine::KeyFrameId, int> taken_by;
  int keyframes[2] = {0, 0};
  const auto taker = [](const engine::KeyFrame& keyframe) {
    return keyframe.camera->lens() == engine::LensModel::kFov ? 1 : 0;
  };
  for (const engine::KeyFrame& keyframe : map.snapshot->keyframes) ++keyframes[taker(keyframe)];
  std::shared_ptr<const engine::MapSnapshot> seen;
  for (const engine::TrackedFrame& frame : walk.frames[0]) {
    if (!frame.map || frame.map == seen) continue;
    seen = frame.map;
    for (const engine::KeyFrame& keyframe : seen->keyframes) taken_by[keyframe.id] = taker(keyframe);
  }
  EXPECT_GE(keyframes[0], 5);
  EXPECT_GE(keyframes[1], 5);
  // Each camera reaches places where it finds enough points of the other one's keyframes to be tracked by
  // those alone (ptamm Fig. 5).
  for (int camera = 0; camera < 2; ++camera) {
    int most = 0;
    for (const engine::TrackedFrame& frame : walk.frames[camera]) {
      int others = 0;
      for (const engine::PointMatch& match : frame.matches) {
        const engine::MapPoint* point =
            match.inlier && frame.map ? frame.map->FindPoint(match.point) : nullptr;
        if (point == nullptr || !taken_by.contains(point->source_keyframe)) continue;
        others += taken_by[point->source_keyframe] != camera;
      }
      most = std::max(most, others);
    }
    RecordProperty("points_of_the_other_" + std::to_string(camera), most);
    EXPECT_GE(most, 2 * engine::TrackerOptions().min_relocalization_inliers) << "camera " << camera;
  }
  EXPECT_FALSE(walk.rig && walk.rig->rigid)
      << "these cameras move relative to each other: " << TextOf(*walk.rig);
}

TEST(Wearable, RecognizesThatItsCamerasAreRigidlyConnectedAndGivesTheMapItsScale) {
  const engine::Rigid3 truth = WearableRig().inverse();  // shoulder_from_hand
  const WalkOfTwoCameras walk = Take("hand:1", "shoulder:1", 16, Pace::kLockstep, truth.translation.norm());
  ASSERT_TRUE(walk.rig);
  EXPECT_TRUE(walk.rig->rigid) << TextOf(*walk.rig);
  const double turn_deg =
      (walk.rig->second_from_first.rotation.inverse() * truth.rotation).Angle() * 57.29578;
  RecordProperty("turn_off_deg", std::to_string(turn_deg));
  EXPECT_LT(turn_deg, 0.3);
  // The map has an arbitrary scale; the true length of a map unit follows from the path of the hand-held
  // camera.
  const auto hand = View("hand:1", 16);
  double in_map = 0, in_world = 0;
  const engine::TrackedFrame* before = nullptr;
  for (const engine::TrackedFrame& frame : walk.frames[0]) {
    if (!engine::HasPose(frame.state)) continue;
    if (before != nullptr && frame.frame.index < before->frame.index + 20) continue;
    if (before != nullptr) {
      const auto at = [&](const engine::TrackedFrame& f) {
        return hand->world_from_camera(static_cast<int>(f.frame.index)).translation;
      };
      in_map += (frame.camera_from_map.OriginInSource() - before->camera_from_map.OriginInSource()).norm();
      in_world += (at(frame) - at(*before)).norm();
    }
    before = &frame;
  }
  ASSERT_GT(in_world, 0.5);
  const double baseline_m = walk.rig->Baseline() * in_world / in_map;
  RecordProperty("baseline_off_percent", std::to_string(100 * (baseline_m / truth.translation.norm() - 1)));
  EXPECT_NEAR(baseline_m, truth.translation.norm(), 0.01 * truth.translation.norm());
  EXPECT_TRUE(std::any_of(walk.events.begin(), walk.events.end(),
                          [](const Event& event) { return event.event == "rig"; }));
  ASSERT_FALSE(walk.maps.empty());
  const double metres_per_unit = in_world / in_map;
  EXPECT_NEAR(walk.maps.back().scene->settings.metres_per_unit, metres_per_unit, 0.02 * metres_per_unit);
}

// Maps the beginning of a scene and saves it in a library.
void MapScene(const std::string& name, const Simulation& simulation, maps::Library* library) {
  SessionOptions options;
  options.threaded = false;
  options.first_map = name;
  Session session(options, {std::make_shared<engine::CameraModel>(simulation.camera())}, library);
  for (int i = 0; i < simulation.frame_count(); ++i) {
    engine::Frame frame;
    frame.time = simulation.time(i);
    frame.index = static_cast<std::uint64_t>(i);
    simulation.Render(i, &frame.image);
    session.Process(frame);
  }
  session.Finish();
}

// A library with a map of a room and one of a desk.
struct MappedRoomAndDesk {
  MappedRoomAndDesk() {
    MapScene("room", *room, &library);
    MapScene("desk", *desk, &library);
  }
  static std::shared_ptr<const Simulation> Simulate(const std::string& scene) {
    SimulationOptions options;
    options.camera = SimulatedCamera(320);
    options.frame_rate_hz = 20;
    options.duration_s = 5;
    return MakeSimulation(scene, options);
  }
  // What a camera sees near the end of the walk.
  static cv::Mat ViewOf(const Simulation& simulation) {
    cv::Mat bgr;
    simulation.Render(simulation.frame_count() - 10, &bgr);
    return bgr;
  }

  const TemporaryFolder folder;
  maps::Library library =
      maps::Library::Open(folder / "l.docent", maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
  const std::shared_ptr<const Simulation> room = Simulate("room"), desk = Simulate("desks");
};

// Two cameras on a tour, which are shown images of the test's choice.
class Tourists {
 public:
  Tourists(std::shared_ptr<const engine::CameraModel> lens, maps::Library* library)
      : session_(Options(), {lens, lens}, library) {}

  // Shows each camera its image repeatedly; returns the map in which each is tracked after that.
  using MapNamesOfBoth = std::pair<std::string, std::string>;
  MapNamesOfBoth Look(const cv::Mat& first, const cv::Mat& second, int times = 25) {
    std::string names[2];
    for (int i = 0; i < times; ++i) {
      time_ += std::chrono::milliseconds(33);
      for (int camera = 0; camera < 2; ++camera) {
        engine::Frame frame;
        frame.time = time_;
        frame.index = index_;
        frame.camera = camera;
        frame.image = camera == 0 ? first : second;
        const engine::TrackedFrame tracked = session_.Process(frame);
        names[camera] = session_.ShownWith(tracked).map_name;
        if (!engine::HasPose(tracked.state)) names[camera] = "lost";
        seen_.insert({camera, names[camera]});
      }
      ++index_;
    }
    return {names[0], names[1]};
  }
  // Whether a camera was tracked in this map, or was "lost", at any time since the last Forget.
  bool Seen(int camera, const std::string& map) const { return seen_.contains({camera, map}); }
  void Forget() { seen_.clear(); }

 private:
  static SessionOptions Options() {
    SessionOptions options;
    options.threaded = false;
    options.may_write = false;
    options.memory.wait_for_maps = true;
    return options;
  }
  Session session_;
  Timestamp time_ = std::chrono::seconds(1);
  std::uint64_t index_ = 0;
  std::set<std::pair<int, std::string>> seen_;
};

// ptamm Fig. 7 and §3.3, step by step, with images.
TEST(Wearable, FollowsTheRulesOfAssociatedCameras) {
  MappedRoomAndDesk mapped;
  const cv::Mat of_room = MappedRoomAndDesk::ViewOf(*mapped.room),
                of_desk = MappedRoomAndDesk::ViewOf(*mapped.desk);
  const cv::Mat dark = cv::Mat::zeros(of_room.size(), of_room.type());
  Tourists cameras(std::make_shared<engine::CameraModel>(mapped.room->camera()), &mapped.library);
  using Both = Tourists::MapNamesOfBoth;

  // No camera is tracked yet: any map may be entered, and both are tracked in one map.
  EXPECT_EQ(cameras.Look(of_room, of_room), Both("room", "room"));
  // (b) One camera becomes lost and sees another map: that map is not searched, and the camera stays lost.
  cameras.Look(of_room, dark);
  cameras.Forget();
  EXPECT_EQ(cameras.Look(of_room, of_desk, 60), Both("room", "lost"));
  EXPECT_FALSE(cameras.Seen(1, "desk"));
  EXPECT_FALSE(cameras.Seen(0, "lost"));
  // It relocalizes in the current map only.
  EXPECT_EQ(cameras.Look(of_room, of_room), Both("room", "room"));
  // (c) Both are lost: each searches all maps. (d) The first one to relocalize, in another map, brings the
  // other one with it, which abandons its search: it does not relocalize in the previous map even if it sees
  // it.
  EXPECT_EQ(cameras.Look(dark, dark), Both("lost", "lost"));
  EXPECT_EQ(cameras.Look(dark, of_desk), Both("lost", "desk"));
  cameras.Forget();
  EXPECT_EQ(cameras.Look(of_room, of_desk, 60), Both("lost", "desk"));
  EXPECT_FALSE(cameras.Seen(0, "room"));
  EXPECT_FALSE(cameras.Seen(1, "lost"));
  // (e) It relocalizes in that map, and both continue together.
  EXPECT_EQ(cameras.Look(of_desk, of_desk), Both("desk", "desk"));
  // The rules do not depend on the order of the cameras: the same with the roles exchanged.
  EXPECT_EQ(cameras.Look(dark, dark), Both("lost", "lost"));
  EXPECT_EQ(cameras.Look(of_room, dark), Both("room", "lost"));
  EXPECT_EQ(cameras.Look(of_room, of_desk), Both("room", "lost"));
  EXPECT_EQ(cameras.Look(of_room, of_room), Both("room", "room"));
}

// Images of the test's choice, ten a second.
class GivenImages : public FrameSource {
 public:
  GivenImages(const engine::CameraModel& lens, std::vector<cv::Mat> images) : images_(std::move(images)) {
    info_.name = "given";
    info_.known_camera = lens;
  }
  bool Next(engine::Frame* frame) override {
    if (next_ == images_.size()) return false;
    frame->time = std::chrono::milliseconds(100 * next_);
    frame->index = next_;
    frame->image = images_[next_++].clone();
    return true;
  }

 private:
  const std::vector<cv::Mat> images_;
  std::size_t next_ = 0;
};

TEST(Wearable, ACameraWhoseRecordingEndsHoldsTheOtherInNoMap) {
  MappedRoomAndDesk mapped;
  const engine::CameraModel& lens = mapped.room->camera();
  std::vector<cv::Mat> first(25, MappedRoomAndDesk::ViewOf(*mapped.room)), second = first;
  first.insert(first.end(), 60, MappedRoomAndDesk::ViewOf(*mapped.desk));
  for (const Pace pace : {Pace::kLockstep, Pace::kEager}) {
    CalibratedCamera cameras[2] = {Calibrate(std::make_unique<GivenImages>(lens, first), std::nullopt),
                                   Calibrate(std::make_unique<GivenImages>(lens, second), std::nullopt)};
    SessionOptions options;
    options.threaded = pace != Pace::kLockstep;
    options.may_write = false;
    Session session(options, {cameras[0].model, cameras[1].model}, &mapped.library);
    std::vector<CameraRun> runs(2);
    std::string last[2];
    for (int i = 0; i < 2; ++i) {
      runs[i].camera = &cameras[i];
      runs[i].options.camera = i;
      runs[i].options.pace = pace;
      runs[i].shown = [&, i](const engine::TrackedFrame& frame) {
        last[i] = engine::HasPose(frame.state) ? session.ShownWith(frame).map_name : "lost";
      };
    }
    RunCameras(runs, &session, {});
    EXPECT_EQ(last[1], "room") << ToString(pace);
    EXPECT_EQ(last[0], "desk") << ToString(pace);
  }
}

TEST(Wearable, TracksBothCamerasOnThreadsOfTheirOwn) {
  const WalkOfTwoCameras walk = Take("hand", "shoulder", 8, Pace::kEager);
  EXPECT_EQ(walk.frames[0].size(), 161u);
  EXPECT_GE(walk.frames[1].size(), 150u);  // the run ends with the first camera
  EXPECT_GE(TrackedAfterJoining(walk.frames[0]), 0.9);
  EXPECT_GE(TrackedAfterJoining(walk.frames[1]), 0.9);
}

}  // namespace
}  // namespace docent::app
