// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <utility>
#include <vector>

#include "engine/map/map_snapshot.h"
#include "engine/tracking/point_id_set.h"

namespace docent::engine {

struct NearbyPointOptions {
  int frames = 6;              // for which a choice is good, as the camera goes on
  std::size_t keyframes = 20;  // whose points are looked for: those that share most with the last frame
  // The nearest ones, among which these are chosen: in a large map the others are not even looked at.
  std::size_t examined_keyframes = 100;
  // A point that was first seen from further off than this (radians between the lines of sight; a third of
  // the scale counts as much) is looked for as a nearer keyframe shows it.
  double max_source_misfit = 0.3;
  // Of the first view's misfit: a later one is worth its own error of alignment when it fits this much
  // better.
  double better_source = 0.6;
};

// A point that may be looked for.
struct NearbyPoint {
  const MapPoint* point;   // its source is the keyframe whose view of it resembles the present one
  const KeyFrame* source;  // that keyframe
  // As in *point, beside what else it takes to tell whether it is in the image.
  MapPointId id;
  Eigen::Vector3f normal;
  // Homogeneous, in the map. While the camera turns about a point that is not its own centre, a direction
  // is taken to be as far from its source as the panorama map's reference sees the scene: nearer to the
  // truth than infinity.
  Eigen::Vector4d place;
};

// What of a map may be seen from about here, finite and infinite: chosen anew when the map has changed and
// every few frames. One a tracker, on its thread; allocates nothing once it has grown to the map.
class NearbyPoints {
 public:
  explicit NearbyPoints(const NearbyPointOptions& options) : options_(options) {}

  // seen: the last frame's inliers by ascending id, empty where the pose is all that is known. panorama:
  // whose directions are wanted, kNoId for none. pivot: see Turn. The snapshot must live until the next call.
  void Update(const MapSnapshot& map, const Rigid3& camera_from_map, const std::vector<MapPointId>& seen,
              PanoramaId panorama, const Eigen::Vector3d& pivot);
  // The next choice is made by the pose alone.
  void Forget() { map_ = nullptr; }

  // By ascending id, good until the next Update().
  const std::vector<NearbyPoint>& finite() const { return finite_; }
  const std::vector<NearbyPoint>& infinite() const { return infinite_; }

 private:
  void ChooseFinite(const MapSnapshot& map, const Rigid3& camera_from_map,
                    const std::vector<MapPointId>& seen);
  void ChooseInfinite(const MapSnapshot& map);
  // The points of wanted_.
  void Take(const MapSnapshot& map, bool infinite, std::vector<NearbyPoint>* points);
  void ChooseSources(const MapSnapshot& map, const Rigid3& camera_from_map);
  // A point of finite_ that its source shows poorly.
  struct PoorlyViewed {
    MapPointId point;
    std::uint32_t index;          // in finite_
    double wanted;                // squared misfit that a view must stay below
    std::int32_t resourced = -1;  // place in resourced_
  };
  void TakeSource(const KeyFrame& keyframe, const Observation& observation, double misfit,
                  PoorlyViewed* poor);

  NearbyPointOptions options_;
  std::vector<NearbyPoint> finite_, infinite_;
  const MapSnapshot* map_ = nullptr;
  std::uint64_t revision_ = 0;
  int age_frames_ = 0;
  PanoramaId panorama_ = kNoId;  // of infinite_
  bool has_pivot_ = false;       // at infinite_'s choice
  // Points with another source than the map's.
  std::vector<MapPoint> resourced_;
  // Scratch, kept to save allocations.
  std::vector<std::pair<double, std::size_t>> ranked_;  // (rank, keyframe index), best first
  PointIdSet wanted_;
  std::vector<PoorlyViewed> poorly_viewed_;  // by ascending point
};

}  // namespace docent::engine
