// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "engine/geometry/camera_model.h"
#include "engine/geometry/rigid3.h"
#include "engine/map/map_snapshot.h"
#include "engine/vision/patch.h"

// Active search: a map point's patch, warped as the present view should show it, is looked for about the
// place where the point projects (ptamm §2.1). Used by the tracker for every frame and by the mapper to find
// points again in older keyframes. Not thread safe: every thread owns a searcher.
namespace docent::engine {

struct SearchOptions {
  float min_corner_correlation = 0.60f;  // to be worth aligning
  float min_correlation = 0.75f;         // after alignment at a corner
  float min_direct_correlation = 0.82f;  // without a corner there is less reason to believe a match
  float max_direct_shift_px = 2.5f;      // pixels of the search level
  double min_view_cosine = 0.34;         // about 70 degrees between surface normal and line of sight
};

// Where a point should appear, and how large.
struct PredictedPoint {
  Eigen::Vector3d point_in_camera;
  Eigen::Vector2d pixel;                 // level 0
  Eigen::Matrix<double, 2, 3> jacobian;  // d pixel / d point_in_camera
  Eigen::Matrix2f pixel_from_source;     // level-0 pixels a pixel of the source level
  // What a step of one pixel of the source level, right and down, is on the surface; in the map.
  Eigen::Matrix<double, 3, 2> steps_in_map;
  int level = 0;  // the level whose pixels match the patch's best
};

struct FoundPoint {
  Eigen::Vector2f pixel;  // level 0
  float correlation = 0;
};

enum class PatchComparison : std::uint8_t {
  kStandard,
  kTolerant  // of images whose exposure or sharpness may be another; see AlignPatchTolerantly
};

class PointSearcher {
 public:
  explicit PointSearcher(const SearchOptions& options = {}) : options_(options) {}

  // How patches are compared from now on; kStandard at first.
  void Compare(PatchComparison comparison) { comparison_ = comparison; }
  PatchComparison comparison() const { return comparison_; }

  // Forgets all patches; to be called when another map is searched.
  void Clear();
  // The same, and gives their memory back.
  void Release();

  // Empty when the point cannot be seen from there: behind, outside, edge-on, or at a scale that no level
  // fits. source is the keyframe that point.source_keyframe names.
  // place: homogeneous, where it is taken to be in the map; point_in_camera is then as homogeneous.
  std::optional<PredictedPoint> Predict(const MapPoint& point, const KeyFrame& source,
                                        const CameraModel& camera, const Rigid3& camera_from_map,
                                        const Eigen::Vector4d& place);
  std::optional<PredictedPoint> Predict(const MapPoint& point, const KeyFrame& source,
                                        const CameraModel& camera, const Rigid3& camera_from_map) {
    return Predict(point, source, camera, camera_from_map, point.point_in_map);
  }

  // The same for another pose of the camera: what does not depend on it is kept. False where Predict is
  // empty.
  bool Repredict(const MapPoint& point, const CameraModel& camera, const Rigid3& camera_from_map,
                 const Eigen::Vector4d& place, PredictedPoint* predicted) const;

  // Appearance for the point within radius_px (level 0) of its prediction: at the corners there, and, where
  // allowed, by alignment from the predicted place itself.
  std::optional<FoundPoint> Find(const MapPoint& point, const KeyFrame& source,
                                 const PredictedPoint& predicted, const ImageFeatures& features,
                                 float radius_px, bool direct);

 private:
  // What stays the same from frame to frame.
  struct Cached {
    MapPointId id = kNoId;
    // The mapper's trial points share ids, so that the id alone does not say whose patch this is.
    KeyFrameId source_keyframe = kNoId;
    std::uint8_t source_level = 0;
    Eigen::Vector2f source_pixel = Eigen::Vector2f::Zero();
    bool has_rays = false, has_patch = false;
    int level = -1;
    int patch = -1;                            // its place in patches_, once it had one
    Eigen::Vector3f ray, ray_right, ray_down;  // in the source camera, of the source pixel and its neighbours
    Eigen::Matrix2f pixel_from_source;         // that the patch was cut for
  };
  Cached& Entry(const MapPoint& point);
  // Pixel, Jacobian and place before the camera; rotation: of camera_from_map.
  bool FindPlace(const MapPoint& point, const CameraModel& camera, const Eigen::Matrix3d& rotation,
                 const Rigid3& camera_from_map, const Eigen::Vector4d& place,
                 PredictedPoint* predicted) const;
  bool FindSteps(const MapPoint& point, const KeyFrame& source, const Eigen::Vector4d& place,
                 PredictedPoint* predicted);
  static bool FindWarp(const Eigen::Matrix3d& rotation, PredictedPoint* predicted);
  bool PreparePatch(const MapPoint& point, const KeyFrame& source, const PredictedPoint& predicted,
                    Cached* entry);
  PatchTemplate& PatchOf(Cached* entry);

  SearchOptions options_;
  PatchComparison comparison_ = PatchComparison::kStandard;
  std::vector<Cached> cache_;  // direct mapped: slot id % size
  // Most points that are predicted are never looked for, and a patch is large: room for all is reserved, but
  // touched only as patches come.
  std::vector<PatchTemplate> patches_;
};

}  // namespace docent::engine
