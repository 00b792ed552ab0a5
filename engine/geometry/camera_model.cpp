// SPDX-License-Identifier: Apache-2.0
#include "engine/geometry/camera_model.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <ostream>
#include <sstream>
#include <vector>

#include "engine/geometry/plain_vector3.h"
#include "engine/geometry/polynomial.h"

namespace docent::engine {
namespace {

constexpr double kPi = std::numbers::pi;
// Tangent of the largest angle of lens models limited to less than 90 degrees from the axis (89.94 degrees).
constexpr double kMaxRadius = 1000.0;
// The one-to-one range ends slightly before the radius at which the image radius stops growing.
constexpr double kRangeMargin = 1 - 1e-6;
constexpr int kMaxNewtonSteps = 100;

// The argument up to which the polynomial, positive at zero, stays positive; `limit` if it always does.
double PositiveUpTo(const std::vector<double>& coefficients, double limit) {
  const std::vector<double> changes = SignChanges(coefficients, limit);
  return changes.empty() ? limit : changes.front() * kRangeMargin;
}

// Largest radius (tangent of the angle) of the Brown model's one-to-one range. The Jacobian of the distortion
// is symmetric; at radius r its radial part has the eigenvalues d(r) and (r d(r))', and its tangential part's
// are at least -6 |p| r. Where it is positive definite on a disc the mapping is one-to-one there.
double LargestBrownRadius(const std::array<double, 5>& k) {
  const double tangential = -6 * std::hypot(k[2], k[3]);
  const std::vector<double> across = {1, tangential, k[0], 0, k[1], 0, k[4]};
  const std::vector<double> along = {1, tangential, 3 * k[0], 0, 5 * k[1], 0, 7 * k[4]};
  return std::min(PositiveUpTo(across, kMaxRadius), PositiveUpTo(along, kMaxRadius));
}

double LargestKannalaBrandtAngle(const std::array<double, 5>& k) {
  return PositiveUpTo({1, 0, 3 * k[0], 0, 5 * k[1], 0, 7 * k[2], 0, 9 * k[3]}, kPi);
}

// atan(x) / x and tan(x) / x, also at zero.
double ArcTangentRatio(double x) {
  return std::abs(x) < 1e-4 ? 1 - x * x / 3 : std::atan(x) / x;
}
double TangentRatio(double x) {
  return std::abs(x) < 1e-4 ? 1 + x * x / 3 : std::tan(x) / x;
}

// Distorted radius of the Brown model without its tangential part, and its derivative.
double BrownRadius(const std::array<double, 5>& k, double r, double* derivative) {
  const double s = r * r;
  *derivative = 1 + s * (3 * k[0] + s * (5 * k[1] + s * 7 * k[4]));
  return r * (1 + s * (k[0] + s * (k[1] + s * k[4])));
}

double KannalaBrandtRadius(const std::array<double, 5>& k, double angle, double* derivative) {
  const double s = angle * angle;
  *derivative = 1 + s * (3 * k[0] + s * (5 * k[1] + s * (7 * k[2] + s * 9 * k[3])));
  return angle * (1 + s * (k[0] + s * (k[1] + s * (k[2] + s * k[3]))));
}

// Solves radius(x) = target on [0, limit], where radius grows from zero to at least the target: Newton's
// method, with bisection where a step leaves the bracket.
double InvertRadius(double (*radius)(const std::array<double, 5>&, double, double*),
                    const std::array<double, 5>& k, double target, double limit) {
  double low = 0, high = limit, x = std::min(target, limit);
  for (int i = 0; i < kMaxNewtonSteps; ++i) {
    double derivative;
    const double error = radius(k, x, &derivative) - target;
    (error > 0 ? high : low) = x;
    double next = x - error / derivative;
    if (!(next >= low && next <= high)) {
      next = 0.5 * (low + high);
    }
    const double step = std::abs(next - x);
    x = next;
    if (step <= 4 * std::numeric_limits<double>::epsilon() * x) {
      break;
    }
  }
  return x;
}

// The Brown model on the plane z = 1 with its (symmetric) Jacobian. `Out` receives x, y, xx, xy, yy as in
// CameraModel::ImagePoint. After inlining, outputs that the caller does not use are not computed.
template <typename Out>
inline void BrownDistort(const std::array<double, 5>& k, double x, double y, Out* out) {
  const double s = x * x + y * y;
  const double radial = 1 + s * (k[0] + s * (k[1] + s * k[4]));
  const double twice_slope = 2 * (k[0] + s * (2 * k[1] + s * 3 * k[4]));  // derivative of radial by s
  const double px = k[3], py = k[2];
  const double scale = radial + 2 * (px * x + py * y);
  out->x = scale * x + px * s;
  out->y = scale * y + py * s;
  out->xx = scale + (twice_slope * x + 4 * px) * x;
  out->xy = twice_slope * x * y + 2 * (px * y + py * x);
  out->yy = scale + (twice_slope * y + 4 * py) * y;
}

struct BrownError {
  double x = 0, y = 0, xx = 0, xy = 0, yy = 0;
  double norm = 0;

  BrownError(const std::array<double, 5>& k, const Eigen::Vector2d& at, const Eigen::Vector2d& distorted) {
    BrownDistort(k, at.x(), at.y(), this);
    x -= distorted.x();
    y -= distorted.y();
    norm = std::hypot(x, y);
  }
  Eigen::Vector2d NewtonStep() const {
    const double determinant = xx * yy - xy * xy;
    return {(yy * x - xy * y) / determinant, (xx * y - xy * x) / determinant};
  }
};

// Inverse of BrownDistort within the radius, or empty. Starts at the solution without the tangential part and
// continues with Newton steps that are halved until they reduce the error.
std::optional<Eigen::Vector2d> BrownUndistort(const std::array<double, 5>& k,
                                              const Eigen::Vector2d& distorted, double max_radius,
                                              double max_image_radius) {
  const double image_radius = distorted.norm();
  const bool is_radial = k[2] == 0 && k[3] == 0;
  if (image_radius == 0 && is_radial) {
    return Eigen::Vector2d::Zero().eval();
  }
  if (!std::isfinite(image_radius) || (is_radial && image_radius > max_image_radius)) {
    return std::nullopt;
  }
  Eigen::Vector2d x = distorted;
  if (image_radius > 0) {
    const double radius = InvertRadius(BrownRadius, k, std::min(image_radius, max_image_radius), max_radius);
    x *= radius / image_radius;
  }
  if (is_radial) {
    return x;
  }
  const double tolerance = 1e-14 * (1 + image_radius);
  BrownError error(k, x, distorted);
  for (int i = 0; i < kMaxNewtonSteps && error.norm > tolerance; ++i) {
    Eigen::Vector2d step = error.NewtonStep();
    Eigen::Vector2d next = x - step;
    BrownError next_error(k, next, distorted);
    for (int halving = 0; halving < 30 && (next.norm() > max_radius || next_error.norm > error.norm);
         ++halving) {
      step *= 0.5;
      next = x - step;
      next_error = BrownError(k, next, distorted);
    }
    if (!(next.norm() <= max_radius) || !(next_error.norm < error.norm)) {
      break;
    }
    x = next;
    error = next_error;
  }
  if (!(error.norm <= 1e-10 * (1 + image_radius))) {
    return std::nullopt;
  }
  return x;
}

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
  if (lens == LensModel::kFov && !(distortion[0] >= 0 && distortion[0] < kPi)) {
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
      max_radius_squared_ = kMaxRadius * kMaxRadius;
      max_angle_ = std::atan(kMaxRadius);
      fov_scale_ = TangentRatio(omega / 2);
      max_image_radius_ = kMaxRadius * fov_scale_ * ArcTangentRatio(kMaxRadius * fov_scale_ * omega);
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
