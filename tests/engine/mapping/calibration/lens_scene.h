// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <memory>
#include <vector>

#include "engine/base/random.h"
#include "engine/mapping/calibration/self_calibration.h"
#include "tests/engine/geometry/test_math.h"
#include "tests/engine/mapping/bundle/bundle_scene.h"

// Bundle problems with an unknown calibration and known ground truth, for tests.
namespace docent::engine {

struct LensSceneOptions {
  double field_of_view_deg = 75, k1 = 0, k2 = 0;  // the true lens, of 640x480 pixels
  Eigen::Vector2d center_px{319.5, 239.5};
  double noise_px = 0.5, outlier_ratio = 0;
  // Sigma of an error that all measurements of a keyframe share; it grows with the distance from the image
  // centre.
  double keyframe_noise_px = 0;
  int cameras = 10, points = 250;
  bool plane = false;      // all points on a plane at a depth of 3, instead of in a box from 2 to 5
  double rotation = 0.25;  // maximum rotation of the cameras about each axis, radians
  // The initial poses and points are those of a map built with an assumed field of view of 60 degrees;
  // otherwise they are the true ones.
  bool from_60_degrees = false;
  std::uint64_t seed = 1;
};

struct LensScene {
  BundleProblem problem;
  std::vector<char> unknown;
  CameraModel lens;  // the true one
  double true_focal() const { return lens.intrinsics().fx; }
};

inline LensScene MakeLensScene(const LensSceneOptions& options) {
  LensScene scene;
  Random random(options.seed);
  const double focal = LensWithFieldOfView(640, 480, options.field_of_view_deg).intrinsics().fx;
  scene.lens = CameraModel(LensModel::kRadialTangential,
                           {640, 480, focal, focal, options.center_px.x(), options.center_px.y()},
                           {options.k1, options.k2, 0, 0, 0});
  const auto assumed = std::make_shared<const CameraModel>(LensWithFieldOfView(640, 480, 60));
  std::vector<Rigid3> cameras;
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < options.cameras; ++i) {
    const Eigen::Vector3d center = i == 0 ? Eigen::Vector3d::Zero() : RandomVector(&random, 0.8);
    const Rotation3 rotation = i == 0 ? Rotation3() : Rotation3::Exp(RandomVector(&random, options.rotation));
    cameras.emplace_back(rotation, -(rotation * center));
  }
  const double half_width = 3 * std::tan(Radians(0.5 * options.field_of_view_deg));
  for (int i = 0; i < options.points; ++i) {
    const double depth = random.Uniform(2, 5);
    points.emplace_back(random.Uniform(-half_width, half_width),
                        random.Uniform(-half_width, half_width) * 0.75, options.plane ? 3 : depth);
  }
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    const double growth = options.keyframe_noise_px * RandomNormal(&random);
    for (std::size_t p = 0; p < points.size(); ++p) {
      const auto pixel = scene.lens.Project(cameras[c] * points[p]);
      if (!pixel || !scene.lens.IsInside(*pixel)) continue;
      Eigen::Vector2d error = RandomNormals(&random);
      error *= options.noise_px;
      error += growth * (*pixel - Eigen::Vector2d(319.5, 239.5)) / 400;
      if (random.Uniform() < options.outlier_ratio)
        error += random.Uniform(20, 60) * Eigen::Vector2d(RandomDirection(&random).head<2>().normalized());
      scene.problem.measurements.push_back(
          {static_cast<int>(c), static_cast<int>(p), (*pixel + error).cast<float>(), 1, false});
    }
  }
  const double focal_ratio = options.from_60_degrees ? assumed->intrinsics().fx / focal : 1;
  for (const Rigid3& camera : cameras) {
    Eigen::Vector3d rotation_vector = camera.rotation.Log(), center = camera.OriginInSource();
    rotation_vector.head<2>() /= focal_ratio;
    center.z() *= focal_ratio;
    const Rotation3 rotation = Rotation3::Exp(rotation_vector);
    scene.problem.cameras.push_back(
        {assumed, Rigid3(rotation, -(rotation * center)), scene.problem.cameras.empty()});
    scene.unknown.push_back(1);
  }
  for (Eigen::Vector3d point : points) {
    point.z() *= focal_ratio;
    scene.problem.points.push_back({point, false});
  }
  return scene;
}

}  // namespace docent::engine
