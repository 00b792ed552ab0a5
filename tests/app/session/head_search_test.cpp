// SPDX-License-Identifier: Apache-2.0
// A pan-tilt camera on a shoulder in the simulated room: rendered images and the real tracker.
#include "app/session/head_search.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "app/cameras/simulated_head.h"
#include "app/session/head_control.h"
#include "app/session/session.h"
#include "app/simulator/simulation.h"
#include "engine/base/random.h"
#include "engine/recognition/place_index.h"
#include "engine/tracking/tracker.h"
#include "tests/app/support/rad_per_degree.h"

namespace docent::app {
namespace {

using engine::Rigid3;
using engine::Rotation3;

constexpr double kFramesPerSecond = 10;

// The room with a map of its table, made by a walk, and a camera that can be pointed anywhere.
class RoomWithTable {
 public:
  RoomWithTable() {
    SimulationOptions options;
    options.camera = engine::CameraModel(engine::LensModel::kFov, {320, 240, 182.15, 182.15, 160.35, 118.9},
                                         {0.95, 0, 0, 0, 0});
    options.frame_rate_hz = 20;
    options.duration_s = 5;
    world_ = MakeSimulation("shoulder", options);
    camera_ = std::make_shared<engine::CameraModel>(world_->camera());
    SessionOptions session_options;
    session_options.threaded = false;
    session_options.first_map = "table";
    Session session(session_options, {camera_}, nullptr);
    for (int i = 0; i < world_->frame_count(); ++i) session.Process(Image(world_->world_from_camera(i), i));
    session.Finish();
    map_ = session.Maps().back().snapshot;
    index_.SetMap(kKey, map_);
  }

  const std::shared_ptr<const engine::MapSnapshot>& map() const { return map_; }
  const std::shared_ptr<const engine::CameraModel>& camera() const { return camera_; }
  // The carrier at the start of the walk, looking straight ahead: level, with the heading of the camera.
  Rigid3 world_from_carrier() const {
    const Rigid3 pose = world_->world_from_camera(0);
    const Eigen::Vector3d ahead = pose.rotation * Eigen::Vector3d::UnitZ();
    return {CarrierFromCamera({std::atan2(ahead.x(), ahead.z()), 0}), pose.translation};
  }
  engine::Frame Image(const Rigid3& world_from_camera, int number) const {
    engine::Frame frame;
    frame.index = static_cast<std::uint64_t>(number);
    frame.time = FromSeconds(number / kFramesPerSecond);
    world_->RenderFrom(world_from_camera, number, &frame.image);
    return frame;
  }
  engine::Tracker NewTracker(std::uint64_t seed) const {
    engine::TrackerOptions options;
    options.build_maps = false;
    engine::Tracker tracker(options, camera_, seed);
    tracker.SetMap(map_, kKey);
    return tracker;
  }
  // As estimated by the tracker from images of the table.
  std::optional<Rigid3> CarrierFromMap() const {
    engine::Tracker tracker = NewTracker(1);
    const Rigid3 camera_from_carrier = world_->world_from_camera(0).inverse() * world_from_carrier();
    for (int i = 0; i < 5; ++i) {
      const engine::TrackedFrame frame = tracker.Track(Image(world_->world_from_camera(0), i), &index_);
      if (engine::HasPose(frame.state)) return camera_from_carrier.inverse() * frame.camera_from_map;
    }
    return std::nullopt;
  }
  const engine::PlaceIndex& index() const { return index_; }

  static constexpr std::uint64_t kKey = 1;

 private:
  std::shared_ptr<const Simulation> world_;
  std::shared_ptr<const engine::CameraModel> camera_;
  std::shared_ptr<const engine::MapSnapshot> map_;
  engine::PlaceIndex index_;
};

const RoomWithTable& TheRoom() {
  static const RoomWithTable room;
  return room;
}

// Sweeps to the nearer end, to the other end, then along the next row, and so on: level, downwards, upwards.
class BlindSweep {
 public:
  BlindSweep(const PanTiltRange& range, const PanTilt& start)
      : range_(range), right_(start.pan_rad > 0), tilt_(start.tilt_rad) {}
  PanTilt Next(const PanTilt& at) {
    const double end = right_ ? range_.highest.pan_rad : range_.lowest.pan_rad;
    if (std::abs(at.pan_rad - end) < 1e-6 && std::abs(at.tilt_rad - tilt_) < 1e-6) {
      right_ = !right_;
      constexpr double kRows[] = {0, -30 * kRadPerDegree, 28 * kRadPerDegree};
      // The first row is swept both ways, because the sweep begins inside it.
      if (++ends_ > 1) tilt_ = kRows[static_cast<std::size_t>(ends_ - 2) % 3];
      return {at.pan_rad, tilt_};
    }
    return {std::abs(at.tilt_rad - tilt_) < 1e-6 ? end : at.pan_rad, tilt_};
  }

 private:
  const PanTiltRange range_;
  bool right_;
  double tilt_;
  int ends_ = 0;
};

// The carrier's pose after the loss, and the direction of the head.
struct Loss {
  Rigid3 world_from_carrier;
  PanTilt at;
};

// Seconds until the tracker relocalizes; 60 when it never does.
template <typename Next, typename AddEmptyView>
double Find(const RoomWithTable& room, const Loss& loss, std::uint64_t seed, const Next& next,
            const AddEmptyView& not_recognized) {
  engine::Tracker tracker = room.NewTracker(seed);
  HeadMotion motion(SimulatedHead::Range());
  motion.LookAt(loss.at, {});
  constexpr Timestamp kStart = std::chrono::seconds(10);  // the head has arrived by then
  constexpr int kMost = 600;
  for (int i = 0; i < kMost; ++i) {
    const Timestamp now = kStart + FromSeconds(i / kFramesPerSecond);
    const PanTilt at = motion.At(now);
    const Rigid3 turn(CarrierFromCamera(at), Eigen::Vector3d::Zero());
    engine::Frame frame = room.Image(loss.world_from_carrier * turn, i);
    frame.time = now;
    if (engine::HasPose(tracker.Track(frame, &room.index()).state)) return i / kFramesPerSecond;
    not_recognized(at);
    motion.LookAt(next(at), now);
  }
  return kMost / kFramesPerSecond;
}

double Median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2),
                   values.end());
  return values[values.size() / 2];
}

TEST(HeadSearch, LooksFirstWhereTheMapWasExpectedAndThenElsewhere) {
  const RoomWithTable& room = TheRoom();
  const auto carrier_from_map = room.CarrierFromMap();
  ASSERT_TRUE(carrier_from_map);
  HeadSearch search(SimulatedHead::Range(), *room.camera(), *room.map(), *carrier_from_map);
  const PanTilt best = search.Best();
  EXPECT_LT(std::abs(best.pan_rad), 30 * kRadPerDegree);  // the walk looked straight ahead,
  EXPECT_LT(best.tilt_rad, 0);                            // down at the table
  EXPECT_GT(search.RecognitionProbability(best), 0.2);
  EXPECT_LT(search.RecognitionProbability({150 * kRadPerDegree, 0}), 0.05);
  const PanTilt first = search.Next({100 * kRadPerDegree, 0});
  EXPECT_LT(std::abs(first.pan_rad - best.pan_rad), 50 * kRadPerDegree);
  // Directions without recognition are left.
  PanTilt at = first;
  double farthest = 0;
  for (int i = 0; i < 60; ++i) {
    search.AddEmptyView(at);
    at = search.Next(at);
    farthest = std::max(farthest, std::abs(at.pan_rad - first.pan_rad));
  }
  EXPECT_GT(farthest, 60 * kRadPerDegree);
}

TEST(HeadSearch, FindsTheMapInHalfTheTimeOfABlindSweep) {
  const RoomWithTable& room = TheRoom();
  const auto carrier_from_map = room.CarrierFromMap();
  ASSERT_TRUE(carrier_from_map);
  const char* const asked = std::getenv("DOCENT_HEAD_LOSSES");
  const int losses = asked != nullptr ? std::atoi(asked) : 12;
  Random random(77);
  std::vector<double> searched, swept, ratios;
  for (int i = 0; i < losses; ++i) {
    // The user rotated by about half a radian, sometimes by any angle, and took half a step.
    const double much = random.Uniform(-1, 1) + random.Uniform(-1, 1) + random.Uniform(-1, 1);
    const double turned = random.Uniform() < 0.1 ? random.Uniform(-2.4, 2.4) : 0.5 * much;
    const Rigid3 body(Rotation3::Exp({0, turned, 0}),
                      {random.Uniform(-0.25, 0.25), 0, random.Uniform(-0.25, 0.25)});
    const Loss loss{room.world_from_carrier() * body,
                    {random.Uniform(-150, 150) * kRadPerDegree, random.Uniform(-40, 30) * kRadPerDegree}};
    HeadSearch search(SimulatedHead::Range(), *room.camera(), *room.map(), *carrier_from_map);
    searched.push_back(Find(
        room, loss, 100 + static_cast<std::uint64_t>(i), [&](const PanTilt& at) { return search.Next(at); },
        [&](const PanTilt& at) { search.AddEmptyView(at); }));
    BlindSweep sweep(SimulatedHead::Range(), loss.at);
    swept.push_back(Find(
        room, loss, 100 + static_cast<std::uint64_t>(i), [&](const PanTilt& at) { return sweep.Next(at); },
        [](const PanTilt&) {}));
  }
  RecordProperty("losses", losses);
  RecordProperty("median_search_s", std::to_string(Median(searched)));
  RecordProperty("median_sweep_s", std::to_string(Median(swept)));
  RecordProperty("never_found_by_search", static_cast<int>(std::count_if(searched.begin(), searched.end(),
                                                                         [](double s) { return s >= 60; })));
  RecordProperty("never_found_by_sweep", static_cast<int>(std::count_if(swept.begin(), swept.end(),
                                                                        [](double s) { return s >= 60; })));
  EXPECT_LE(Median(searched), 0.5 * Median(swept));
}

// A frame of a camera with all of the map's points as inliers.
engine::TrackedFrame FrameAt(const RoomWithTable& room, int camera, double seconds,
                             const Rigid3& camera_from_map) {
  engine::TrackedFrame frame;
  frame.frame.camera = camera;
  frame.frame.time = FromSeconds(seconds);
  frame.state = engine::TrackingState::kSixDof;
  frame.map = room.map();
  frame.map_key = RoomWithTable::kKey;
  frame.camera_from_map = camera_from_map;
  for (const engine::MapPoint& point : room.map()->points)
    frame.matches.push_back({point.id, Eigen::Vector2f::Zero(), 0, true});
  return frame;
}

TEST(HeadControl, FollowsTheGazeOfTheOtherCamera) {
  const RoomWithTable& room = TheRoom();
  const auto carrier_from_map = room.CarrierFromMap();
  ASSERT_TRUE(carrier_from_map);
  SimulatedHead head;
  HeadControl control(&head, 1, room.camera(), HeadPolicy::kFollowGaze);
  engine::TrackedFrame hand = FrameAt(room, 0, 1, Rigid3());
  const auto& points = room.map()->points;
  const auto finite = std::find_if(points.begin(), points.end(),
                                   [](const engine::MapPoint& point) { return !point.infinite(); });
  ASSERT_NE(finite, points.end());
  const engine::MapPoint& looked_at = *finite;
  hand.matches = {{looked_at.id, Eigen::Vector2f::Zero(), 0, true}};
  control.AddView(hand);
  control.AddView(FrameAt(room, 1, 1, *carrier_from_map));
  const PanTilt there = TowardPoint(*carrier_from_map, looked_at.position()), at = head.At(FromSeconds(10));
  EXPECT_NEAR(at.pan_rad, there.pan_rad, 1e-9);
  EXPECT_NEAR(at.tilt_rad, there.tilt_rad, 1e-9);
}

TEST(HeadControl, TurnsBackToTheMapAndSearchesItWhenLost) {
  const RoomWithTable& room = TheRoom();
  const auto carrier_from_map = room.CarrierFromMap();
  ASSERT_TRUE(carrier_from_map);
  SimulatedHead head;
  HeadControl control(&head, 0, room.camera(), HeadPolicy::kKeepMapInView);
  head.LookAt({90 * kRadPerDegree, 0}, {});
  const PanTilt aside = head.At(FromSeconds(5));
  const Rigid3 camera_from_carrier(CarrierFromCamera(aside).inverse(), Eigen::Vector3d::Zero());
  control.AddView(FrameAt(room, 0, 5, camera_from_carrier * *carrier_from_map));
  EXPECT_LT(std::abs(head.At(FromSeconds(20)).pan_rad), 40 * kRadPerDegree);
  EXPECT_FALSE(control.searching());
  // It waits shortly after a loss, then searches, also in directions that it has not looked at.
  engine::TrackedFrame lost;
  lost.state = engine::TrackingState::kLost;
  double least = 10, most = -10;
  for (int i = 0; i < 150; ++i) {
    lost.frame.time = FromSeconds(5.15 + 0.1 * i);
    control.AddView(lost);
    EXPECT_EQ(control.searching(), i >= 3) << i;
    least = std::min(least, head.At(lost.frame.time).pan_rad);
    most = std::max(most, head.At(lost.frame.time).pan_rad);
  }
  EXPECT_TRUE(control.searching());
  EXPECT_GT(most - least, 60 * kRadPerDegree);
}

}  // namespace
}  // namespace docent::app
