// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>

#include "engine/geometry/camera_model.h"
#include "engine/geometry/rigid3.h"
#include "engine/vision/small_blurry_image.h"

namespace docent::engine {

// The camera rotation b_from_a between two images with similar viewing directions, estimated by efficient
// second-order minimization over SO(3) through the lens model (ESM, Benhimane and Malis 2007; ptamm §3.2).
struct RotationAlignment {
  Rotation3 b_from_a;
  double rms = 0;      // grey values, after alignment, over the overlap
  double overlap = 0;  // ratio of the thumbnail's pixels that project into the other thumbnail
  bool converged = false;
};
// camera_a, camera_b: models of the full images. initial: b_from_a to start from. pivot: centre of the
// rotation in the camera frame, as a ratio of the scene depth; zero for the camera centre. Empty if the
// overlap falls below a quarter.
std::optional<RotationAlignment> AlignRotation(const SmallBlurryImage& a, const CameraModel& camera_a,
                                               const SmallBlurryImage& b, const CameraModel& camera_b,
                                               const Rotation3& initial = {}, int max_iterations = 10,
                                               const Eigen::Vector3d& pivot = Eigen::Vector3d::Zero());

}  // namespace docent::engine
