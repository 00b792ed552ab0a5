// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "engine/geometry/camera_model.h"
#include "engine/geometry/rigid3.h"
#include "engine/vision/descriptor.h"
#include "engine/vision/image_pyramid.h"

namespace docent::engine {

struct PlanarTargetOptions {
  int model_size_px = 480;          // longer side that the image is reduced to
  CornerDescriptionOptions corners  // of the frame, for detection
      = {.corners = {300, 200, 120, 60}, .min_score = 20};
  int max_distance = 60000;  // squared, of matched descriptors
  double max_ratio = 0.64;   // of squared distances, against the best one elsewhere on the target
  int min_matches = 7;       // that agree on a pose, before alignment is asked
  double consensus_px = 4;   // corners of coarse levels lie this far off
  int points_a_stage = 120;  // aligned at most
  float min_correlation = 0.75f;
  double aligned_px = 2.0;        // residual at which an aligned point counts as inlier
  int min_inliers = 20;           // of aligned points
  double min_inlier_ratio = 0.4;  // of the points that should be seen
};

// Where the target was found in one frame.
struct TargetDetection {
  struct Point {
    std::uint32_t id = 0;  // of the target's point: the same in every frame
    Eigen::Vector3d point_in_target = Eigen::Vector3d::Zero();
    Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  // level 0
  };
  Rigid3 camera_from_target;  // metres
  std::vector<Point> points;  // that agree with the pose, by ascending id
  int looked_for = 0;         // points that should have been there
  double rms_px = 0;          // of `points`
};

// A printed image of known width that tells a camera where it is, in metres (hybrid-slam §5.5): found by
// descriptors without any prior, then aligned patch by patch. Target frame: origin in the image's middle, x
// right, y down in the plane, z away from the viewer. The patches follow the pose, so that scale and slant
// cost no accuracy. Immutable; safe to share across threads.
class PlanarTarget {
 public:
  // gray: CV_8UC1. Throws docent::Error with one sentence where the image is too small (64 pixels on a
  // side) or shows too little to be found by, or the width is no positive length.
  PlanarTarget(const cv::Mat& gray, double width_m, const PlanarTargetOptions& options = {});

  double width_m() const { return width_m_; }
  double height_m() const { return height_m_; }

  // Finds the target anywhere in a frame, most often where it is seen up to about 50 degrees aslant and is at
  // least 150 pixels wide. Some milliseconds; deterministic under the seed. Empty where it is not seen.
  std::optional<TargetDetection> Detect(const ImageFeatures& features, const CameraModel& camera,
                                        std::uint64_t seed) const;
  // The target near a pose that is right to within about ten pixels of the frame. Empty where it is not
  // there.
  std::optional<TargetDetection> Align(const ImageFeatures& features, const CameraModel& camera,
                                       const Rigid3& camera_from_target) const;

 private:
  static constexpr std::size_t kModelLevels = 5;
  struct ModelPoint {
    std::uint32_t id = 0;
    Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  // of model level 0
  };
  // The descriptor of a place of the target as some view shows it.
  struct ModelDescriptor {
    Descriptor descriptor;
    Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  // of model level 0
    float direction_rad = 0;                          // of its gradient, in the model
  };
  struct DescriptorMatch {
    Eigen::Vector2d pixel, model_pixel;
    float turn_rad = 0;  // from the model to the frame
  };
  struct PatchMatch;

  void MakePoints();
  void DescribeView(double scale, double squeeze, double squeeze_rad);
  std::vector<DescriptorMatch> MatchDescriptors(const ImageFeatures& features) const;
  Eigen::Vector3d InTarget(const Eigen::Vector2d& model_pixel) const;
  std::vector<PatchMatch> AlignPoints(const ImageFeatures& features, const CameraModel& camera,
                                      const Rigid3& camera_from_target, int level, float max_shift_px,
                                      int* looked_for) const;

  PlanarTargetOptions options_;
  double width_m_ = 0, height_m_ = 0;
  std::array<cv::Mat, kModelLevels> levels_;
  std::array<std::vector<ModelPoint>, kModelLevels> points_;  // by the level they are corners of, best first
  std::vector<ModelDescriptor> descriptors_;
  std::vector<std::vector<std::uint32_t>> leaves_;  // indices of descriptors, by vocabulary leaf
};

}  // namespace docent::engine
