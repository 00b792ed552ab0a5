// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/base/time.h"
#include "engine/mapping/mapper.h"
#include "engine/tracking/tracked_frame.h"

// What a run leaves for its evaluation: plain numbers, no images and no maps, so that it can be kept whole
// and made up by tests.
namespace docent::app {

struct KeyFrameCounts {
  int sixdof = 0, panorama = 0;
  int localized = 0;  // panorama keyframes that have got a position of their own
  bool operator==(const KeyFrameCounts&) const = default;
};

struct PointCounts {
  int finite = 0, infinite = 0;
  int converted = 0;  // infinite points that became finite
  bool operator==(const PointCounts&) const = default;
};

// Seconds that the mapper spent, by task.
struct MappingTimes {
  double bundle_adjustment_s = 0, panorama_localization_s = 0, infinite_triangulation_s = 0,
         loop_closing_s = 0, other_s = 0;
  double longest_hold_s = 0;  // see engine::MapperTimes
  int loops_closed = 0;
};

// One image of one camera.
struct FrameRecord {
  Timestamp time{};
  engine::TrackingState state = engine::TrackingState::kInitializing;
  std::uint64_t map_key = 0;       // 0 when there is none
  engine::Rigid3 camera_from_map;  // valid when HasPose(state); as it was told live, never smoothed
  int finite_points = 0, infinite_points = 0;
  double quality = 0;
  double tracking_ms = 0;
  KeyFrameCounts map_keyframes;  // size of the map at that time
  PointCounts map_points;
  MappingTimes mapping = {};  // since the run began
  double median_depth = 0;    // of the finite inliers, as StartRecord::Point::depth; 0 when there are none
};

// The first frame with a pose in a map that had depth, and the keyframes that gave the map its depth.
struct StartRecord {
  struct KeyFrame {
    Timestamp time{};
    engine::Rigid3 camera_from_map;
  };
  // A finite inlier of the frame.
  struct Point {
    Eigen::Vector2f pixel = Eigen::Vector2f::Zero();
    double depth = 0;  // along the optical axis, in the map's unit
  };
  std::uint64_t map_key = 0;
  std::size_t frame = 0;            // index in RunRecord::frames
  std::vector<KeyFrame> keyframes;  // of the map at that frame, those with a position of their own
  std::vector<Point> points;        // at most kMostPoints of them, evenly over the list
  static constexpr std::size_t kMostPoints = 200;
};

// The frame was tracked in a map that knew no depth yet: its position is not one.
inline bool InMapOfDirections(const FrameRecord& frame) {
  return frame.map_points.infinite > 0 && frame.map_points.finite == 0;
}

// How far points were found outside of where they were expected, in a ring of the image; see
// CalibrationMonitor.
struct LensRing {
  std::size_t samples = 0;
  double mean_px = 0, sigma_px = 0;
};

struct MapRecord {
  std::uint64_t key = 0;
  std::string name;
  bool discarded = false;  // given up during the run (a false start): its frames count as untracked
  // The name of the map that it became a part of during the run. Its frames are compared as they were told,
  // by an alignment of their own; its keyframes and points are counted there.
  std::string joined_into = {};
  KeyFrameCounts keyframes;
  PointCounts points;
  std::vector<Eigen::Vector3d> positions;  // of finite points, map frame, for the view from above
  std::vector<bool> converted = {};        // whether each of them was a direction before
  // Of keyframes whose place is known, and of the places where panorama maps stand.
  std::vector<Eigen::Vector3d> sixdof_centers = {}, localized_centers = {}, panorama_centers = {};
  // Of the keyframes whose place is known, after one more adjustment of the whole map; empty when nobody
  // asked.
  std::vector<std::pair<Timestamp, Eigen::Vector3d>> adjusted_centers = {};
  // How it is looked at: upwards, and the way the first keyframe looks, level; unit vectors of the map.
  Eigen::Vector3d up = -Eigen::Vector3d::UnitY(), forward = Eigen::Vector3d::UnitZ();
};

struct RunRecord {
  std::string name;                 // of the sequence
  std::string engine = {};          // "hybrid" or "sixdof"; empty when nobody said
  std::vector<FrameRecord> frames;  // one camera, by time, dropped ones too
  std::vector<MapRecord> maps;
  MappingTimes mapping;
  double wall_s = 0;
  double peak_memory_mb = 0;
  std::vector<StartRecord> starts = {};   // one for each map that had depth, by frame
  std::vector<LensRing> lens_rings = {};  // what tracking left over, from the middle of the image outwards
};

// Fills frames and maps from what the session delivers. One thread.
class RunRecorder {
 public:
  // mapping: the seconds spent until now.
  void Add(const engine::TrackedFrame& frame, const MappingTimes& mapping = {});
  const std::vector<FrameRecord>& frames() const { return frames_; }
  const std::vector<StartRecord>& starts() const { return starts_; }

 private:
  void AddStart(const engine::TrackedFrame& frame, const std::vector<StartRecord::Point>& points);

  std::vector<FrameRecord> frames_;
  std::vector<StartRecord> starts_;
  std::uint64_t counted_map_ = 0, counted_revision_ = 0;  // what `keyframes_` and `points_` were counted in
  KeyFrameCounts keyframes_;
  PointCounts points_;
};

// Counts and positions of a map as it is now; `converted` and `localized` are the mapper's to add.
MapRecord MakeMapRecord(std::uint64_t key, const std::string& name, const engine::MapSnapshot& map);

// For MapRecord::adjusted_centers; the map itself stays as it is.
std::vector<std::pair<Timestamp, Eigen::Vector3d>> AdjustedCenters(const engine::MapSnapshot& map);

MappingTimes MakeMappingTimes(const engine::MapperTimes& times);

// Highest resident memory of this process since it began or since ResetPeakMemory, in megabytes (2^20 bytes);
// 0 where the system does not say.
double PeakMemoryMegabytes();
void ResetPeakMemory();

}  // namespace docent::app
