// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "engine/base/option_check.h"
#include "engine/map/map_snapshot.h"
#include "engine/tracking/point_id_set.h"

namespace docent::engine {

struct NearbyPointOptions {
  int frames = 6;  // frames for which a selection is reused while the camera moves on
  // The points of this many keyframes are searched: those that share the most points with the last frame.
  std::size_t keyframes = 20;
  // The nearest keyframes, among which those are selected; the bound keeps the cost independent of the map
  // size.
  std::size_t examined_keyframes = 100;
  // If the present view of a point differs more than this from its source view, its patch is taken from a
  // more similar keyframe. The measure is in radians between the lines of sight; a scale change of 1/3 counts
  // as much as one radian.
  double max_source_difference = 0.3;
  // Another keyframe replaces the source only if its view differs by less than this ratio of the source's
  // difference: each replacement adds its own alignment error.
  double max_difference_ratio = 0.6;

  // Describes the first invalid option in one sentence, or empty.
  std::optional<std::string> Validate() const;
};

// A candidate for the search.
struct NearbyPoint {
  const MapPoint* point;   // its source is the keyframe with the view most similar to the present one
  const KeyFrame* source;  // the source keyframe
  // Copies from *point and data for the visibility test.
  MapPointId id;
  Eigen::Vector3f normal;
  // Homogeneous, in the map. While the camera rotates about a pivot other than its centre, an infinite point
  // is assumed to be at the median depth of the panorama map's reference keyframe: that is closer to the
  // truth than infinity.
  Eigen::Vector4d point_in_map;
};

// Selects the map points that may be visible from the current pose, finite and infinite. The selection is
// renewed when the map has changed and every few frames. Each tracker owns one and uses it on its thread; it
// stops allocating once its buffers have the size of the map.
class NearbyPoints {
 public:
  explicit NearbyPoints(const NearbyPointOptions& options) : options_(Checked(options)) {}

  // seen: inliers of the last frame by ascending id; empty if only the pose is known. panorama: panorama map
  // whose infinite points are wanted, kNoId for none. pivot: see PivotEstimate. The snapshot must outlive the
  // next call.
  void Update(const MapSnapshot& map, const Rigid3& camera_from_map, const std::vector<MapPointId>& seen,
              PanoramaId panorama, const Eigen::Vector3d& pivot);
  // The next selection uses the pose alone.
  void ForgetLastFrame() { map_ = nullptr; }

  // By ascending id, valid until the next Update().
  const std::vector<NearbyPoint>& finite() const { return finite_; }
  const std::vector<NearbyPoint>& infinite() const { return infinite_; }

 private:
  void ChooseFinite(const MapSnapshot& map, const Rigid3& camera_from_map,
                    const std::vector<MapPointId>& seen);
  void ChooseInfinite(const MapSnapshot& map);
  // Copies the points of wanted_ that are finite or infinite as asked.
  void CopyWanted(const MapSnapshot& map, bool infinite, std::vector<NearbyPoint>* points);
  void ChooseSources(const MapSnapshot& map, const Rigid3& camera_from_map);
  // A point of finite_ whose source view differs too much from the present view.
  struct PoorlyViewed {
    MapPointId point;
    std::uint32_t index;           // index in finite_
    double max_difference;         // squared view difference below which another keyframe replaces the source
    std::int32_t reassigned = -1;  // index in reassigned_, -1 for none
  };
  void ReplaceSource(const KeyFrame& keyframe, const Observation& observation, double difference,
                     PoorlyViewed* poor);

  NearbyPointOptions options_;
  std::vector<NearbyPoint> finite_, infinite_;
  const MapSnapshot* map_ = nullptr;
  std::uint64_t revision_ = 0;
  int age_frames_ = 0;
  PanoramaId panorama_ = kNoId;  // panorama map of infinite_
  bool has_pivot_ = false;       // whether infinite_ was selected with a pivot
  // Copies of points whose source differs from the map's.
  std::vector<MapPoint> reassigned_;
  // Scratch memory, kept to avoid allocations.
  std::vector<std::pair<double, std::size_t>> ranked_;  // (rank, keyframe index), best first
  PointIdSet wanted_;
  std::vector<PoorlyViewed> poorly_viewed_;  // by ascending point
};

}  // namespace docent::engine
