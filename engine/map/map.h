// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <map>
#include <memory>
#include <vector>

#include "engine/map/map_snapshot.h"

namespace docent::engine {

// The map that the mapper works on: the data of a MapSnapshot with links between keyframes and points in both
// directions. One mapper owns it and accesses it on its thread alone; all others read Snapshot(). Invariants:
// each point is observed by at least one keyframe, observers and observations are consistent, and the point's
// source keyframe is in the map. Finite points are observed by localized keyframes only, infinite points by
// keyframes of their panorama map.
class Map {
 public:
  struct PointRecord {
    MapPoint point;
    std::vector<KeyFrameId> observers;  // ascending
    bool alive = true;
    int seen_inlier = 0, seen_outlier = 0, not_found = 0;  // counts reported by the trackers
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
  // All points by ascending id, including removed ones until the next Snapshot().
  std::vector<PointRecord>& points() { return points_; }
  const std::vector<PointRecord>& points() const { return points_; }

  // By ascending id.
  const std::vector<PanoramaMap>& panoramas() const { return panoramas_; }

  KeyFrameRecord& AddKeyFrame(KeyFrame keyframe);  // assigns an id
  MapPointId AddPoint(MapPoint point);             // assigns an id; the caller adds observations
  PointRecord* FindPoint(MapPointId id);           // null if unknown or removed
  KeyFrameRecord* FindKeyFrame(KeyFrameId id);

  // False if the keyframe observes the point already.
  bool AddObservation(const Observation& observation);
  // Also removes the point if fewer than two observations are left or its source keyframe no longer observes
  // it.
  void RemoveObservation(KeyFrameId keyframe, MapPointId point);
  void RemovePoint(MapPointId id);
  void RemoveKeyFrame(KeyFrameId id);
  // Fuses two duplicate finite points: `into` receives the observations of `duplicate`, except in keyframes
  // that observe both, and its tracking statistics; `duplicate` is removed.
  void FusePoints(MapPointId into, MapPointId duplicate);

  // Makes a localized keyframe the reference of a new panorama map. A former dependent keyframe leaves its
  // panorama map and takes the infinite points with it that it is the source of (hybrid-slam §5.1).
  PanoramaId OpenPanorama(KeyFrameId reference);
  // Makes another localized keyframe at the same centre the reference.
  void SetReference(PanoramaId panorama, KeyFrameId reference);
  // Makes a triangulated infinite point finite; its source must be localized. The observations of dependent
  // keyframes are removed, and the caller adds a second observation.
  void MakeFinite(PointRecord* record, const Eigen::Vector3d& position);
  // Sets an infinite point's direction to the mean of the rays from its observations.
  void UpdateDirection(PointRecord* record);

  // Moves parts of the map by similarities: localized keyframes by their own (keyframes without one stay),
  // finite points with their source keyframe, dependent panorama keyframes and their points with the
  // reference keyframe. The next Snapshot() contains the correction.
  void Correct(const std::map<KeyFrameId, Sim3>& after_from_before);
  // Adds a correction that the caller has already applied to keyframes and points. The next Snapshot()
  // contains it.
  void AddCorrection(std::map<KeyFrameId, Sim3> after_from_before);
  // By ascending revision.
  const std::vector<std::shared_ptr<const MapCorrection>>& corrections() const { return corrections_; }

  // To be called when keyframes and points were moved otherwise, as by an adjustment: poses that refer to an
  // earlier snapshot no longer fit.
  void NoteMovement() { moved_in_ = revision_ + 1; }
  // The revision of the first snapshot after the last such movement, or of the one it began as.
  std::uint64_t moved_in() const { return moved_in_; }

  // The first keyframe that waits for its local adjustment, for the next Snapshot(); kNoId if none does.
  void SetFirstUnadjusted(KeyFrameId id) { first_unadjusted_ = id; }

  // Updates the median depth of the points that a keyframe observes, and the robust deviation from it.
  void UpdateDepth(KeyFrameRecord* record);
  // Sets the normal to the mean direction towards its observers.
  void UpdateNormal(PointRecord* record);

  // Keyframes that share finite points with this one, in descending order: (id, number of shared points).
  std::vector<std::pair<KeyFrameId, int>> Covisible(KeyFrameId id);

  // An immutable copy of the map with the next revision; drops removed points.
  std::shared_ptr<const MapSnapshot> Snapshot();
  std::size_t AlivePoints() const { return alive_points_; }
  std::size_t FinitePoints() const;  // alive and finite; visits all points

 private:
  void ClosePanorama(PanoramaId id);

  std::map<KeyFrameId, KeyFrameRecord> keyframes_;
  std::vector<PointRecord> points_;
  std::vector<MapPointId> point_ids_;  // of points_, so close together that a search stays in the cache
  std::vector<PanoramaMap> panoramas_;
  std::vector<std::shared_ptr<const MapCorrection>> corrections_;
  std::size_t alive_points_ = 0;
  KeyFrameId next_keyframe_ = 0;
  MapPointId next_point_ = 0;
  PanoramaId next_panorama_ = 0;
  std::uint64_t revision_ = 0;
  std::uint64_t moved_in_ = 0;
  KeyFrameId first_unadjusted_ = kNoId;
};

}  // namespace docent::engine
