// SPDX-License-Identifier: Apache-2.0
#include "engine/geometry/camera_model.h"

#include <cmath>
#include <numbers>
#include <ostream>
#include <sstream>

#include "engine/geometry/lens_distortion.h"
#include "engine/geometry/plain_vector3.h"
#include "engine/geometry/projection_batch.h"

namespace docent::engine {
namespace {

// A rotation by a rotation vector, to second order: of 0.05 radians, wrong by 0.00002.
inline PlainVector3 SmallRotation(const PlainVector3& rotation, const PlainVector3& point) {
  const PlainVector3 first = Cross(rotation, point);
  return point + first + Cross(rotation, first) * 0.5;
}

inline Eigen::Vector3d SmallRotation(const Eigen::Vector3d& rotation, const Eigen::Vector3d& point) {
  const PlainVector3 result = SmallRotation(PlainVector3(rotation), PlainVector3(point));
  return {result.x, result.y, result.z};
}

const char* Name(LensModel lens) {
  switch (lens) {
    case LensModel::kRadialTangential:
      return "radial-tangential";
    case LensModel::kFov:
      return "FOV";
    case LensModel::kKannalaBrandt:
      return "Kannala-Brandt";
  }
  return "unknown";
}

std::string Sentence(const char* what, double value, const char* should) {
  std::ostringstream text;
  text << what << " is " << value << " but must be " << should << ".";
  return text.str();
}

std::optional<std::string> ComplainAboutDistortion(LensModel lens, const std::array<double, 5>& distortion) {
  const std::size_t used = lens == LensModel::kRadialTangential ? 5 : lens == LensModel::kFov ? 1 : 4;
  for (std::size_t i = 0; i < distortion.size(); ++i) {
    const std::string what =
        "Distortion coefficient " + std::to_string(i + 1) + " of the " + Name(lens) + " lens";
    if (!(std::abs(distortion[i]) <= 1e4)) {
      return Sentence(what.c_str(), distortion[i], "a finite number of moderate size");
    }
    if (i >= used && distortion[i] != 0) {
      return Sentence(what.c_str(), distortion[i], "zero, because this lens does not use it");
    }
  }
  if (lens == LensModel::kFov && !(distortion[0] >= 0 && distortion[0] < std::numbers::pi)) {
    return Sentence("The FOV lens's omega", distortion[0], "at least 0 and less than pi radians");
  }
  return std::nullopt;
}

}  // namespace

// A pixel, and its derivatives with respect to the point in the camera frame.
struct CameraModel::LensProjection {
  double x, y;
  PlainVector3 x_by_point, y_by_point;
};

CameraModel::CameraModel() : CameraModel(LensModel::kRadialTangential, {1, 1, 1, 1, 0, 0}, {}) {}

CameraModel::CameraModel(LensModel lens, const Intrinsics& intrinsics,
                         const std::array<double, 5>& distortion)
    : lens_(lens), intrinsics_(intrinsics), distortion_(distortion) {
  double slope;
  switch (lens) {
    case LensModel::kRadialTangential: {
      const double radius = LargestBrownRadius(distortion);
      max_radius_squared_ = radius * radius;
      max_angle_ = std::atan(radius);
      max_image_radius_ = BrownRadius(distortion, radius, &slope);
      break;
    }
    case LensModel::kFov: {
      const double omega = distortion[0];
      max_radius_squared_ = kLargestPlaneRadius * kLargestPlaneRadius;
      max_angle_ = std::atan(kLargestPlaneRadius);
      fov_scale_ = TangentRatio(omega / 2);
      max_image_radius_ =
          kLargestPlaneRadius * fov_scale_ * ArcTangentRatio(kLargestPlaneRadius * fov_scale_ * omega);
      break;
    }
    case LensModel::kKannalaBrandt:
      max_angle_ = LargestKannalaBrandtAngle(distortion);
      max_image_radius_ = KannalaBrandtRadius(distortion, max_angle_, &slope);
      break;
  }
}

std::optional<std::string> CameraModel::Validate(LensModel lens, const Intrinsics& intrinsics,
                                                 const std::array<double, 5>& distortion) {
  const Intrinsics& in = intrinsics;
  for (const auto& [what, size] :
       {std::pair{"The image's width", in.width_px}, {"The image's height", in.height_px}}) {
    if (size < 1 || size > 65535) {
      return Sentence(what, size, "between 1 and 65535 pixels");
    }
  }
  for (const auto& [what, focal] :
       {std::pair{"The focal length fx", in.fx}, {"The focal length fy", in.fy}}) {
    // A view of 360 degrees across the image has 0.16 widths; no focal length is a thousand sensor widths.
    if (!(focal >= 0.01 * in.width_px && focal <= 1000.0 * in.width_px)) {
      return Sentence(what, focal, "between 0.01 and 1000 times the image's width in pixels");
    }
  }
  for (const auto& [what, center] :
       {std::pair{"The principal point cx", in.cx}, {"The principal point cy", in.cy}}) {
    if (!(std::abs(center) <= 1e6)) {
      return Sentence(what, center, "a finite number of pixels");
    }
  }
  if (auto complaint = ComplainAboutDistortion(lens, distortion)) {
    return complaint;
  }
  // A model that folds back within the image is a wrong calibration. A few pixels in the corners are
  // tolerated.
  constexpr int kGrid = 9;
  const CameraModel camera(lens, intrinsics, distortion);
  int without_ray = 0;
  for (int i = 0; i < kGrid * kGrid; ++i) {
    const Eigen::Vector2d pixel((i % kGrid + 0.5) / kGrid * in.width_px - 0.5,
                                (i / kGrid + 0.5) / kGrid * in.height_px - 0.5);
    without_ray += camera.Unproject(pixel) ? 0 : 1;
  }
  if (without_ray > kGrid * kGrid / 2) {
    return "The distortion of the " + std::string(Name(lens)) +
           " lens is invalid in more than half of the image: check the coefficients and their "
           "order.";
  }
  return std::nullopt;
}

// Projects through the plane z = 1, from which the Brown and FOV models map to the image with a symmetric
// Jacobian.
[[gnu::always_inline]] inline bool CameraModel::ProjectThroughPlane(const PlainVector3& point,
                                                                    bool with_jacobian,
                                                                    ImagePoint* result) const {
  const double z = point.z;
  const double radius_squared = point.x * point.x + point.y * point.y;
  if (!(z > 0) || !(radius_squared <= max_radius_squared_ * z * z)) {
    return false;
  }
  const double inverse_z = 1 / z;
  const double x = point.x * inverse_z, y = point.y * inverse_z;
  if (lens_ == LensModel::kRadialTangential) {
    BrownDistort(distortion_, x, y, result);
  } else {
    const double full = fov_scale_ * distortion_[0];
    const double scaled = std::sqrt(radius_squared) * inverse_z * full, squared = scaled * scaled;
    const double ratio = ArcTangentRatio(scaled), scale = fov_scale_ * ratio;
    // (1 / (1 + s^2) - atan(s) / s) / s^2 tends to -2/3.
    const double shape = squared < 1e-6 ? -2.0 / 3 : (1 / (1 + squared) - ratio) / squared;
    const double curvature = fov_scale_ * full * full * shape;
    *result = {scale * x, scale * y, scale + curvature * x * x, curvature * x * y, scale + curvature * y * y,
               0,         0};
  }
  if (with_jacobian) {
    result->xx *= inverse_z;
    result->xy *= inverse_z;
    result->yy *= inverse_z;
    result->xz = -(result->xx * x + result->xy * y);
    result->yz = -(result->xy * x + result->yy * y);
  }
  return true;
}

// Projects through the angle from the axis, with the Kannala-Brandt model, also beyond 90 degrees.
bool CameraModel::ProjectByAngle(const PlainVector3& point, ImagePoint* result) const {
  const double x = point.x, y = point.y, z = point.z;
  const double radius_squared = x * x + y * y, radius = std::sqrt(radius_squared);
  const double angle = std::atan2(radius, z);
  if (!(angle <= max_angle_) || (radius == 0 && !(z > 0))) {
    return false;
  }
  double slope;
  const double image_radius = KannalaBrandtRadius(distortion_, angle, &slope);
  const bool is_axis = radius < 1e-8 * z;
  const double scale = is_axis ? 1 / z : image_radius / radius;
  // The curvature is multiplied by x and y, so it may be omitted on the axis.
  const double by_depth = slope / (radius_squared + z * z);
  const double curvature = is_axis ? 0 : (by_depth * z - scale) / radius_squared;
  *result = {
      scale * x,     scale * y,    scale + curvature * x * x, curvature * x * y, scale + curvature * y * y,
      -by_depth * x, -by_depth * y};
  return true;
}

[[gnu::always_inline]] inline bool CameraModel::ProjectThroughLens(const PlainVector3& point,
                                                                   bool with_jacobian,
                                                                   LensProjection* result) const {
  ImagePoint at;
  if (!(lens_ == LensModel::kKannalaBrandt ? ProjectByAngle(point, &at)
                                           : ProjectThroughPlane(point, with_jacobian, &at)))
    return false;
  const double fx = intrinsics_.fx, fy = intrinsics_.fy;
  result->x = fx * at.x + intrinsics_.cx;
  result->y = fy * at.y + intrinsics_.cy;
  result->x_by_point = {fx * at.xx, fx * at.xy, fx * at.xz};
  result->y_by_point = {fy * at.xy, fy * at.yy, fy * at.yz};
  return true;
}

bool CameraModel::ProjectLens(const Eigen::Vector3d& point_in_camera, Eigen::Vector2d* pixel,
                              Eigen::Matrix<double, 2, 3>* jacobian) const {
  LensProjection lens;
  if (!ProjectThroughLens(PlainVector3(point_in_camera), jacobian != nullptr, &lens)) return false;
  *pixel = {lens.x, lens.y};
  if (jacobian != nullptr)
    *jacobian << lens.x_by_point.x, lens.x_by_point.y, lens.x_by_point.z, lens.y_by_point.x,
        lens.y_by_point.y, lens.y_by_point.z;
  return true;
}

CameraModel CameraModel::WithReadout(const std::shared_ptr<const CameraModel>& lens,
                                     const ReadoutMotion& motion) {
  CameraModel result = *lens;
  result.lens_of_image_ = lens->lens_of_image_ ? lens->lens_of_image_ : lens;
  result.readout_ = motion;
  // Of the first and the last row, or column, relative to the middle of the image.
  const double displacement_px =
      0.5 * motion.rotation_rate.norm() * motion.readout_s.cwiseAbs().maxCoeff() / lens->PixelAngle();
  constexpr double kNegligible_px = 0.1;
  result.rotates_ = displacement_px > kNegligible_px;
  return result;
}

CameraModel CameraModel::WithKnownReadout(const Eigen::Vector2d& readout_s) const {
  CameraModel result = *this;
  result.known_readout_s_ = readout_s;
  return result;
}

std::shared_ptr<const CameraModel> CameraModel::WithMotionOf(const CameraModel& image,
                                                             const std::shared_ptr<const CameraModel>& lens) {
  if (!image.lens_of_image_) return lens;
  return std::make_shared<CameraModel>(WithReadout(lens, image.readout_));
}

Eigen::Vector3d CameraModel::AtExposureOf(const Eigen::Vector2d& pixel, const Eigen::Vector3d& point) const {
  if (!rotates_) return point;
  return SmallRotation(readout_.rotation_rate * ExposureDelay(pixel.x(), pixel.y()), point);
}

double CameraModel::ExposureDelay(double x, double y) const {
  return readout_.readout_s.x() * ((x + 0.5) / intrinsics_.width_px - 0.5) +
         readout_.readout_s.y() * ((y + 0.5) / intrinsics_.height_px - 0.5);
}

bool CameraModel::ProjectAtExposureOf(const Eigen::Vector2d& measured, const Eigen::Vector3d& point_in_camera,
                                      Eigen::Vector2d* pixel, Eigen::Matrix<double, 2, 3>* jacobian) const {
  if (!rotates_) return ProjectLens(point_in_camera, pixel, jacobian);
  const PlainVector3 angle = PlainVector3(readout_.rotation_rate) * ExposureDelay(measured.x(), measured.y());
  LensProjection lens;
  if (!ProjectThroughLens(SmallRotation(angle, PlainVector3(point_in_camera)), jacobian != nullptr, &lens))
    return false;
  *pixel = {lens.x, lens.y};
  if (jacobian == nullptr) return true;
  const PlainVector3 x = lens.x_by_point + Cross(lens.x_by_point, angle),
                     y = lens.y_by_point + Cross(lens.y_by_point, angle);
  *jacobian << x.x, x.y, x.z, y.x, y.y, y.z;
  return true;
}

// The operations, and their order, are those of ProjectAtExposureOf for one point. No branch depends on a
// point.
template <bool rotates>
void CameraModel::ProjectThroughBrownLens(ProjectionBatch* batch) const {
  const std::array<double, 5> distortion = distortion_;
  const Intrinsics in = intrinsics_;
  const ReadoutMotion readout = readout_;
  const PlainVector3 rate(readout.rotation_rate);
  const double max_radius_squared = max_radius_squared_;
  for (std::size_t i = 0; i < ProjectionBatch::kSize; ++i) {
    PlainVector3 point(batch->x[i], batch->y[i], batch->z[i]), angle;
    if constexpr (rotates) {
      angle = rate * (readout.readout_s.x() * ((batch->measured_x[i] + 0.5) / in.width_px - 0.5) +
                      readout.readout_s.y() * ((batch->measured_y[i] + 0.5) / in.height_px - 0.5));
      point = SmallRotation(angle, point);
    }
    const double radius_squared = point.x * point.x + point.y * point.y;
    batch->valid[i] = (point.z > 0) & (radius_squared <= max_radius_squared * point.z * point.z) ? 1.0 : 0.0;
    const double inverse_z = 1 / point.z;
    const double x = point.x * inverse_z, y = point.y * inverse_z;
    ImagePoint at;
    BrownDistort(distortion, x, y, &at);
    at.xx *= inverse_z;
    at.xy *= inverse_z;
    at.yy *= inverse_z;
    at.xz = -(at.xx * x + at.xy * y);
    at.yz = -(at.xy * x + at.yy * y);
    batch->pixel_x[i] = in.fx * at.x + in.cx;
    batch->pixel_y[i] = in.fy * at.y + in.cy;
    PlainVector3 x_by_point(in.fx * at.xx, in.fx * at.xy, in.fx * at.xz);
    PlainVector3 y_by_point(in.fy * at.xy, in.fy * at.yy, in.fy * at.yz);
    if constexpr (rotates) {
      x_by_point = x_by_point + Cross(x_by_point, angle);
      y_by_point = y_by_point + Cross(y_by_point, angle);
    }
    batch->xx[i] = x_by_point.x;
    batch->xy[i] = x_by_point.y;
    batch->xz[i] = x_by_point.z;
    batch->yx[i] = y_by_point.x;
    batch->yy[i] = y_by_point.y;
    batch->yz[i] = y_by_point.z;
  }
}

void CameraModel::ProjectAtExposureOf(ProjectionBatch* batch) const {
  if (lens_ == LensModel::kRadialTangential) {
    rotates_ ? ProjectThroughBrownLens<true>(batch) : ProjectThroughBrownLens<false>(batch);
    return;
  }
  for (std::size_t i = 0; i < ProjectionBatch::kSize; ++i) {
    Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
    Eigen::Matrix<double, 2, 3> jacobian = Eigen::Matrix<double, 2, 3>::Zero();
    const bool valid = ProjectAtExposureOf({batch->measured_x[i], batch->measured_y[i]},
                                           {batch->x[i], batch->y[i], batch->z[i]}, &pixel, &jacobian);
    batch->valid[i] = valid ? 1 : 0;
    batch->pixel_x[i] = pixel.x();
    batch->pixel_y[i] = pixel.y();
    batch->xx[i] = jacobian(0, 0);
    batch->xy[i] = jacobian(0, 1);
    batch->xz[i] = jacobian(0, 2);
    batch->yx[i] = jacobian(1, 0);
    batch->yy[i] = jacobian(1, 1);
    batch->yz[i] = jacobian(1, 2);
  }
}

bool CameraModel::Project(const Eigen::Vector3d& point_in_camera, Eigen::Vector2d* pixel,
                          Eigen::Matrix<double, 2, 3>* jacobian) const {
  if (!rotates_) return ProjectLens(point_in_camera, pixel, jacobian);
  // When a pixel is exposed depends on the pixel: delay = d . position(p + v delay), where p is the pixel of
  // the middle of the image, v the velocity at which the rotation moves it, and d the readout times. What
  // this neglects, the change of the velocity meanwhile, is of second order in the rotation during the
  // readout.
  const PlainVector3 rate(readout_.rotation_rate), point(point_in_camera);
  LensProjection lens;
  if (!ProjectThroughLens(point, true, &lens)) return false;
  const double delay_by_x = readout_.readout_s.x() / intrinsics_.width_px;
  const double delay_by_y = readout_.readout_s.y() / intrinsics_.height_px;
  const PlainVector3 velocity = Cross(rate, point);
  const double delay =
      ExposureDelay(lens.x, lens.y) /
      (1 - (delay_by_x * Dot(lens.x_by_point, velocity) + delay_by_y * Dot(lens.y_by_point, velocity)));
  const PlainVector3 angle = rate * delay;
  const PlainVector3 rotated = SmallRotation(angle, point);
  if (!ProjectThroughLens(rotated, jacobian != nullptr, &lens)) return false;
  *pixel = {lens.x, lens.y};
  if (jacobian == nullptr) return true;
  // pixel = lens(Exp(rate delay(pixel)) point), differentiated on both sides.
  const PlainVector3 turned = Cross(rate, rotated);
  const double x_by_delay = Dot(lens.x_by_point, turned), y_by_delay = Dot(lens.y_by_point, turned);
  const double xx = 1 - x_by_delay * delay_by_x, xy = 0 - x_by_delay * delay_by_y;
  const double yx = 0 - y_by_delay * delay_by_x, yy = 1 - y_by_delay * delay_by_y;
  const double inverse = 1 / (xx * yy - yx * xy);
  const PlainVector3 x = lens.x_by_point + Cross(lens.x_by_point, angle),
                     y = lens.y_by_point + Cross(lens.y_by_point, angle);
  const double ixx = yy * inverse, ixy = -xy * inverse, iyx = -yx * inverse, iyy = xx * inverse;
  *jacobian << MultiplyAdd(ixy, y.x, ixx * x.x), MultiplyAdd(ixy, y.y, ixx * x.y),
      MultiplyAdd(ixy, y.z, ixx * x.z), MultiplyAdd(iyy, y.x, iyx * x.x), MultiplyAdd(iyy, y.y, iyx * x.y),
      MultiplyAdd(iyy, y.z, iyx * x.z);
  return true;
}

std::optional<Eigen::Vector2d> CameraModel::Project(const Eigen::Vector3d& point_in_camera) const {
  Eigen::Vector2d pixel;
  if (!Project(point_in_camera, &pixel, nullptr)) {
    return std::nullopt;
  }
  return pixel;
}

std::optional<Eigen::Vector3d> CameraModel::Unproject(const Eigen::Vector2d& pixel) const {
  std::optional<Eigen::Vector3d> ray = UnprojectLens(pixel);
  if (!rotates_ || !ray) return ray;
  return SmallRotation(-readout_.rotation_rate * ExposureDelay(pixel.x(), pixel.y()), *ray).normalized();
}

std::optional<Eigen::Vector3d> CameraModel::UnprojectLens(const Eigen::Vector2d& pixel) const {
  const Eigen::Vector2d image((pixel.x() - intrinsics_.cx) / intrinsics_.fx,
                              (pixel.y() - intrinsics_.cy) / intrinsics_.fy);
  if (lens_ == LensModel::kRadialTangential) {
    const std::optional<Eigen::Vector2d> normalized =
        BrownUndistort(distortion_, image, std::sqrt(max_radius_squared_), max_image_radius_);
    if (!normalized) {
      return std::nullopt;
    }
    return Eigen::Vector3d(normalized->x(), normalized->y(), 1).normalized();
  }
  const double image_radius = image.norm();
  if (!(image_radius <= max_image_radius_)) {
    return std::nullopt;
  }
  if (lens_ == LensModel::kFov) {
    const double scale = TangentRatio(image_radius * distortion_[0]) / fov_scale_;
    return Eigen::Vector3d(scale * image.x(), scale * image.y(), 1).normalized();
  }
  if (image_radius < 1e-8) {
    return Eigen::Vector3d(image.x(), image.y(), 1).normalized();
  }
  const double angle = InvertRadius(KannalaBrandtRadius, distortion_, image_radius, max_angle_);
  const double scale = std::sin(angle) / image_radius;
  return Eigen::Vector3d(scale * image.x(), scale * image.y(), std::cos(angle));
}

bool CameraModel::HasSameLens(const CameraModel& other) const {
  const Intrinsics& a = intrinsics_;
  const Intrinsics& b = other.intrinsics_;
  return lens_ == other.lens_ && distortion_ == other.distortion_ && a.width_px == b.width_px &&
         a.height_px == b.height_px && a.fx == b.fx && a.fy == b.fy && a.cx == b.cx && a.cy == b.cy;
}

bool CameraModel::operator==(const CameraModel& other) const {
  return HasSameLens(other) && rotates_ == other.rotates_ && (!rotates_ || readout_ == other.readout_);
}

std::ostream& operator<<(std::ostream& out, const CameraModel& camera) {
  const CameraModel::Intrinsics& in = camera.intrinsics();
  out << Name(camera.lens()) << ' ' << in.width_px << 'x' << in.height_px << " fx " << in.fx << " fy "
      << in.fy << " cx " << in.cx << " cy " << in.cy << " distortion";
  for (const double coefficient : camera.distortion()) {
    out << ' ' << coefficient;
  }
  return out;
}

}  // namespace docent::engine
