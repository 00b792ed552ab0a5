// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <iosfwd>
#include <optional>
#include <string>

namespace docent::engine {

enum class LensModel {
  kRadialTangential,  // k1 k2 p1 p2 k3, Brown 1966 as OpenCV's pinhole model
  kFov,               // omega, Devernay and Faugeras 2001
  kKannalaBrandt,     // k1 k2 k3 k4, Kannala and Brandt 2006 as OpenCV's fisheye model
};

// A calibrated camera: what pixel a ray falls on, and back. An immutable value; safe to share across threads.
// Camera frame x right, y down, z forward; the centre of the top-left pixel is (0, 0). A point projects only
// where the lens is one-to-one: outside the largest angle at which the distortion still grows with the angle
// (worked out once at construction) Project answers empty, so that no point folds back into the image.
class CameraModel {
 public:
  struct Intrinsics {
    int width_px = 0, height_px = 0;
    double fx = 0, fy = 0, cx = 0, cy = 0;  // pixels
  };

  // A pinhole of 1x1 pixel, to be assigned over.
  CameraModel();
  // distortion: k1 k2 p1 p2 k3 | omega | k1 k2 k3 k4, unused entries zero. The caller has checked that sizes
  // and focal lengths are positive and all numbers finite (see Validate).
  CameraModel(LensModel lens, const Intrinsics& intrinsics, const std::array<double, 5>& distortion);

  // A sentence that says what is wrong with these numbers, or empty when they make a camera.
  static std::optional<std::string> Validate(LensModel lens, const Intrinsics& intrinsics,
                                             const std::array<double, 5>& distortion);

  // Pixel of a point in the camera frame (any scale; for w = 0 pass the direction). Empty behind the camera
  // (for the first two lenses) or where the lens is not one-to-one. The pixel may lie outside the image.
  std::optional<Eigen::Vector2d> Project(const Eigen::Vector3d& point_in_camera) const;
  // The same with the Jacobian d pixel / d point, 2x3, pixels a metre.
  bool Project(const Eigen::Vector3d& point_in_camera, Eigen::Vector2d* pixel,
               Eigen::Matrix<double, 2, 3>* jacobian) const;
  // Unit-length ray of a pixel, in the camera frame. Closed form or a checked Newton iteration: empty where
  // no ray of the one-to-one range falls on the pixel.
  std::optional<Eigen::Vector3d> Unproject(const Eigen::Vector2d& pixel) const;

  // Whether a pixel lies in the image, at least margin_px inside its border.
  bool IsInside(const Eigen::Vector2d& pixel, double margin_px = 0) const {
    return pixel.x() >= margin_px && pixel.y() >= margin_px &&
           pixel.x() <= intrinsics_.width_px - 1 - margin_px &&
           pixel.y() <= intrinsics_.height_px - 1 - margin_px;
  }

  LensModel lens() const { return lens_; }
  const Intrinsics& intrinsics() const { return intrinsics_; }
  const std::array<double, 5>& distortion() const { return distortion_; }
  int width_px() const { return intrinsics_.width_px; }
  int height_px() const { return intrinsics_.height_px; }
  // Angle between the optical axis and the most oblique ray that projects, radians.
  double max_angle() const { return max_angle_; }
  // Angle that one pixel covers at the middle of the image, radians: 1 / mean focal length.
  double PixelAngle() const { return 2.0 / (intrinsics_.fx + intrinsics_.fy); }

  bool operator==(const CameraModel& other) const;

 private:
  // A point of the image in focal lengths from the principal point, and its derivatives by the point in the
  // camera frame: xz is d x / d z. That of y by x is xy too.
  struct ImagePoint {
    double x, y, xx, xy, yy, xz, yz;
  };
  bool ProjectThroughPlane(const Eigen::Vector3d& point, bool with_jacobian, ImagePoint* result) const;
  bool ProjectByAngle(const Eigen::Vector3d& point, ImagePoint* result) const;

  LensModel lens_ = LensModel::kRadialTangential;
  Intrinsics intrinsics_;
  std::array<double, 5> distortion_{};
  double max_angle_ = 0;           // radians
  double max_radius_squared_ = 0;  // (tan of max_angle_)^2, for the first two lenses
  double max_image_radius_ = 0;  // largest distorted radius, in focal lengths, without tangential distortion
  double fov_scale_ = 1;         // 2 tan(omega / 2) / omega
};

std::ostream& operator<<(std::ostream& out, const CameraModel& camera);

}  // namespace docent::engine
