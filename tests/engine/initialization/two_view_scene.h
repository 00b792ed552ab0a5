// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "engine/base/random.h"
#include "engine/geometry/rigid3.h"
#include "tests/engine/geometry/test_math.h"

// A synthetic scene seen by two pinhole cameras of 640x480 pixels, with ground truth for the two-view tests.
namespace docent::engine::testing_scene {

inline constexpr double kFocal = 500, kWidth = 640, kHeight = 480;  // pixels

inline Eigen::Vector2d RandomPixel(Random* random) {
  return {random->Uniform(0, kWidth - 1), random->Uniform(0, kHeight - 1)};
}

inline Eigen::Vector3d RayOfPixel(const Eigen::Vector2d& pixel) {
  return Eigen::Vector3d((pixel.x() - kWidth / 2) / kFocal, (pixel.y() - kHeight / 2) / kFocal, 1)
      .normalized();
}

inline std::optional<Eigen::Vector2d> PixelOfPoint(const Eigen::Vector3d& x) {
  if (x.z() < 1e-3) return std::nullopt;
  const Eigen::Vector2d pixel(kFocal * x.x() / x.z() + kWidth / 2, kFocal * x.y() / x.z() + kHeight / 2);
  if (pixel.x() < 0 || pixel.y() < 0 || pixel.x() > kWidth - 1 || pixel.y() > kHeight - 1)
    return std::nullopt;
  return pixel;
}

struct TwoViews {
  std::vector<Eigen::Vector3d> rays_in_a, rays_in_b;
  std::vector<bool> correct;  // a correspondence and not an outlier
  std::vector<Eigen::Vector3d> points_in_a;
  Rigid3 b_from_a;
};

struct SceneOptions {
  int count = 400;
  double noise_px = 0.5;
  double outlier_ratio = 0;
  // The focal length that is assumed for the images, relative to the true one.
  double focal_error = 1;
};

// depth_along(ray, random): distance of the point that camera a sees along this ray (of any length but zero).
using DepthAlong = std::function<double(const Eigen::Vector3d& ray, Random* random)>;

inline TwoViews MakeTwoViews(const DepthAlong& depth_along, const Rigid3& b_from_a,
                             const SceneOptions& options, Random* random) {
  TwoViews views;
  views.b_from_a = b_from_a;
  const auto read = [&](const Eigen::Vector2d& pixel) {
    const Eigen::Vector3d ray = RayOfPixel(pixel + options.noise_px * RandomNormals(random));
    return Eigen::Vector3d(ray.x(), ray.y(), ray.z() * options.focal_error).normalized();
  };
  for (int attempt = 0;
       attempt < 1000 * options.count && static_cast<int>(views.correct.size()) < options.count; ++attempt) {
    const Eigen::Vector2d pixel_a = RandomPixel(random);
    const Eigen::Vector3d ray = RayOfPixel(pixel_a);
    const Eigen::Vector3d point = depth_along(ray, random) * ray;
    const auto pixel_b = PixelOfPoint(b_from_a * point);
    if (!pixel_b) continue;
    const bool correct = random->Uniform() >= options.outlier_ratio;
    views.rays_in_a.push_back(read(pixel_a));
    views.rays_in_b.push_back(read(correct ? *pixel_b : RandomPixel(random)));
    views.correct.push_back(correct);
    views.points_in_a.push_back(point);
  }
  return views;
}

// Points anywhere between two depths.
inline DepthAlong Volume(double nearest, double farthest) {
  return [=](const Eigen::Vector3d& ray, Random* random) {
    return random->Uniform(nearest, farthest) / ray.z();
  };
}

// Points on { x : normal . x = distance }.
inline DepthAlong OnPlane(const Eigen::Vector3d& normal, double distance) {
  return [=](const Eigen::Vector3d& ray, Random*) { return distance / normal.normalized().dot(ray); };
}

// The camera centre of b in a, and the rotation of the camera.
inline Rigid3 Motion(const Eigen::Vector3d& center_of_b_in_a, const Eigen::Vector3d& rotation_vector_deg) {
  const Rotation3 b_from_a = Rotation3::Exp(rotation_vector_deg * (kPi / 180));
  return {b_from_a, -(b_from_a * center_of_b_in_a)};
}

// Of the translations, whose length two views do not give.
inline double DirectionErrorDeg(const Rigid3& estimate, const Rigid3& truth) {
  return Degrees(AngleBetween(estimate.translation, truth.translation));
}

}  // namespace docent::engine::testing_scene
