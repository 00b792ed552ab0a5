// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/option_check.h"
#include "engine/geometry/camera_model.h"
#include "engine/geometry/rigid3.h"
#include "engine/map/map_snapshot.h"
#include "engine/vision/patch.h"

// Guided search (ptamm §2.1): the patch of a map point is warped to the present view and searched near the
// pixel where the point projects. The tracker uses it for every frame, the mapper for guided matching in
// existing keyframes. Not thread safe: each thread owns a searcher.
namespace docent::engine {

struct SearchOptions {
  float min_corner_correlation = 0.60f;  // minimum to attempt the alignment
  float min_correlation = 0.75f;         // minimum after alignment at a keypoint
  float min_direct_correlation = 0.82f;  // higher, because without a keypoint a match is less reliable
  float max_direct_shift_px = 2.5f;      // pixels of the search level
  double min_view_cosine = 0.34;         // about 70 degrees between surface normal and line of sight

  // Describes the first invalid option in one sentence, or empty.
  std::optional<std::string> Validate() const;
};

// Predicted appearance of a point in the image.
struct PredictedPoint {
  Eigen::Vector3d point_in_camera;
  Eigen::Vector2d pixel;                 // level 0
  Eigen::Matrix<double, 2, 3> jacobian;  // d pixel / d point_in_camera
  Eigen::Matrix2f pixel_from_source;     // level-0 pixels per pixel of the source level
  // Displacement on the surface, in the map, of one pixel to the right and one pixel down on the source
  // level.
  Eigen::Matrix<double, 3, 2> steps_in_map;
  int level = 0;  // the level on which the patch has about its original size
};

struct FoundPoint {
  Eigen::Vector2f pixel;  // level 0
  float correlation = 0;
};

enum class PatchComparison : std::uint8_t {
  kStandard,
  kTolerant  // for images that may differ in exposure or sharpness; see AlignPatchTolerantly
};

class PointSearcher {
 public:
  explicit PointSearcher(const SearchOptions& options = {}) : options_(Checked(options)) {}

  // Selects how patches are compared from now on; kStandard initially.
  void SetComparison(PatchComparison comparison) { comparison_ = comparison; }
  PatchComparison comparison() const { return comparison_; }

  // Discards all patches. To be called before another map is searched.
  void Clear();
  // Discards all patches and frees their memory.
  void Release();

  // Empty if the point is not visible from there: behind the camera, outside the image, seen edge-on, or at a
  // scale that no pyramid level matches. source: the keyframe named by point.source_keyframe. point_in_map:
  // homogeneous position to assume instead of the point's own; point_in_camera has the same fourth
  // coordinate.
  std::optional<PredictedPoint> Predict(const MapPoint& point, const KeyFrame& source,
                                        const CameraModel& camera, const Rigid3& camera_from_map,
                                        const Eigen::Vector4d& point_in_map);
  std::optional<PredictedPoint> Predict(const MapPoint& point, const KeyFrame& source,
                                        const CameraModel& camera, const Rigid3& camera_from_map) {
    return Predict(point, source, camera, camera_from_map, point.point_in_map);
  }

  // The prediction for another camera pose; reuses what does not depend on the pose. False where Predict
  // returns empty.
  bool Repredict(const MapPoint& point, const CameraModel& camera, const Rigid3& camera_from_map,
                 const Eigen::Vector4d& point_in_map, PredictedPoint* predicted) const;

  // Searches the point within radius_px (level-0 pixels) of its prediction: at the keypoints there and, if
  // `direct` is true, by alignment from the predicted pixel itself.
  std::optional<FoundPoint> Find(const MapPoint& point, const KeyFrame& source,
                                 const PredictedPoint& predicted, const ImageFeatures& features,
                                 float radius_px, bool direct);

 private:
  // Data that stay the same from frame to frame.
  struct Cached {
    MapPointId id = kNoId;
    // The mapper's trial points share ids, so the id alone does not identify the patch.
    KeyFrameId source_keyframe = kNoId;
    std::uint8_t source_level = 0;
    Eigen::Vector2f source_pixel = Eigen::Vector2f::Zero();
    bool has_rays = false, has_patch = false;
    int level = -1;
    int patch = -1;  // index in patches_, -1 before the first patch
    // In the source camera: of the source pixel and of its right and lower neighbour.
    Eigen::Vector3f ray, ray_right, ray_down;
    Eigen::Matrix2f pixel_from_source;  // warp that the patch was sampled with
  };
  Cached& Entry(const MapPoint& point);
  // Computes pixel, Jacobian and camera coordinates. rotation: that of camera_from_map as a matrix.
  bool ProjectPoint(const MapPoint& point, const CameraModel& camera, const Eigen::Matrix3d& rotation,
                    const Rigid3& camera_from_map, const Eigen::Vector4d& point_in_map,
                    PredictedPoint* predicted) const;
  bool ComputeSurfaceSteps(const MapPoint& point, const KeyFrame& source, const Eigen::Vector4d& point_in_map,
                           PredictedPoint* predicted);
  static bool ComputeWarp(const Eigen::Matrix3d& rotation, PredictedPoint* predicted);
  bool PreparePatch(const MapPoint& point, const KeyFrame& source, const PredictedPoint& predicted,
                    Cached* entry);
  PatchTemplate& PatchOf(Cached* entry);

  SearchOptions options_;
  PatchComparison comparison_ = PatchComparison::kStandard;
  std::vector<Cached> cache_;  // direct-mapped cache: slot id % size
  // Most predicted points are never searched, and a patch is large: memory for all is reserved but only
  // touched as patches are added.
  std::vector<PatchTemplate> patches_;
};

}  // namespace docent::engine
