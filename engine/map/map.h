// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <map>
#include <memory>
#include <vector>

#include "engine/map/map_snapshot.h"

namespace docent::engine {

// The map that the mapper works on: the data of a MapSnapshot with the links between keyframes and points
// kept in both directions. Owned by one mapper and touched by its thread alone; everyone else sees
// Snapshot(). Always holds: a point is observed by at least one keyframe, observers and observations agree,
// the point's source keyframe is in the map. Finite points are observed by localized keyframes alone,
// infinite ones by keyframes of their panorama map.
class Map {
 public:
  struct PointRecord {
    MapPoint point;
    std::vector<KeyFrameId> observers;  // ascending
    bool alive = true;
    int seen_inlier = 0, seen_outlier = 0, not_found = 0;  // as the trackers tell
  };
  struct KeyFrameRecord {
    KeyFrame keyframe;
    std::vector<Observation> observations;  // by ascending point
  };

  Map() = default;
  // The snapshot must be valid (see Validate).
  explicit Map(const MapSnapshot& snapshot);

  bool empty() const { return keyframes_.empty(); }
  std::map<KeyFrameId, KeyFrameRecord>& keyframes() { return keyframes_; }
  const std::map<KeyFrameId, KeyFrameRecord>& keyframes() const { return keyframes_; }
  // All points by ascending id, dead ones among them until the next Snapshot().
  std::vector<PointRecord>& points() { return points_; }
  const std::vector<PointRecord>& points() const { return points_; }

  // By ascending id.
  const std::vector<PanoramaMap>& panoramas() const { return panoramas_; }

  KeyFrameRecord& AddKeyFrame(KeyFrame keyframe);  // gives it an id
  MapPointId AddPoint(MapPoint point);             // gives it an id; observations follow
  PointRecord* FindPoint(MapPointId id);           // null when unknown or dead
  KeyFrameRecord* FindKeyFrame(KeyFrameId id);

  // False when the keyframe sees the point already.
  bool AddObservation(const Observation& observation);
  // Removes the point when fewer than two observations are left, or its source keyframe lost sight of it.
  void RemoveObservation(KeyFrameId keyframe, MapPointId point);
  void RemovePoint(MapPointId id);
  void RemoveKeyFrame(KeyFrameId id);
  // Two finite points were one: `into` takes over what saw `duplicate`, as far as its keyframes do not see
  // both, and the trackers' verdicts; `duplicate` is removed.
  void FusePoints(MapPointId into, MapPointId duplicate);

  // Makes a localized keyframe the reference of a new panorama map. One that was a dependent keyframe leaves
  // its panorama map, and the infinite points that it is the source of come with it (hybrid-slam §5.1).
  PanoramaId OpenPanorama(KeyFrameId reference);
  // Another localized keyframe at the same centre takes over as reference.
  void SetReference(PanoramaId panorama, KeyFrameId reference);
  // An infinite point whose source is localized has been triangulated. What dependent keyframes saw of it is
  // forgotten; a second observation is the caller's to add.
  void MakeFinite(PointRecord* record, const Eigen::Vector3d& position);
  // The direction of an infinite point: the mean of the rays under which its keyframes see it.
  void UpdateDirection(PointRecord* record);

  // Moves the reference_keyframe of keyframes by similarities, a finite point with its source keyframe, a
  // dependent panorama keyframe and its directions with the reference. after_from_before: of localized
  // keyframes; those that are missing stay. The next Snapshot() tells of it.
  void Correct(const std::map<KeyFrameId, Sim3>& after_from_before);
  // By ascending revision.
  const std::vector<std::shared_ptr<const MapCorrection>>& corrections() const { return corrections_; }

  // Median depth and spread of the points that a keyframe sees.
  void UpdateDepth(KeyFrameRecord* record);
  // Points towards the mean of the directions to its observers.
  void UpdateNormal(PointRecord* record);

  // Keyframes that share finite points with this one, most shared first: (id, count).
  std::vector<std::pair<KeyFrameId, int>> Covisible(KeyFrameId id);

  // An immutable copy of what is alive, with the next revision; drops dead points.
  std::shared_ptr<const MapSnapshot> Snapshot();
  std::size_t AlivePoints() const { return alive_points_; }

 private:
  void ClosePanorama(PanoramaId id);

  std::map<KeyFrameId, KeyFrameRecord> keyframes_;
  std::vector<PointRecord> points_;
  std::vector<PanoramaMap> panoramas_;
  std::vector<std::shared_ptr<const MapCorrection>> corrections_;
  std::size_t alive_points_ = 0;
  KeyFrameId next_keyframe_ = 0;
  MapPointId next_point_ = 0;
  PanoramaId next_panorama_ = 0;
  std::uint64_t revision_ = 0;
};

}  // namespace docent::engine
