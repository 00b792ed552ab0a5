// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <optional>

#include "engine/geometry/camera_model.h"
#include "engine/geometry/rigid3.h"

namespace docent::engine {

// A picture's thumbnail for recognising places and for estimating rotation between neighbours: subsampled
// and blurred, mean removed (ptamm §3.2). `pixels` is CV_32FC1, at most 80 wide; `scale` is picture pixels a
// thumbnail pixel.
struct SmallBlurryImage {
  cv::Mat pixels;
  int scale = 8;
};

// gray: CV_8UC1. blur_sigma_px is in thumbnail pixels.
inline constexpr double kThumbnailBlurPx = 2.5;
SmallBlurryImage MakeSmallBlurryImage(const cv::Mat& gray, double blur_sigma_px = kThumbnailBlurPx);
// The same into *result, whose memory is used again when nobody else holds it.
void MakeSmallBlurryImage(const cv::Mat& gray, double blur_sigma_px, SmallBlurryImage* result);

// Mean squared difference of two thumbnails of equal size, zero-mean (grey values squared); infinite when
// the sizes differ.
double Difference(const SmallBlurryImage& a, const SmallBlurryImage& b);

// The camera rotation b_from_a between two pictures of one camera that lie near each other, by efficient
// second-order minimisation over SO(3) through the lens model (ESM, Benhimane and Malis 2007; ptamm §3.2).
struct RotationAlignment {
  Rotation3 b_from_a;
  double rms = 0;      // grey values, after alignment, over the overlap
  double overlap = 0;  // fraction of thumbnail pixels that fall inside the other
  bool converged = false;
};
// camera_a, camera_b: models of the full pictures. initial: b_from_a to start from. pivot: what the camera
// turned about, camera frame, in units of the distance of what it sees; zero: its own centre. Empty when the
// overlap falls below a quarter.
std::optional<RotationAlignment> AlignRotation(const SmallBlurryImage& a, const CameraModel& camera_a,
                                               const SmallBlurryImage& b, const CameraModel& camera_b,
                                               const Rotation3& initial = {}, int max_iterations = 10,
                                               const Eigen::Vector3d& pivot = Eigen::Vector3d::Zero());

}  // namespace docent::engine
