// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "engine/mapping/bundle/bundle_adjustment.h"
#include "tests/engine/geometry/test_math.h"

// Bundle problems whose solution is known, for tests.
namespace docent::engine {

// The figures of an adjustment, for messages.
inline std::string Brief(const BundleSummary& summary) {
  std::ostringstream text;
  text << summary.iterations << " iterations, cost " << summary.initial_cost << " -> " << summary.final_cost
       << ", sigma " << summary.sigma << ", " << summary.outliers << " outliers";
  return text.str();
}

struct BundleSceneOptions {
  int cameras = 6, fixed_cameras = 2, points = 300, fixed_points = 0;
  double noise_px = 0, pose_error = 0.02, point_error = 0.05, outlier_ratio = 0;
  LensModel lens = LensModel::kRadialTangential;
  std::array<double, 5> distortion = {-0.296609, 0.080818};
  std::uint64_t seed = 1;
};

// Cameras side by side that see a box of points; every point in view is measured. Fixed cameras have no
// error.
struct BundleScene {
  BundleProblem problem;
  std::vector<Rigid3> cameras;
  std::vector<Eigen::Vector3d> points;
  std::vector<bool> is_outlier;
};

inline Vector6 RandomTwist(Random* random, double translation, double rotation) {
  Vector6 twist;
  twist << RandomVector(random, translation), RandomVector(random, rotation);
  return twist;
}

inline BundleScene MakeBundleScene(const BundleSceneOptions& options) {
  BundleScene scene;
  Random random(options.seed);
  const auto model = std::make_shared<const CameraModel>(
      options.lens, CameraModel::Intrinsics{752, 480, 420.5, 421.6, 355.2, 250.3}, options.distortion);
  for (int i = 0; i < options.cameras; ++i) {
    scene.cameras.push_back(Rigid3::Exp(RandomTwist(&random, 0.7, 0.15)));
    const bool fixed = i < options.fixed_cameras;
    const Rigid3 error =
        fixed ? Rigid3() : Rigid3::Exp(RandomTwist(&random, options.pose_error, options.pose_error));
    scene.problem.cameras.push_back({model, error * scene.cameras.back(), fixed});
  }
  for (int i = 0; i < options.points; ++i) {
    const double z = random.Uniform(2, 5);
    const double y = random.Uniform(-1.5, 1.5);
    const double x = random.Uniform(-2, 2);
    scene.points.emplace_back(x, y, z);
    const bool fixed = i < options.fixed_points;
    scene.problem.points.push_back(
        {scene.points.back() + RandomVector(&random, fixed ? 0 : options.point_error), fixed});
  }
  for (int camera = 0; camera < options.cameras; ++camera) {
    for (int point = 0; point < options.points; ++point) {
      const auto pixel = model->Project(scene.cameras[static_cast<std::size_t>(camera)] *
                                        scene.points[static_cast<std::size_t>(point)]);
      if (!pixel || !model->IsInside(*pixel)) {
        continue;
      }
      const auto sigma_px = static_cast<float>(1 << random.Below(3));
      const bool outlier = random.Uniform() < options.outlier_ratio;
      Eigen::Vector2d error = RandomNormals(&random);
      error *= options.noise_px * sigma_px;
      if (outlier) {
        error += sigma_px * random.Uniform(30, 60) *
                 Eigen::Vector2d(RandomDirection(&random).head<2>().normalized());
      }
      scene.problem.measurements.push_back({camera, point, (*pixel + error).cast<float>(), sigma_px, false});
      scene.is_outlier.push_back(outlier);
    }
  }
  return scene;
}

}  // namespace docent::engine
