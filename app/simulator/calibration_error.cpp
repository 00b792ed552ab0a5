// SPDX-License-Identifier: Apache-2.0
#include "app/simulator/calibration_error.h"

#include <array>
#include <cmath>

#include "engine/base/error.h"

namespace docent::app {
namespace {

using engine::CameraModel;

constexpr int kGrid = 24;  // Rays along each side of the image.

CameraModel WithFirstCoefficient(const CameraModel& lens, double value) {
  std::array<double, 5> distortion = lens.distortion();
  distortion[0] = value;
  return {lens.lens(), lens.intrinsics(), distortion};
}

// Change of the first coefficient that displaces rays by the given RMS distance.
double CoefficientChange(const CameraModel& lens, double distortion_error_px) {
  const double sign = distortion_error_px < 0 ? -1 : 1, wanted = std::abs(distortion_error_px);
  const auto displacement = [&](double change) {
    const double value = lens.distortion()[0] + sign * change;
    if (CameraModel::Validate(lens.lens(), lens.intrinsics(), WithFirstCoefficient(lens, value).distortion()))
      return std::optional<double>();
    return MisplacementRms(WithFirstCoefficient(lens, value), lens);
  };
  // The displacement grows with the change, so the change is bracketed by doubling and then found by
  // bisection.
  double low = 0, high = 1e-6;
  for (;; high *= 2) {
    const auto error = displacement(high);
    if (!error || high > 10) {
      throw Error("This lens cannot have such a large distortion error; choose a smaller one.");
    }
    if (*error >= wanted) break;
    low = high;
  }
  for (int step = 0; step < 60; ++step) {
    const double middle = 0.5 * (low + high);
    (displacement(middle).value_or(wanted) < wanted ? low : high) = middle;
  }
  return sign * 0.5 * (low + high);
}

}  // namespace

std::optional<double> MisplacementRms(const CameraModel& calibration, const CameraModel& lens) {
  double sum = 0;
  int count = 0;
  for (int row = 0; row < kGrid; ++row) {
    for (int column = 0; column < kGrid; ++column) {
      const Eigen::Vector2d pixel((column + 0.5) / kGrid * lens.width_px() - 0.5,
                                  (row + 0.5) / kGrid * lens.height_px() - 0.5);
      const auto ray = lens.Unproject(pixel);
      if (!ray) continue;  // Outside of the image circle of a wide lens.
      const auto projected = calibration.Project(*ray);
      if (!projected) return std::nullopt;
      sum += (*projected - pixel).squaredNorm();
      ++count;
    }
  }
  return count > 0 ? std::optional(std::sqrt(sum / count)) : std::nullopt;
}

CameraModel WrongCalibration(const CameraModel& lens, double focal_error, double distortion_error_px) {
  CameraModel::Intrinsics intrinsics = lens.intrinsics();
  std::array<double, 5> distortion = lens.distortion();
  if (distortion_error_px != 0) distortion[0] += CoefficientChange(lens, distortion_error_px);
  intrinsics.fx *= 1 + focal_error;
  intrinsics.fy *= 1 + focal_error;
  if (const auto problem = CameraModel::Validate(lens.lens(), intrinsics, distortion))
    throw Error("With these errors, the simulated calibration is invalid: " + *problem);
  return {lens.lens(), intrinsics, distortion};
}

}  // namespace docent::app
