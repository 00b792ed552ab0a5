// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <iosfwd>
#include <optional>
#include <string>

namespace docent::engine {

// How a lens distorts, with the meaning of CameraModel::distortion.
enum class LensModel {
  kRadialTangential,  // k1 k2 p1 p2 k3, Brown 1966 as OpenCV's pinhole model
  kFov,               // omega, Devernay and Faugeras 2001
  kKannalaBrandt,     // k1 k2 k3 k4, Kannala and Brandt 2006 as OpenCV's fisheye model
};

// A calibrated camera: projects points to pixels and unprojects pixels to rays. An immutable value; safe to
// share across threads. Camera frame: x right, y down, z forward; the centre of the top-left pixel is (0, 0).
// A point projects only where the lens model is one-to-one. Beyond the largest angle up to which the
// distorted radius grows with the angle (computed once at construction), Project returns empty, so that no
// point folds back into the image.
class CameraModel {
 public:
  // Size of the image, focal lengths and principal point.
  struct Intrinsics {
    int width_px = 0, height_px = 0;        // pixels
    double fx = 0, fy = 0, cx = 0, cy = 0;  // pixels
  };

  // A pinhole camera of 1x1 pixel, as a placeholder.
  CameraModel();
  // distortion: k1 k2 p1 p2 k3 | omega | k1 k2 k3 k4, unused entries zero. Precondition: sizes and focal
  // lengths are positive and all numbers are finite (see Validate).
  CameraModel(LensModel lens, const Intrinsics& intrinsics, const std::array<double, 5>& distortion);

  // A sentence that says what is wrong with these numbers; empty if they are valid.
  static std::optional<std::string> Validate(LensModel lens, const Intrinsics& intrinsics,
                                             const std::array<double, 5>& distortion);

  // Pixel of a point in the camera frame (any scale; for w = 0 pass the direction). Empty if the point is
  // behind the camera (first two lens models) or where the lens model is not one-to-one. The pixel may lie
  // outside the image.
  std::optional<Eigen::Vector2d> Project(const Eigen::Vector3d& point_in_camera) const;
  // The same with the Jacobian d pixel / d point, 2x3, in pixels per length unit of the point.
  bool Project(const Eigen::Vector3d& point_in_camera, Eigen::Vector2d* pixel,
               Eigen::Matrix<double, 2, 3>* jacobian) const;
  // Unit-length ray of a pixel in the camera frame, in closed form or by a checked Newton iteration. Empty if
  // no ray of the one-to-one range projects to the pixel.
  std::optional<Eigen::Vector3d> Unproject(const Eigen::Vector2d& pixel) const;

  // Whether a pixel lies in the image, at least margin_px inside its border.
  bool IsInside(const Eigen::Vector2d& pixel, double margin_px = 0) const {
    return pixel.x() >= margin_px && pixel.y() >= margin_px &&
           pixel.x() <= intrinsics_.width_px - 1 - margin_px &&
           pixel.y() <= intrinsics_.height_px - 1 - margin_px;
  }

  LensModel lens() const { return lens_; }                      // the meaning of distortion()
  const Intrinsics& intrinsics() const { return intrinsics_; }  // pixels
  // k1 k2 p1 p2 k3 | omega | k1 k2 k3 k4, unused entries zero.
  const std::array<double, 5>& distortion() const { return distortion_; }
  int width_px() const { return intrinsics_.width_px; }    // of the image
  int height_px() const { return intrinsics_.height_px; }  // of the image
  // Angle between the optical axis and the most oblique ray that projects, radians.
  double max_angle() const { return max_angle_; }
  // Angle of one pixel at the image centre, radians: 1 / mean focal length.
  double PixelAngle() const { return 2.0 / (intrinsics_.fx + intrinsics_.fy); }

  // Whether all numbers are equal.
  bool operator==(const CameraModel& other) const;

 private:
  // A point on the image plane in focal lengths from the principal point, and its derivatives with respect to
  // the point in the camera frame: xz is d x / d z. dy/dx equals xy.
  struct ImagePoint {
    double x, y, xx, xy, yy, xz, yz;
  };
  bool ProjectThroughPlane(const Eigen::Vector3d& point, bool with_jacobian, ImagePoint* result) const;
  bool ProjectByAngle(const Eigen::Vector3d& point, ImagePoint* result) const;

  LensModel lens_ = LensModel::kRadialTangential;
  Intrinsics intrinsics_;
  std::array<double, 5> distortion_{};
  double max_angle_ = 0;           // radians
  double max_radius_squared_ = 0;  // (tan of max_angle_)^2, for the first two lens models
  double max_image_radius_ = 0;  // largest distorted radius, in focal lengths, without tangential distortion
  double fov_scale_ = 1;         // 2 tan(omega / 2) / omega
};

// For messages and tests.
std::ostream& operator<<(std::ostream& out, const CameraModel& camera);

}  // namespace docent::engine
