// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <iosfwd>
#include <memory>
#include <optional>
#include <string>

namespace docent::engine {

struct PlainVector3;
struct ProjectionBatch;

// How a lens distorts, with the meaning of CameraModel::distortion.
enum class LensModel {
  kRadialTangential,  // k1 k2 p1 p2 k3, Brown 1966 as OpenCV's pinhole model
  kFov,               // omega, Devernay and Faugeras 2001
  kKannalaBrandt,     // k1 k2 k3 k4, Kannala and Brandt 2006 as OpenCV's fisheye model
};

// How the camera rotated while a rolling shutter exposed one image. A pixel is exposed readout_s . (pixel /
// size - (1/2, 1/2)) seconds after the middle of the image, to which the pose and the time of the image
// refer.
struct ReadoutMotion {
  // Angular velocity on the left: camera_from_map(t) = Exp(t rotation_rate) camera_from_map(0), radians per
  // second.
  Eigen::Vector3d rotation_rate = Eigen::Vector3d::Zero();
  // Seconds from the exposure of the first column, and of the first row, to that of the last; negative if the
  // last is exposed first.
  Eigen::Vector2d readout_s = Eigen::Vector2d::Zero();
  // Whether all numbers are equal.
  bool operator==(const ReadoutMotion& other) const {
    return rotation_rate == other.rotation_rate && readout_s == other.readout_s;
  }
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

  // The model of one image of a rolling shutter: Project and Unproject account for the rotation, unless it
  // moves no pixel by more than a tenth. lens: the camera, or the model of another of its images.
  static CameraModel WithReadout(const std::shared_ptr<const CameraModel>& lens, const ReadoutMotion& motion);

  // This camera with the readout time of its shutter, as in ReadoutMotion; zero for a global shutter. The
  // engine estimates the readout time of a camera for which none is known.
  CameraModel WithKnownReadout(const Eigen::Vector2d& readout_s) const;

  // The model of an image with the rotation of another one, if that has any: `lens` itself otherwise.
  static std::shared_ptr<const CameraModel> WithMotionOf(const CameraModel& image,
                                                         const std::shared_ptr<const CameraModel>& lens);

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
  // The same for a point that was measured at a pixel: it is projected as it was exposed there. Cheaper than
  // Project for an image of a rolling shutter, and equal to it where the point is.
  bool ProjectAtExposureOf(const Eigen::Vector2d& measured, const Eigen::Vector3d& point_in_camera,
                           Eigen::Vector2d* pixel, Eigen::Matrix<double, 2, 3>* jacobian) const;
  // The same, to the bit, for many points at once; with the Brown model in vector registers.
  void ProjectAtExposureOf(ProjectionBatch* batch) const;
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

  // Zero for the camera itself.
  const ReadoutMotion& readout_motion() const { return readout_; }
  // What WithKnownReadout set, seconds; empty if the readout time of the camera is not known.
  const std::optional<Eigen::Vector2d>& known_readout_s() const { return known_readout_s_; }
  // The camera of which this is the model of one image; empty if this is not the model of an image.
  const std::shared_ptr<const CameraModel>& lens_of_image() const { return lens_of_image_; }
  // The camera of which this is the model of one image, or this model itself.
  const CameraModel& WithoutMotion() const { return lens_of_image_ ? *lens_of_image_ : *this; }
  // Where a pixel lies between the first and the last column, and row: from -1/2 to 1/2. Its scalar product
  // with readout_s is the delay of its exposure.
  Eigen::Vector2d ReadoutPosition(const Eigen::Vector2d& pixel) const {
    return {(pixel.x() + 0.5) / intrinsics_.width_px - 0.5, (pixel.y() + 0.5) / intrinsics_.height_px - 0.5};
  }
  // A point in the camera frame of the moment at which a pixel was exposed. point: in that of the middle of
  // the image.
  Eigen::Vector3d AtExposureOf(const Eigen::Vector2d& pixel, const Eigen::Vector3d& point) const;
  // Whether lens, size and calibration are equal, whatever the rotation.
  bool HasSameLens(const CameraModel& other) const;

  // Whether all numbers that have an effect are equal.
  bool operator==(const CameraModel& other) const;

 private:
  // A point on the image plane in focal lengths from the principal point, and its derivatives with respect to
  // the point in the camera frame: xz is d x / d z. dy/dx equals xy.
  struct ImagePoint {
    double x, y, xx, xy, yy, xz, yz;
  };
  bool ProjectLens(const Eigen::Vector3d& point, Eigen::Vector2d* pixel,
                   Eigen::Matrix<double, 2, 3>* jacobian) const;
  std::optional<Eigen::Vector3d> UnprojectLens(const Eigen::Vector2d& pixel) const;
  struct LensProjection;
  bool ProjectThroughLens(const PlainVector3& point, bool with_jacobian, LensProjection* result) const;
  bool ProjectThroughPlane(const PlainVector3& point, bool with_jacobian, ImagePoint* result) const;
  bool ProjectByAngle(const PlainVector3& point, ImagePoint* result) const;
  template <bool rotates>
  void ProjectThroughBrownLens(ProjectionBatch* batch) const;
  // Time from the middle of the image to the exposure of a pixel, seconds.
  double ExposureDelay(double x, double y) const;

  LensModel lens_ = LensModel::kRadialTangential;
  Intrinsics intrinsics_;
  std::array<double, 5> distortion_{};
  std::shared_ptr<const CameraModel> lens_of_image_;
  std::optional<Eigen::Vector2d> known_readout_s_;
  ReadoutMotion readout_;
  bool rotates_ = false;           // whether readout_ has an effect
  double max_angle_ = 0;           // radians
  double max_radius_squared_ = 0;  // (tan of max_angle_)^2, for the first two lens models
  double max_image_radius_ = 0;  // largest distorted radius, in focal lengths, without tangential distortion
  double fov_scale_ = 1;         // 2 tan(omega / 2) / omega
};

// For messages and tests.
std::ostream& operator<<(std::ostream& out, const CameraModel& camera);

}  // namespace docent::engine
