// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <opencv2/core.hpp>

#include "engine/base/random.h"
#include "engine/geometry/camera_model.h"
#include "engine/geometry/rigid3.h"
#include "tests/engine/geometry/test_math.h"

// Synthetic images with exactly known rotations, for tests of thumbnails and of rotation alignment.
namespace docent::engine {

// A textured sphere around the camera: its grey value depends on the viewing direction only, with detail from
// 30 degrees down to 2 degrees, so that the image after any rotation is known exactly.
class PaintedSphere {
 public:
  explicit PaintedSphere(std::uint64_t seed) : seed_(seed) {}

  double Grey(const Eigen::Vector3d& direction) const {
    double grey = 128;
    double amplitude = 70;
    for (double frequency = 2; frequency < 40; frequency *= 2.3, amplitude *= 0.72)
      grey += amplitude * Noise(frequency * direction);
    return grey;
  }

  // gain and offset simulate a change of exposure.
  cv::Mat Render(const CameraModel& camera, const Rotation3& camera_from_sphere, double gain = 1,
                 double offset = 0, double noise = 0) const {
    const Rotation3 sphere_from_camera = camera_from_sphere.inverse();
    cv::Mat image(camera.height_px(), camera.width_px(), CV_8UC1, cv::Scalar(0));
    // The noise seed depends on the orientation, so that each image has different noise.
    const double bits = 1e9 * camera_from_sphere.Log().sum();
    Random random(seed_ + static_cast<std::uint64_t>(std::abs(bits)));
    for (int y = 0; y < image.rows; ++y)
      for (int x = 0; x < image.cols; ++x)
        if (const auto ray = camera.Unproject({x, y}))
          image.at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(
              gain * Grey(sphere_from_camera * *ray) + offset + noise * random.Uniform(-1.7, 1.7));
    return image;
  }

 private:
  double Corner(int x, int y, int z) const {
    const auto part = [](int v) { return static_cast<std::uint64_t>(v + 1000); };
    Random random(seed_ + part(x) * 73856093u + part(y) * 19349663u + part(z) * 83492791u);
    random.Next();
    return random.Uniform(-1, 1);
  }
  // Value noise: values at the corners of a unit lattice, smoothly interpolated.
  double Noise(const Eigen::Vector3d& position) const {
    const Eigen::Vector3i cell = position.array().floor().cast<int>();
    const Eigen::Array3d f = (position - cell.cast<double>()).array();
    const Eigen::Array3d s = f * f * (3 - 2 * f);
    double sum = 0;
    for (int corner = 0; corner < 8; ++corner) {
      const int dx = corner & 1, dy = (corner >> 1) & 1, dz = corner >> 2;
      const double weight = (dx ? s[0] : 1 - s[0]) * (dy ? s[1] : 1 - s[1]) * (dz ? s[2] : 1 - s[2]);
      sum += weight * Corner(cell.x() + dx, cell.y() + dy, cell.z() + dz);
    }
    return sum;
  }
  std::uint64_t seed_;
};

inline CameraModel Pinhole() {
  return {LensModel::kRadialTangential, {320, 240, 260, 260, 159.5, 119.5}, {-0.2, 0.05}};
}
inline CameraModel WideFov() {
  return {LensModel::kFov, {320, 240, 200, 202, 158, 121}, {0.9}};
}
inline CameraModel Fisheye() {
  return {LensModel::kKannalaBrandt, {320, 240, 130, 130, 160, 120}, {0.01, -0.004}};
}

inline Rotation3 RandomRotation(Random* random, double angle) {
  return Rotation3::Exp(angle * RandomDirection(random));
}

}  // namespace docent::engine
