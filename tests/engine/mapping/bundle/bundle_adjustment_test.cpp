// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/bundle/bundle_adjustment.h"

#include <ceres/loss_function.h>
#include <ceres/manifold.h>
#include <ceres/numeric_diff_cost_function.h>
#include <ceres/problem.h>
#include <ceres/solver.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstring>
#include <limits>
#include <thread>
#include <vector>

#include "engine/mapping/bundle/robust_loss.h"
#include "tests/engine/mapping/bundle/bundle_scene.h"

namespace docent::engine {
namespace {

using BundleOutcome = BundleSummary::Outcome;

double WorstCenterError(const BundleScene& scene) {
  double worst = 0;
  for (std::size_t i = 0; i < scene.cameras.size(); ++i) {
    worst = std::max(
        worst, (scene.problem.cameras[i].camera_from_map.OriginInSource() - scene.cameras[i].OriginInSource())
                   .norm());
  }
  return worst;
}

// Over the points that several cameras see; the depth of the others is not determined.
double WorstPointError(const BundleScene& scene) {
  std::vector<int> views(scene.problem.points.size(), 0);
  for (const BundleProblem::Measurement& measurement : scene.problem.measurements) {
    ++views[static_cast<std::size_t>(measurement.point)];
  }
  double worst = 0;
  for (std::size_t i = 0; i < scene.points.size(); ++i) {
    if (views[i] >= 2) {
      worst = std::max(worst, (scene.problem.points[i].position - scene.points[i]).norm());
    }
  }
  return worst;
}

bool SameBytes(const BundleProblem& a, const BundleProblem& b) {
  for (std::size_t i = 0; i < a.cameras.size(); ++i) {
    if (a.cameras[i].camera_from_map.rotation.quaternion().coeffs() !=
            b.cameras[i].camera_from_map.rotation.quaternion().coeffs() ||
        a.cameras[i].camera_from_map.translation != b.cameras[i].camera_from_map.translation) {
      return false;
    }
  }
  for (std::size_t i = 0; i < a.points.size(); ++i) {
    if (a.points[i].position != b.points[i].position) {
      return false;
    }
  }
  return true;
}

struct Reprojection {
  bool operator()(const double* rotation, const double* translation, const double* point,
                  double* residual) const {
    const Eigen::Map<const Eigen::Quaterniond> camera_from_map(rotation);
    const auto pixel = model->Project(camera_from_map * Eigen::Map<const Eigen::Vector3d>(point) +
                                      Eigen::Map<const Eigen::Vector3d>(translation));
    if (!pixel) return false;
    Eigen::Map<Eigen::Vector2d> result(residual);
    result = (*pixel - measurement->pixel.cast<double>()) / static_cast<double>(measurement->sigma_px);
    return true;
  }
  const CameraModel* model;
  const BundleProblem::Measurement* measurement;
};

// The cost of rounding the pixels of two thousand measurements, below 1024, to floats: up to 3e-5 in x and in
// y.
constexpr double kRoundingCost = 0.5 * 2000 * 2 * 3e-5 * 3e-5;

BundleOptions WithIterations(int iterations) {
  BundleOptions options;
  options.max_iterations = iterations;
  return options;
}

TEST(AdjustBundleTest, RecoversTheTruthFromExactMeasurementsForEveryLens) {
  const std::vector<std::pair<LensModel, std::array<double, 5>>> lenses = {
      {LensModel::kRadialTangential, {-0.296609, 0.080818, 0.001, -0.002}},
      {LensModel::kFov, {0.93}},
      {LensModel::kKannalaBrandt, {-0.013, 0.021, -0.0035, 0.0012}}};
  for (const auto& [lens, distortion] : lenses) {
    for (const RobustLoss loss : {RobustLoss::kTukey, RobustLoss::kHuber}) {
      BundleSceneOptions scene_options;
      scene_options.lens = lens;
      scene_options.distortion = distortion;
      BundleScene scene = MakeBundleScene(scene_options);
      BundleOptions options = WithIterations(50);
      options.loss = loss;
      const BundleSummary summary = AdjustBundle(options, &scene.problem);
      EXPECT_EQ(summary.outcome, BundleOutcome::kConverged) << Brief(summary);
      EXPECT_LT(WorstCenterError(scene), 1e-6) << Brief(summary);
      EXPECT_LT(WorstPointError(scene), 1e-4) << Brief(summary);
      EXPECT_EQ(summary.outliers, 0) << Brief(summary);
      EXPECT_LT(summary.final_cost, kRoundingCost) << Brief(summary);
    }
  }
}

TEST(AdjustBundleTest, EstimatesTheTruthAndTheSigmaFromNoisyMeasurements) {
  BundleSceneOptions scene_options;
  scene_options.cameras = 12;
  scene_options.noise_px = 0.8;
  BundleScene scene = MakeBundleScene(scene_options);
  const BundleSummary summary = AdjustBundle(WithIterations(30), &scene.problem);
  EXPECT_EQ(summary.outcome, BundleOutcome::kConverged) << Brief(summary);
  // Twelve measurements of a point give 24 numbers for its three coordinates: the residuals keep 7/8 of the
  // variance.
  EXPECT_NEAR(summary.sigma, 0.8 * std::sqrt(7.0 / 8), 0.05) << Brief(summary);
  EXPECT_LT(WorstCenterError(scene), 0.01);
  EXPECT_LT(summary.outliers, static_cast<int>(scene.problem.measurements.size() / 200));
}

TEST(AdjustBundleTest, MarksExactlyTheOutliers) {
  BundleSceneOptions scene_options;
  scene_options.cameras = 10;
  scene_options.noise_px = 0.5;
  scene_options.outlier_ratio = 0.1;
  for (const RobustLoss loss : {RobustLoss::kTukey, RobustLoss::kHuber}) {
    BundleScene scene = MakeBundleScene(scene_options);
    BundleOptions options = WithIterations(40);
    options.loss = loss;
    const BundleSummary summary = AdjustBundle(options, &scene.problem);
    int missed = 0, false_alarms = 0, outliers = 0;
    for (std::size_t i = 0; i < scene.is_outlier.size(); ++i) {
      outliers += scene.problem.measurements[i].outlier ? 1 : 0;
      missed += scene.is_outlier[i] && !scene.problem.measurements[i].outlier ? 1 : 0;
      false_alarms += !scene.is_outlier[i] && scene.problem.measurements[i].outlier ? 1 : 0;
    }
    EXPECT_EQ(summary.outliers, outliers);
    // Under Huber's loss each outlier still has some influence, which a point with few measurements cannot
    // resist.
    const int allowed = static_cast<int>(scene.is_outlier.size()) / (loss == RobustLoss::kTukey ? 100 : 50);
    EXPECT_LE(missed, loss == RobustLoss::kTukey ? 0 : 5) << Brief(summary);
    EXPECT_LT(false_alarms, allowed) << Brief(summary);
    EXPECT_LT(WorstCenterError(scene), loss == RobustLoss::kTukey ? 0.01 : 0.03) << Brief(summary);
  }
}

// Compares with an independent solver that uses numerical derivatives instead of our Jacobians.
TEST(AdjustBundleTest, ReachesTheSameMinimumAsCeres) {
  BundleSceneOptions scene_options;
  scene_options.noise_px = 1;
  BundleScene scene = MakeBundleScene(scene_options);
  BundleProblem other = scene.problem;
  BundleOptions options = WithIterations(100);
  options.loss = RobustLoss::kHuber;
  // A fixed threshold that many residuals exceed.
  options.threshold_factor = 1;
  options.min_sigma = 1.2;
  const BundleSummary summary = AdjustBundle(options, &scene.problem);
  ASSERT_EQ(summary.outcome, BundleOutcome::kConverged);

  ceres::Problem::Options ownership;
  ownership.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem problem(ownership);
  ceres::EigenQuaternionManifold rotations;
  std::vector<Eigen::Quaterniond> rotation;
  for (const BundleProblem::Camera& camera : other.cameras)
    rotation.push_back(camera.camera_from_map.rotation.quaternion());
  for (const BundleProblem::Measurement& measurement : other.measurements) {
    const auto index = static_cast<std::size_t>(measurement.camera);
    BundleProblem::Camera& camera = other.cameras[index];
    double* point = other.points[static_cast<std::size_t>(measurement.point)].position.data();
    problem.AddResidualBlock(new ceres::NumericDiffCostFunction<Reprojection, ceres::CENTRAL, 2, 4, 3, 3>(
                                 new Reprojection{camera.model.get(), &measurement}),
                             new ceres::HuberLoss(options.min_sigma), rotation[index].coeffs().data(),
                             camera.camera_from_map.translation.data(), point);
    problem.SetManifold(rotation[index].coeffs().data(), &rotations);
    if (!camera.fixed) continue;
    problem.SetParameterBlockConstant(rotation[index].coeffs().data());
    problem.SetParameterBlockConstant(camera.camera_from_map.translation.data());
  }
  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::DENSE_SCHUR;
  solver.max_num_iterations = 100;
  solver.function_tolerance = 1e-10;
  solver.logging_type = ceres::SILENT;
  ceres::Solver::Summary judge;
  ceres::Solve(solver, &problem, &judge);
  EXPECT_NEAR(summary.final_cost, judge.final_cost, 1e-4 * judge.final_cost);
  for (std::size_t i = 0; i < other.cameras.size(); ++i)
    EXPECT_LT(
        (scene.problem.cameras[i].camera_from_map.translation - other.cameras[i].camera_from_map.translation)
            .norm(),
        1e-4);
}

TEST(AdjustBundleTest, FixedCamerasAndPointsDoNotMove) {
  BundleSceneOptions scene_options;
  scene_options.noise_px = 0.5;
  scene_options.fixed_points = 40;
  BundleScene scene = MakeBundleScene(scene_options);
  const BundleProblem before = scene.problem;
  AdjustBundle(WithIterations(10), &scene.problem);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(scene.problem.cameras[i].camera_from_map.translation,
              before.cameras[i].camera_from_map.translation);
    EXPECT_EQ(scene.problem.cameras[i].camera_from_map.rotation.quaternion().coeffs(),
              before.cameras[i].camera_from_map.rotation.quaternion().coeffs());
  }
  for (std::size_t i = 0; i < 40; ++i) {
    EXPECT_EQ(scene.problem.points[i].position, before.points[i].position);
  }
  EXPECT_NE(scene.problem.points[41].position, before.points[41].position);
}

TEST(AdjustBundleTest, EstimatesAPoseFromFixedPoints) {
  BundleSceneOptions scene_options;
  scene_options.cameras = 1;
  scene_options.fixed_cameras = 0;
  scene_options.fixed_points = scene_options.points;
  BundleScene scene = MakeBundleScene(scene_options);
  const BundleSummary summary = AdjustBundle(WithIterations(30), &scene.problem);
  EXPECT_EQ(summary.outcome, BundleOutcome::kConverged) << Brief(summary);
  EXPECT_LT(WorstCenterError(scene), 1e-6) << Brief(summary);
}

TEST(AdjustBundleTest, EstimatesPointsFromFixedCameras) {
  BundleSceneOptions scene_options;
  scene_options.fixed_cameras = scene_options.cameras;
  BundleScene scene = MakeBundleScene(scene_options);
  const BundleSummary summary = AdjustBundle(WithIterations(30), &scene.problem);
  EXPECT_EQ(summary.outcome, BundleOutcome::kConverged) << Brief(summary);
  EXPECT_LT(WorstPointError(scene), 1e-5) << Brief(summary);
}

TEST(AdjustBundleTest, ReducesTheResidualsToZeroWithNothingFixed) {
  BundleSceneOptions scene_options;
  scene_options.fixed_cameras = 0;
  BundleScene scene = MakeBundleScene(scene_options);
  const BundleSummary summary = AdjustBundle(WithIterations(50), &scene.problem);
  EXPECT_LT(summary.final_cost, kRoundingCost) << Brief(summary);
}

TEST(AdjustBundleTest, ConvergesAtOnceIfNothingIsFree) {
  BundleSceneOptions scene_options;
  scene_options.fixed_cameras = scene_options.cameras;
  scene_options.fixed_points = scene_options.points;
  scene_options.noise_px = 0.5;
  BundleScene scene = MakeBundleScene(scene_options);
  const BundleSummary summary = AdjustBundle(WithIterations(10), &scene.problem);
  EXPECT_EQ(summary.outcome, BundleOutcome::kConverged);
  EXPECT_EQ(summary.iterations, 0);
  EXPECT_NEAR(summary.sigma, 0.5, 0.05);
  BundleProblem empty;
  EXPECT_EQ(AdjustBundle(WithIterations(10), &empty).outcome, BundleOutcome::kConverged);
}

TEST(AdjustBundleTest, PointsBehindTheirCamerasAreOutliersAndDoNotAffectTheRest) {
  for (const RobustLoss loss : {RobustLoss::kTukey, RobustLoss::kHuber}) {
    BundleSceneOptions scene_options;
    scene_options.cameras = 8;
    BundleScene scene = MakeBundleScene(scene_options);
    const std::size_t exact = scene.problem.measurements.size();
    for (int i = 0; i < 20; ++i) {
      scene.problem.points[static_cast<std::size_t>(i)].position.z() *=
          -1;  // behind every camera that measured it
    }
    BundleProblem::Point behind;
    behind.position = {0, 0, -3};
    scene.problem.points.push_back(behind);
    for (int camera = 0; camera < 8; ++camera) {
      scene.problem.measurements.push_back({camera, scene_options.points, {300, 200}, 1, false});
    }
    BundleOptions options = WithIterations(50);
    options.loss = loss;
    const BundleSummary summary = AdjustBundle(options, &scene.problem);
    // The cost of points that cannot be projected remains, and the solver's tolerance is relative to the
    // total.
    EXPECT_LT(WorstCenterError(scene), 1e-4) << Brief(summary);
    for (std::size_t i = exact; i < scene.problem.measurements.size(); ++i) {
      EXPECT_TRUE(scene.problem.measurements[i].outlier);
    }
    EXPECT_EQ(scene.problem.points.back().position, behind.position);
    for (std::size_t i = 0; i < 20; ++i) {
      scene.points[i] = scene.problem.points[i].position;
    }
    EXPECT_LT(WorstPointError(scene), 1e-3) << Brief(summary);
  }
}

TEST(AdjustBundleTest, ANonFinitePointIsAnOutlierAndDoesNotAffectTheRest) {
  BundleScene scene = MakeBundleScene({});
  scene.problem.points[5].position.x() = std::numeric_limits<double>::quiet_NaN();
  const BundleSummary summary = AdjustBundle(WithIterations(50), &scene.problem);
  EXPECT_LT(WorstCenterError(scene), 1e-4) << Brief(summary);
  for (const BundleProblem::Measurement& measurement : scene.problem.measurements) {
    EXPECT_EQ(measurement.outlier, measurement.point == 5);
  }
}

TEST(AdjustBundleTest, APointWithOneMeasurementDoesNotDiverge) {
  BundleSceneOptions scene_options;
  BundleScene scene = MakeBundleScene(scene_options);
  for (const int camera : {0, 4}) {  // a fixed camera and a free one
    BundleScene lone = scene;
    const Eigen::Vector3d in_camera(0.2, 0.1, 3);
    const auto& truth = lone.cameras[static_cast<std::size_t>(camera)];
    const Eigen::Vector3d start = in_camera + Eigen::Vector3d(0.01, -0.02, 0);
    lone.problem.points.push_back({truth.inverse() * start, false});
    lone.points.push_back(truth.inverse() * in_camera);
    const auto pixel = lone.problem.cameras[0].model->Project(in_camera);
    lone.problem.measurements.push_back({camera, scene_options.points, pixel->cast<float>(), 1, false});
    AdjustBundle(WithIterations(50), &lone.problem);
    const Eigen::Vector3d found = truth * lone.problem.points.back().position;
    EXPECT_LT((found.head<2>() / found.z() - in_camera.head<2>() / in_camera.z()).norm(), 1e-6);
    EXPECT_NEAR(found.z(), 3, 0.5);
  }
}

TEST(AdjustBundleTest, NeverIncreasesTheCost) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    BundleSceneOptions scene_options;
    scene_options.seed = seed;
    scene_options.pose_error = 0.3;  // far beyond the errors that the adjustment is designed for
    scene_options.point_error = 1.0;
    scene_options.outlier_ratio = 0.3;
    BundleScene scene = MakeBundleScene(scene_options);
    const BundleSummary summary = AdjustBundle(WithIterations(8), &scene.problem);
    EXPECT_LE(summary.final_cost, summary.initial_cost) << Brief(summary);
    for (const BundleProblem::Camera& camera : scene.problem.cameras) {
      EXPECT_TRUE(camera.camera_from_map.translation.allFinite());
    }
  }
}

TEST(AdjustBundleTest, EqualInputGivesBitwiseEqualOutput) {
  BundleSceneOptions scene_options;
  scene_options.noise_px = 0.7;
  scene_options.outlier_ratio = 0.1;
  BundleScene first = MakeBundleScene(scene_options), second = MakeBundleScene(scene_options);
  const BundleSummary a = AdjustBundle(WithIterations(7), &first.problem);
  const BundleSummary b = AdjustBundle(WithIterations(7), &second.problem);
  EXPECT_TRUE(SameBytes(first.problem, second.problem));
  EXPECT_EQ(std::memcmp(&a.final_cost, &b.final_cost, sizeof(double)), 0);
  EXPECT_EQ(a.iterations, b.iterations);
}

TEST(AdjustBundleTest, AnInterruptAtTheStartChangesNothing) {
  BundleScene scene = MakeBundleScene({});
  const BundleProblem before = scene.problem;
  const std::atomic<bool> interrupt{true};
  BundleOptions options = WithIterations(50);
  options.interrupt = &interrupt;
  const BundleSummary summary = AdjustBundle(options, &scene.problem);
  EXPECT_EQ(summary.outcome, BundleOutcome::kInterrupted);
  EXPECT_EQ(summary.iterations, 0);
  EXPECT_TRUE(SameBytes(scene.problem, before));
}

// Whenever the interrupt occurs, the result is a state that the adjustment passed through. A problem of this
// size takes much longer than the waits, but nothing here depends on that.
TEST(AdjustBundleTest, AnInterruptKeepsTheStateReachedSoFar) {
  BundleSceneOptions scene_options;
  scene_options.cameras = 20;
  scene_options.points = 1500;
  scene_options.noise_px = 0.5;
  int interrupted = 0;
  for (int wait_ms = 1; wait_ms <= 256; wait_ms *= 2) {
    BundleScene scene = MakeBundleScene(scene_options);
    std::atomic<bool> interrupt{false};
    BundleOptions options = WithIterations(200);
    options.interrupt = &interrupt;
    std::thread other([&] {
      std::this_thread::sleep_for(std::chrono::milliseconds(wait_ms));
      interrupt = true;
    });
    const BundleSummary summary = AdjustBundle(options, &scene.problem);
    other.join();
    interrupted += summary.outcome == BundleOutcome::kInterrupted ? 1 : 0;
    EXPECT_LE(summary.final_cost, summary.initial_cost) << Brief(summary);
    // Random poses would not be this close by chance: it is the initial state or a better one.
    EXPECT_LT(WorstCenterError(scene), 0.05 * std::sqrt(3.0)) << Brief(summary);
    if (summary.outcome == BundleOutcome::kConverged) {
      EXPECT_LT(WorstCenterError(scene), 0.01) << Brief(summary);
    }
  }
  EXPECT_GT(interrupted, 0);
}

TEST(EstimateSigmaTest, EstimatesTheSigmaOfNormalResidualsDespiteOutliers) {
  Random random(1);
  std::vector<double> squared_norms;
  for (int i = 0; i < 20000; ++i) {
    squared_norms.push_back(4 * (std::pow(RandomNormal(&random), 2) + std::pow(RandomNormal(&random), 2)));
  }
  EXPECT_NEAR(EstimateSigma(squared_norms), 2, 0.05);
  squared_norms.insert(squared_norms.end(), 5000, 1e6);
  squared_norms.insert(squared_norms.end(), 5000, std::numeric_limits<double>::infinity());
  EXPECT_NEAR(EstimateSigma(squared_norms), 2.3, 0.2);  // a fifth of outliers moves the median by an eighth
  EXPECT_EQ(EstimateSigma({}), 0);
}

TEST(EvaluateLossTest, SlopesAreDerivativesAndLossesAreConcave) {
  for (const RobustLoss loss : {RobustLoss::kTukey, RobustLoss::kHuber}) {
    for (const double s : {0.0, 0.1, 1.0, 3.9, 4.1, 5.0, 8.9, 9.1, 50.0}) {
      const RobustValue value = EvaluateLoss(loss, 2.0, s);
      if (s > 0) {
        const double h = 1e-6;
        const double numeric =
            (EvaluateLoss(loss, 2.0, s + h).cost - EvaluateLoss(loss, 2.0, s - h).cost) / (2 * h);
        EXPECT_NEAR(value.slope, numeric, 1e-6) << s;
      }
      EXPECT_GE(value.cost, s * value.slope - 1e-12) << s;
    }
    EXPECT_EQ(EvaluateLoss(loss, 2.0, 0).slope, 1);
  }
  EXPECT_EQ(EvaluateLoss(RobustLoss::kTukey, 2.0, 4.0).slope, 0);
}

}  // namespace
}  // namespace docent::engine
