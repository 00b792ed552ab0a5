// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "engine/base/time.h"
#include "engine/geometry/camera_model.h"
#include "engine/geometry/rigid3.h"
#include "engine/map/map_correction.h"
#include "engine/vision/image_pyramid.h"

// The data of one map as plain structs, independent of storage, display and algorithms. The mapper owns a
// mutable `Map`; all others read a MapSnapshot, which never changes after its publication and may be shared
// by any number of threads without a lock.
namespace docent::engine {

using KeyFrameId = std::uint32_t;  // unique within a map, never reused
using MapPointId = std::uint32_t;  // unique within a map, never reused
using PanoramaId = std::uint32_t;  // unique within a map, never reused
// The id of nothing, for all three kinds of ids.
inline constexpr std::uint32_t kNoId = 0xFFFFFFFFu;

// kSixDof: localized, with a pose in six degrees of freedom. kPanorama: known only by its rotation relative
// to the reference keyframe of its panorama map, whose centre it is assumed to share (hybrid-slam §2).
enum class KeyFrameKind : std::uint8_t { kSixDof, kPanorama };

// A frame that the map keeps, with its pose and image.
struct KeyFrame {
  KeyFrameId id = kNoId;                      // unique within the map
  KeyFrameKind kind = KeyFrameKind::kSixDof;  // whether its position is known
  // The pose is constant in every adjustment (the first keyframe defines the map's frame).
  bool fixed = false;
  // The panorama map to which it belongs, as its reference (kSixDof, "localized") or as a dependent keyframe
  // (kPanorama).
  PanoramaId panorama = kNoId;
  Timestamp time{};         // of its image
  Rigid3 camera_from_map;   // map units
  double mean_depth = 1.0;  // Median depth of the observed points in map units; the unit of keyframe spacing.
  double depth_sigma = 0.5;                       // robust standard deviation of these depths, map units
  std::shared_ptr<const CameraModel> camera;      // of its image; never null in a snapshot
  std::shared_ptr<const ImageFeatures> features;  // never null in a snapshot
};

// A point of the map; finite (known depth) or infinite (a direction).
struct MapPoint {
  MapPointId id = kNoId;  // unique within the map
  // Homogeneous in the map: (X, Y, Z, 1) finite, or (unit direction, 0) infinite.
  Eigen::Vector4d point_in_map = Eigen::Vector4d::UnitW();
  PanoramaId panorama = kNoId;  // panorama map of an infinite point; kNoId for a finite one
  bool was_infinite = false;    // triangulated from observations of panorama keyframes (hybrid-slam §5.2)
  // The origin of its patch: a keyframe, a pyramid level, and the (sub-)pixel of that level.
  KeyFrameId source_keyframe = kNoId;
  std::uint8_t source_level = 0;                           // pyramid level
  Eigen::Vector2f source_pixel = Eigen::Vector2f::Zero();  // of source_level
  // Surface normal in the map, unit length. Initially towards the source camera.
  Eigen::Vector3f normal = -Eigen::Vector3f::UnitZ();

  // Whether only its direction is known.
  bool infinite() const { return point_in_map[3] == 0.0; }
  // In the map, map units; of an infinite point its direction.
  Eigen::Vector3d position() const { return point_in_map.head<3>(); }
};

// The observation of a map point in a keyframe: a level-0 pixel, measured on `level` (sigma grows as
// 2^level).
struct Observation {
  KeyFrameId keyframe = kNoId;                      // whose image shows it
  MapPointId point = kNoId;                         // what is seen
  Eigen::Vector2f pixel = Eigen::Vector2f::Zero();  // of level 0
  std::uint8_t level = 0;                           // on which it was measured
};

// Keyframes with one common centre, placed in the map by its reference keyframe, which is localized
// (hybrid-slam §2). Dependent keyframes and infinite points refer to it by its id.
struct PanoramaMap {
  PanoramaId id = kNoId;         // unique within the map
  KeyFrameId reference = kNoId;  // its first keyframe
};

// One immutable state of a map. The vectors are ordered so that ids can be searched.
struct MapSnapshot {
  std::uint64_t revision = 0;             // increases with every publication of the same map
  std::vector<KeyFrame> keyframes;        // by ascending id
  std::vector<MapPoint> points;           // by ascending id
  std::vector<Observation> observations;  // by ascending keyframe, then point
  std::vector<PanoramaMap> panoramas;     // by ascending id
  // The most recent corrections by ascending revision; not stored with the map.
  std::vector<std::shared_ptr<const MapCorrection>> corrections;
  // The first keyframe that waits for its local adjustment; kNoId if none does. Not stored with the map.
  KeyFrameId first_unadjusted = kNoId;
  // Next ids to assign, so that a map that is stored and later extended never reuses one.
  KeyFrameId next_keyframe = 0;
  MapPointId next_point = 0;     // the same for points
  PanoramaId next_panorama = 0;  // the same for panorama maps

  // Null if there is none with that id. O(log n).
  const KeyFrame* FindKeyFrame(KeyFrameId id) const;
  const MapPoint* FindPoint(MapPointId id) const;        // null if there is none; O(log n)
  const PanoramaMap* FindPanorama(PanoramaId id) const;  // null if there is none; O(log n)
  // Whether any point is finite: false for a map that consists of panorama maps only.
  bool HasFinitePoints() const;
};

// A sentence that says what is inconsistent (order, missing keyframe, pixel outside the image, number not
// finite, rotation not unit); empty if the snapshot is valid. For data from files.
std::string Validate(const MapSnapshot& map);

}  // namespace docent::engine
