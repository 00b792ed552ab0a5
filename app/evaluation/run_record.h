// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/time.h"
#include "engine/geometry/camera_model.h"
#include "engine/mapping/mapper.h"
#include "engine/tracking/tracked_frame.h"

// Record of a run for its evaluation: plain numbers without images and map snapshots, so that a whole run
// fits in memory and tests can construct records.
namespace docent::app {

struct KeyFrameCounts {
  int sixdof = 0, panorama = 0;
  int localized = 0;  // Localized panorama keyframes.
  bool operator==(const KeyFrameCounts&) const = default;
};

struct PointCounts {
  int finite = 0, infinite = 0;
  int converted = 0;  // Infinite points that became finite.
  bool operator==(const PointCounts&) const = default;
};

// Time that the mapper spent on each task.
struct MappingTimes {
  double bundle_adjustment_s = 0, panorama_localization_s = 0, infinite_triangulation_s = 0,
         loop_closing_s = 0, other_s = 0;
  double max_queue_latency_s = 0;  // See engine::MapperTimes.
  int loops_closed = 0;
};

// Tracking result of one image.
struct FrameRecord {
  Timestamp time{};
  engine::TrackingState state = engine::TrackingState::kInitializing;
  std::uint64_t map_key = 0;       // 0: no map.
  engine::Rigid3 camera_from_map;  // Valid when HasPose(state). The live pose, not corrected afterwards.
  int finite_points = 0, infinite_points = 0;
  double quality = 0;
  double tracking_ms = 0;
  KeyFrameCounts map_keyframes;  // Size of the map at that time.
  PointCounts map_points;
  MappingTimes mapping = {};  // Since the beginning of the run.
  double median_depth = 0;    // Of the finite inliers in map units; 0 when there are none.
};

// Initialization of a map: the first frame with a pose when the map had finite points, and the keyframes of
// the map at that frame.
struct InitializationRecord {
  struct KeyFrame {
    Timestamp time{};
    engine::Rigid3 camera_from_map;
  };
  // A finite inlier of the frame.
  struct Point {
    Eigen::Vector2f pixel = Eigen::Vector2f::Zero();
    double depth = 0;  // Along the optical axis, in map units.
  };
  std::uint64_t map_key = 0;
  std::size_t frame = 0;            // Index in RunRecord::frames.
  std::vector<KeyFrame> keyframes;  // Keyframes with a known position.
  std::vector<Point> points;        // At most kMaxPoints, evenly spaced in the list of matches.
  static constexpr std::size_t kMaxPoints = 200;
};

// Whether the frame was tracked in a map with infinite points only, so that its position is undefined.
inline bool InMapWithoutDepth(const FrameRecord& frame) {
  return frame.map_points.infinite > 0 && frame.map_points.finite == 0;
}

// Radial reprojection residuals in one ring of the image, positive outwards; see CalibrationMonitor.
struct LensRing {
  std::size_t samples = 0;
  double mean_px = 0, sigma_px = 0;
};

// The estimated calibration at the end of a run.
struct LensRecord {
  double focal_px = 0, k1 = 0;
  double focal_sigma_percent = 0;  // Standard deviation relative to the focal length.
  bool fixed = false;              // The estimate was precise enough to be final.
};

struct MapRecord {
  std::uint64_t key = 0;
  std::string name;
  bool discarded =
      false;  // Discarded during the run as a false initialization; its frames count as untracked.
  // Name of the map that it was joined into during the run. Its live poses are compared by an alignment of
  // their own; its keyframes and points are counted in the other map.
  std::string joined_into = {};
  KeyFrameCounts keyframes;
  PointCounts points;
  std::vector<Eigen::Vector3d> positions;  // Finite points, map frame.
  std::vector<bool> converted = {};        // For each position: whether the point was infinite before.
  // Centres of keyframes with a known position, and of panorama maps.
  std::vector<Eigen::Vector3d> sixdof_centers = {}, localized_centers = {}, panorama_centers = {};
  // Centres of the keyframes with a known position after a final global bundle adjustment; empty if not
  // requested.
  std::vector<std::pair<Timestamp, Eigen::Vector3d>> adjusted_centers = {};
  // The readout time of the rolling shutter, seconds, along columns and rows; empty where no image turned.
  std::optional<Eigen::Vector2d> readout_s = std::nullopt;
  // Axes of the views: up, and the horizontal viewing direction of the first keyframe; unit vectors, map
  // frame.
  Eigen::Vector3d up = -Eigen::Vector3d::UnitY(), forward = Eigen::Vector3d::UnitZ();
};

struct RunRecord {
  std::string name;                 // Name of the sequence.
  std::string engine = {};          // "hybrid" or "sixdof"; empty when unknown.
  std::vector<FrameRecord> frames;  // One camera, ordered by time, including dropped frames.
  std::vector<MapRecord> maps;
  MappingTimes mapping;
  double wall_s = 0;
  double peak_memory_mb = 0;
  std::vector<InitializationRecord> initializations = {};  // One for each map with finite points, by frame.
  std::optional<LensRecord> lens = {};  // Only of a camera whose calibration was estimated.
  // The model of that estimate; null for a known calibration.
  std::shared_ptr<const engine::CameraModel> lens_model = {};
  std::vector<LensRing> lens_rings = {};  // From the image centre outwards.
};

// Records the tracked frames of a session and the initializations of its maps. One thread.
class RunRecorder {
 public:
  // mapping: the time spent so far.
  void Add(const engine::TrackedFrame& frame, const MappingTimes& mapping = {});
  const std::vector<FrameRecord>& frames() const { return frames_; }
  const std::vector<InitializationRecord>& initializations() const { return initializations_; }

 private:
  void AddInitialization(const engine::TrackedFrame& frame,
                         const std::vector<InitializationRecord::Point>& points);

  std::vector<FrameRecord> frames_;
  std::vector<InitializationRecord> initializations_;
  std::uint64_t counted_map_ = 0, counted_revision_ = 0;  // Map and revision of keyframes_ and points_.
  KeyFrameCounts keyframes_;
  PointCounts points_;
};

// Counts and positions of a map snapshot.
MapRecord MakeMapRecord(std::uint64_t key, const std::string& name, const engine::MapSnapshot& map);

// Computes MapRecord::adjusted_centers on a copy of the map.
std::vector<std::pair<Timestamp, Eigen::Vector3d>> AdjustedCenters(const engine::MapSnapshot& map);

LensRecord MakeLensRecord(const engine::EstimatedLens& lens);
MappingTimes MakeMappingTimes(const engine::MapperTimes& times);

// Peak resident memory of this process since its start or since ResetPeakMemory, in units of 2^20 bytes; 0
// when the system does not report it.
double PeakMemoryMegabytes();
void ResetPeakMemory();

}  // namespace docent::app
