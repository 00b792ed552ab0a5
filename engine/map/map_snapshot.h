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

// The data of one map. Plain structs that know nothing of how they are stored, drawn or computed. The mapper
// owns a mutable `Map`; everyone else reads a MapSnapshot, which never changes once it is published, so it
// may be shared by any number of threads without a lock.
namespace docent::engine {

using KeyFrameId = std::uint32_t;  // unique within a map, never used again
using MapPointId = std::uint32_t;  // unique within a map, never used again
using PanoramaId = std::uint32_t;  // unique within a map, never used again
inline constexpr std::uint32_t kNoId = 0xFFFFFFFFu;

// kSixDof: localized, its pose known in six degrees of freedom. kPanorama: only turned away from the
// reference keyframe of its panorama map; it is taken to stand at that keyframe's centre (hybrid-slam §2).
enum class KeyFrameKind : std::uint8_t { kSixDof, kPanorama };

struct KeyFrame {
  KeyFrameId id = kNoId;
  KeyFrameKind kind = KeyFrameKind::kSixDof;
  bool fixed = false;  // pose held by every adjustment (the first keyframe defines the map's frame)
  // The panorama map it belongs to: as its reference (kSixDof, "localized") or as a dependent one
  // (kPanorama).
  PanoramaId panorama = kNoId;
  Timestamp time{};
  Rigid3 camera_from_map;
  double mean_depth = 1.0;  // metres, of the points it sees; the length that keyframe spacing is measured in
  double depth_sigma = 0.5;
  std::shared_ptr<const CameraModel> camera;
  std::shared_ptr<const ImageFeatures> features;  // never null in a snapshot
};

struct MapPoint {
  MapPointId id = kNoId;
  // Homogeneous in the map: (X, Y, Z, 1) finite, or (unit direction, 0) infinite.
  Eigen::Vector4d point_in_map = Eigen::Vector4d::UnitW();
  PanoramaId panorama = kNoId;  // an infinite point is seen from one panorama map alone; kNoId when finite
  bool was_infinite = false;    // finite by triangulation of what panorama keyframes saw (hybrid-slam §5.2)
  // Where its patch is cut from: a keyframe, a pyramid level, and the (sub-)pixel of that level.
  KeyFrameId source_keyframe = kNoId;
  std::uint8_t source_level = 0;
  Eigen::Vector2f source_pixel = Eigen::Vector2f::Zero();
  // Surface normal in the map, unit length; towards the source camera until something better is known.
  Eigen::Vector3f normal = -Eigen::Vector3f::UnitZ();

  bool infinite() const { return point_in_map[3] == 0.0; }
  Eigen::Vector3d position() const { return point_in_map.head<3>(); }
};

// A map point seen in a keyframe, at a pixel of level 0 measured on `level` (sigma grows as 2^level).
struct Observation {
  KeyFrameId keyframe = kNoId;
  MapPointId point = kNoId;
  Eigen::Vector2f pixel = Eigen::Vector2f::Zero();
  std::uint8_t level = 0;
};

// Keyframes about one centre of rotation, registered in the map by its reference keyframe, which is localized
// (hybrid-slam §2). The dependent keyframes and infinite points name it.
struct PanoramaMap {
  PanoramaId id = kNoId;
  KeyFrameId reference = kNoId;
};

struct MapSnapshot {
  std::uint64_t revision = 0;             // grows with every publication of the same map
  std::vector<KeyFrame> keyframes;        // by ascending id
  std::vector<MapPoint> points;           // by ascending id
  std::vector<Observation> observations;  // by ascending keyframe, then point
  std::vector<PanoramaMap> panoramas;     // by ascending id
  // The last times that it was moved as a whole, by ascending revision; not stored with the map.
  std::vector<std::shared_ptr<const MapCorrection>> corrections;
  // Next ids to give out, so that a map that is stored and grown again never reuses one.
  KeyFrameId next_keyframe = 0;
  MapPointId next_point = 0;
  PanoramaId next_panorama = 0;

  // Null when there is none of that id. O(log n).
  const KeyFrame* FindKeyFrame(KeyFrameId id) const;
  const MapPoint* FindPoint(MapPointId id) const;
  const PanoramaMap* FindPanorama(PanoramaId id) const;
  // Whether anything in it has a place: false for a map of directions alone.
  bool HasFinitePoints() const;
};

// A sentence that says what is inconsistent (order, missing keyframe, pixel outside the image, number not
// finite, rotation not unit), or empty when the snapshot may be used. For data from files.
std::string Validate(const MapSnapshot& map);

}  // namespace docent::engine
