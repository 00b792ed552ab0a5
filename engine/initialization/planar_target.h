// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "engine/geometry/camera_model.h"
#include "engine/geometry/rigid3.h"
#include "engine/vision/descriptor.h"
#include "engine/vision/image_pyramid.h"

namespace docent::engine {

struct PlanarTargetOptions {
  int model_size_px = 480;          // longer side to which the image is reduced
  CornerDescriptionOptions corners  // of the frame, for detection
      = {.corners = {300, 200, 120, 60}, .min_score = 20};
  int max_distance = 60000;        // largest squared distance of matched descriptors
  double max_ratio = 0.64;         // of squared distances: best to best elsewhere on the target
  int min_matches = 7;             // that agree with a pose, before alignment is tried
  double consensus_px = 4;         // RANSAC; corners of coarse levels are off by this much
  int max_points_per_stage = 120;  // points aligned per pyramid level, at most
  float min_correlation = 0.75f;   // of an aligned patch, normalized
  double aligned_px = 2.0;         // residual below which an aligned point is an inlier, level 0
  int min_inliers = 20;            // of aligned points
  double min_inlier_ratio = 0.4;   // of the points that project into the frame

  // Describes the first invalid option in one sentence, or empty.
  std::optional<std::string> Validate() const;
};

// The detection of a target in one frame.
struct TargetDetection {
  struct Point {
    std::uint32_t id = 0;  // of the target's point: the same in every frame
    Eigen::Vector3d point_in_target = Eigen::Vector3d::Zero();
    Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  // level 0
  };
  Rigid3 camera_from_target;  // metres
  std::vector<Point> points;  // inliers, by ascending id
  int searched = 0;           // points that were searched
  double rms_px = 0;          // of the inliers' residuals
};

// A printed image of known width that gives a camera its pose in metres (hybrid-slam §5.5). It is detected by
// descriptors without any prior, then aligned patch by patch. Target frame: origin in the image's centre, x
// right, y down in the plane, z away from the viewer. The patches are warped with the pose, so that scale and
// slant cost no accuracy. Immutable; safe to share across threads.
class PlanarTarget {
 public:
  // gray: CV_8UC1. Throws docent::Error with one sentence if the image is too small (64 pixels on a side),
  // has too few features, or the width is not positive.
  PlanarTarget(const cv::Mat& gray, double width_m, const PlanarTargetOptions& options = {});

  double width_m() const { return width_m_; }
  double height_m() const { return height_m_; }

  // Detects the target anywhere in a frame. Works mostly where it is seen at an angle of up to about 50
  // degrees and is at least 150 pixels wide. Takes some milliseconds; deterministic under the seed. Empty if
  // it is not found.
  std::optional<TargetDetection> Detect(const ImageFeatures& features, const CameraModel& camera,
                                        std::uint64_t seed) const;
  // Aligns the target near a pose whose projection is off by at most about ten pixels of the frame. Empty if
  // it is not found there.
  std::optional<TargetDetection> Align(const ImageFeatures& features, const CameraModel& camera,
                                       const Rigid3& camera_from_target) const;

 private:
  static constexpr std::size_t kModelLevels = 5;
  struct ModelPoint {
    std::uint32_t id = 0;
    Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  // of model level 0
  };
  // The descriptor of a point of the target in one synthetic view.
  struct ModelDescriptor {
    Descriptor descriptor;
    Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  // of model level 0
    float direction_rad = 0;                          // of its gradient, in the model
  };
  struct DescriptorMatch {
    Eigen::Vector2d pixel, model_pixel;
    float rotation_rad = 0;  // rotation in the image from the model to the frame
  };
  struct PatchMatch;

  void MakePoints();
  void DescribeView(double scale, double shortening, double shortening_rad);
  std::vector<DescriptorMatch> MatchDescriptors(const ImageFeatures& features) const;
  Eigen::Vector3d InTarget(const Eigen::Vector2d& model_pixel) const;
  std::vector<PatchMatch> AlignPoints(const ImageFeatures& features, const CameraModel& camera,
                                      const Rigid3& camera_from_target, int level, float max_shift_px,
                                      int* searched) const;

  PlanarTargetOptions options_;
  double width_m_ = 0, height_m_ = 0;
  std::array<cv::Mat, kModelLevels> levels_;
  std::array<std::vector<ModelPoint>, kModelLevels>
      points_;  // by the level on which they are corners, best first
  std::vector<ModelDescriptor> descriptors_;
  std::vector<std::vector<std::uint32_t>> leaves_;  // indices of descriptors, by vocabulary leaf
};

}  // namespace docent::engine
