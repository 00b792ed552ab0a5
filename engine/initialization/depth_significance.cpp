// SPDX-License-Identifier: Apache-2.0
#include "engine/initialization/depth_significance.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "engine/base/median.h"
#include "engine/base/option_check.h"
#include "engine/geometry/tangent_basis.h"

namespace docent::engine {
namespace {

using Vector5 = Eigen::Matrix<double, 5, 1>;
using Matrix5 = Eigen::Matrix<double, 5, 5>;

constexpr double kUnknown = 1e9;

// Derivatives of one pair with respect to a small change of the pose: a rotation on the left, and the
// direction of the translation.
struct PairDerivatives {
  Vector5 epipolar_px;    // of the distance from the epipolar line, joint over both images
  Vector5 inverse_depth;  // of the logarithm of the inverse depth
  double parallax_px = 0;
};

PairDerivatives Differentiate(const Eigen::Vector3d& ray_a, const Eigen::Vector3d& ray_b,
                              const Rigid3& b_from_a, const Eigen::Matrix<double, 3, 2>& basis,
                              double pixel_angle) {
  const Eigen::Vector3d& translation = b_from_a.translation;
  const Eigen::Vector3d rotated = b_from_a.rotation * ray_a;
  const Eigen::Vector3d plane_a = translation.cross(rotated), plane_b = ray_b.cross(translation);
  PairDerivatives result;
  const double joint = std::sqrt(plane_a.squaredNorm() + plane_b.squaredNorm() + 1e-18);
  result.epipolar_px << rotated.cross(plane_b), basis.transpose() * rotated.cross(ray_b);
  result.epipolar_px /= joint * pixel_angle;

  // The parallax is the angle from `turned` to ray_b within their epipolar plane. It is the inverse depth
  // times the sine of the angle between the translation and the ray.
  const double sine = plane_a.norm() + 1e-12, cosine = translation.dot(rotated);
  const Eigen::Vector3d normal = plane_a / sine;
  const double parallax = std::atan2(rotated.cross(ray_b).dot(normal), rotated.dot(ray_b));
  result.parallax_px = std::abs(parallax) / pixel_angle;
  const double safe = std::copysign(std::max(std::abs(parallax), 1e-6), parallax);
  result.inverse_depth.head<3>() = -normal / safe;
  // d sine / d translation = -cosine / sine * (component of the ray), and the inverse depth is parallax /
  // sine.
  result.inverse_depth.tail<2>() = cosine / (sine * sine) * (basis.transpose() * rotated);
  return result;
}

// Independent noise is averaged over all measurements, smooth errors over a few modes only.
template <int size>
Eigen::Matrix<double, size, size> Covariance(const Eigen::Matrix<double, size, size>& inverse,
                                             const Eigen::Matrix<double, size, size>& smooth, double count,
                                             double variance, const DepthNoiseOptions& options) {
  return variance * inverse + std::max(1.0, count / options.smooth_modes) * inverse * smooth * inverse;
}

// An inlier pair, and the variance of the smooth errors of its keypoint's motion, in pixels squared.
struct InlierPair {
  Eigen::Index row = 0;
  double smooth_squared = 0;
};

// Median relative standard deviation of the inverse depths, each a free parameter; 1e9 if the pose is not
// determined.
double SigmaOfGeneralDepths(const RayPairs& pairs, const std::vector<InlierPair>& inliers,
                            const Rigid3& b_from_a, double noise_px, const DepthNoiseOptions& options) {
  const Eigen::Matrix<double, 3, 2> basis = TangentBasis(b_from_a.translation);
  Matrix5 information = Matrix5::Zero(), smooth = Matrix5::Zero();
  std::vector<PairDerivatives> derivatives;
  for (const InlierPair& pair : inliers) {
    derivatives.push_back(
        Differentiate(pairs.RayA(pair.row), pairs.RayB(pair.row), b_from_a, basis, pairs.pixel_angle));
    const Vector5& jacobian = derivatives.back().epipolar_px;
    information += jacobian * jacobian.transpose();
    smooth += pair.smooth_squared * jacobian * jacobian.transpose();
  }
  const Eigen::LDLT<Matrix5> solver(information);
  if (solver.info() != Eigen::Success || !solver.isPositive()) return kUnknown;
  const Matrix5 covariance = Covariance<5>(solver.solve(Matrix5::Identity()), smooth,
                                           static_cast<double>(inliers.size()), noise_px * noise_px, options);
  std::vector<double> sigmas;
  for (std::size_t k = 0; k < inliers.size(); ++k) {
    const double parallax = std::max(derivatives[k].parallax_px, 1e-3);
    const double measured = (2 * noise_px * noise_px + inliers[k].smooth_squared) / (parallax * parallax);
    const Vector5& by_pose = derivatives[k].inverse_depth;
    sigmas.push_back(std::sqrt(measured + by_pose.dot(covariance * by_pose)));
  }
  return Median(std::move(sigmas));
}

// The plane { x : normal . x = 1 } in frame a that fits the pairs under the pose, by least squares over the
// inverse depths: the displacement of a ray is normal . ray_a times the translation.
Eigen::Vector3d FitNormal(const RayPairs& pairs, const std::vector<InlierPair>& inliers,
                          const Rigid3& b_from_a) {
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
  for (const InlierPair& pair : inliers) {
    const Eigen::Vector3d ray_a = pairs.RayA(pair.row), ray_b = pairs.RayB(pair.row);
    const Eigen::Vector3d along = b_from_a.translation.cross(ray_b),
                          residual = -(b_from_a.rotation * ray_a).cross(ray_b);
    // (R a + s t) x b = 0, with s = normal . a.
    information += along.squaredNorm() * ray_a * ray_a.transpose();
    gradient += along.dot(residual) * ray_a;
  }
  return information.ldlt().solve(gradient);
}

// The same for a plane: eight parameters (rotation, direction of the translation, plane) explain all pairs.
double SigmaOfPlaneDepths(const RayPairs& pairs, const std::vector<InlierPair>& inliers,
                          const Rigid3& b_from_a, double noise_px, const DepthNoiseOptions& options) {
  using Matrix8 = Eigen::Matrix<double, 8, 8>;
  const Eigen::Matrix<double, 3, 2> basis = TangentBasis(b_from_a.translation);
  const Eigen::Vector3d normal = FitNormal(pairs, inliers, b_from_a);
  Matrix8 information = Matrix8::Zero(), smooth = Matrix8::Zero();
  for (const InlierPair& pair : inliers) {
    const Eigen::Vector3d ray_a = pairs.RayA(pair.row), rotated = b_from_a.rotation * ray_a;
    const Eigen::Vector3d seen = rotated + normal.dot(ray_a) * b_from_a.translation;
    Eigen::Matrix<double, 3, 8> jacobian;
    jacobian.leftCols<3>() << 0, rotated.z(), -rotated.y(), -rotated.z(), 0, rotated.x(), rotated.y(),
        -rotated.x(), 0;
    jacobian.middleCols<2>(3) = normal.dot(ray_a) * basis;
    jacobian.rightCols<3>() = b_from_a.translation * ray_a.transpose();
    const Eigen::Vector3d direction = seen.normalized();
    jacobian = (jacobian - direction * (direction.transpose() * jacobian)).eval() /
               (seen.norm() * pairs.pixel_angle);
    const Matrix8 product = jacobian.transpose() * jacobian;
    information += product;
    smooth += pair.smooth_squared * product;
  }
  const Eigen::LDLT<Matrix8> solver(information);
  if (solver.info() != Eigen::Success || !solver.isPositive()) return kUnknown;
  const Matrix8 covariance =
      Covariance<8>(solver.solve(Matrix8::Identity()), smooth, static_cast<double>(inliers.size()),
                    2 * noise_px * noise_px, options);
  const Eigen::Matrix3d of_plane = covariance.bottomRightCorner<3, 3>();
  std::vector<double> sigmas;
  for (const InlierPair& pair : inliers) {
    const Eigen::Vector3d ray_a = pairs.RayA(pair.row);
    sigmas.push_back(std::sqrt(ray_a.dot(of_plane * ray_a)) / std::max(std::abs(normal.dot(ray_a)), 1e-9));
  }
  return Median(std::move(sigmas));
}

}  // namespace

std::optional<std::string> DepthNoiseOptions::Validate() const {
  return OptionCheck()
      .AtLeast(calibration_share, 0, "calibration error of the motion")
      .AtLeast(rolling_shutter_share, 0, "rolling-shutter error of the motion")
      .AtLeast(speed_change_px, 0, "change of speed between two views")
      .Positive(smooth_modes, "number of independent smooth errors")
      .fault();
}

DepthSignificance MeasureDepthSignificance(const RayPairs& pairs, const std::vector<bool>& inlier,
                                           const Rigid3& b_from_a, StructureModel model, double noise_px,
                                           const DepthNoiseOptions& options) {
  DepthSignificance result;
  Weights weights = Weights::Zero(pairs.size());
  for (Eigen::Index i = 0; i < pairs.size(); ++i)
    weights[i] = inlier[static_cast<std::size_t>(i)] ? 1.0 : 0.0;
  constexpr double kMinPairs = 8;  // pairs
  if (weights.sum() < kMinPairs) return result;

  const Eigen::ArrayXd motion_squared =  // of each keypoint, pixels
      2 * RotationResiduals(pairs, Eigen::Matrix3d::Identity());
  const double shutter_px = options.rolling_shutter_share * options.speed_change_px;
  const double ratio = options.calibration_share;
  const Eigen::ArrayXd residual = RotationResiduals(pairs, FitRotation(pairs, weights));
  std::vector<double> squared, expected;
  std::vector<InlierPair> inliers;
  for (Eigen::Index i = 0; i < pairs.size(); ++i) {
    if (weights[i] == 0) continue;
    const double smooth_squared = ratio * ratio * motion_squared[i] + shutter_px * shutter_px;
    inliers.push_back({i, smooth_squared});
    squared.push_back(residual[i]);
    expected.push_back(noise_px * noise_px + smooth_squared / 2);  // of the joint distance in both images
  }
  // 1.386 sigma^2 is the median of the sum of two squared normal variables.
  result.parallax_px = std::sqrt(Median(std::move(squared)) / 1.386);
  result.expected_error_px = std::sqrt(Median(std::move(expected)));
  result.relative_depth_sigma = model == StructureModel::kPlane
                                    ? SigmaOfPlaneDepths(pairs, inliers, b_from_a, noise_px, options)
                                    : SigmaOfGeneralDepths(pairs, inliers, b_from_a, noise_px, options);
  return result;
}

}  // namespace docent::engine
