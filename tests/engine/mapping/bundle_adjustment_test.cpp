// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/bundle_adjustment.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstring>
#include <limits>
#include <thread>
#include <vector>

#include "engine/mapping/bundle_adjustment_evaluation.h"
#include "tests/engine/geometry/transform_laws.h"

namespace docent::engine {
namespace {

using Twist = Eigen::Matrix<double, 6, 1>;
using Outcome = BundleSummary::Outcome;

struct SceneOptions {
  int cameras = 6, fixed_cameras = 2, points = 300, fixed_points = 0;
  double noise_px = 0, pose_error = 0.02, point_error = 0.05, outlier_ratio = 0;
  LensModel lens = LensModel::kRadialTangential;
  std::array<double, 5> distortion = {-0.296609, 0.080818};
  std::uint64_t seed = 1;
};

// Cameras side by side that look at a box of points; every point in view is measured. The fixed ones are
// exact.
struct Scene {
  BundleProblem problem;
  std::vector<Rigid3> cameras;
  std::vector<Eigen::Vector3d> points;
  std::vector<bool> is_outlier;
};

Twist RandomTwist(Random* random, double translation, double rotation) {
  Twist twist;
  twist << RandomVector(random, translation), RandomVector(random, rotation);
  return twist;
}

Scene MakeScene(const SceneOptions& options) {
  Scene scene;
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
    scene.points.emplace_back(random.Uniform(-2, 2), random.Uniform(-1.5, 1.5), random.Uniform(2, 5));
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
      const double sigma_px = 1 << random.Below(3);
      const bool outlier = random.Uniform() < options.outlier_ratio;
      Eigen::Vector2d error(RandomNormal(&random), RandomNormal(&random));
      error *= options.noise_px * sigma_px;
      if (outlier) {
        error += sigma_px * random.Uniform(30, 60) *
                 Eigen::Vector2d(RandomDirection(&random).head<2>().normalized());
      }
      scene.problem.measurements.push_back({camera, point, *pixel + error, sigma_px, false});
      scene.is_outlier.push_back(outlier);
    }
  }
  return scene;
}

double WorstCenterError(const Scene& scene) {
  double worst = 0;
  for (std::size_t i = 0; i < scene.cameras.size(); ++i) {
    worst = std::max(
        worst, (scene.problem.cameras[i].camera_from_map.OriginInSource() - scene.cameras[i].OriginInSource())
                   .norm());
  }
  return worst;
}

// Over the points that several cameras see: the others' depth is open.
double WorstPointError(const Scene& scene) {
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

BundleOptions WithIterations(int iterations) {
  BundleOptions options;
  options.max_iterations = iterations;
  return options;
}

TEST(AdjustBundleTest, ExactMeasurementsLeadBackToTheTruthThroughEveryLens) {
  const std::vector<std::pair<LensModel, std::array<double, 5>>> lenses = {
      {LensModel::kRadialTangential, {-0.296609, 0.080818, 0.001, -0.002}},
      {LensModel::kFov, {0.93}},
      {LensModel::kKannalaBrandt, {-0.013, 0.021, -0.0035, 0.0012}}};
  for (const auto& [lens, distortion] : lenses) {
    for (const RobustLoss loss : {RobustLoss::kTukey, RobustLoss::kHuber}) {
      SceneOptions scene_options;
      scene_options.lens = lens;
      scene_options.distortion = distortion;
      Scene scene = MakeScene(scene_options);
      BundleOptions options = WithIterations(50);
      options.loss = loss;
      const BundleSummary summary = AdjustBundle(options, &scene.problem);
      EXPECT_EQ(summary.outcome, Outcome::kConverged) << summary.Brief();
      EXPECT_LT(WorstCenterError(scene), 1e-6) << summary.Brief();
      EXPECT_LT(WorstPointError(scene), 1e-4) << summary.Brief();
      EXPECT_EQ(summary.outliers, 0) << summary.Brief();
      EXPECT_LT(summary.final_cost, 1e-9) << summary.Brief();
    }
  }
}

TEST(AdjustBundleTest, NoisyMeasurementsLeadNearTheTruthAndTellTheirSigma) {
  SceneOptions scene_options;
  scene_options.cameras = 12;
  scene_options.noise_px = 0.8;
  Scene scene = MakeScene(scene_options);
  const BundleSummary summary = AdjustBundle(WithIterations(30), &scene.problem);
  EXPECT_EQ(summary.outcome, Outcome::kConverged) << summary.Brief();
  // Twelve measurements of a point, 24 numbers, fix its three: the residuals keep 7/8 of the variance.
  EXPECT_NEAR(summary.sigma, 0.8 * std::sqrt(7.0 / 8), 0.05) << summary.Brief();
  EXPECT_LT(WorstCenterError(scene), 0.01);
  EXPECT_LT(summary.outliers, static_cast<int>(scene.problem.measurements.size() / 200));
}

TEST(AdjustBundleTest, FindsTheOutliersAndOnlyThem) {
  SceneOptions scene_options;
  scene_options.cameras = 10;
  scene_options.noise_px = 0.5;
  scene_options.outlier_ratio = 0.1;
  for (const RobustLoss loss : {RobustLoss::kTukey, RobustLoss::kHuber}) {
    Scene scene = MakeScene(scene_options);
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
    // Huber's loss still gives each outlier some pull, which a point with few measurements cannot resist.
    const int allowed = static_cast<int>(scene.is_outlier.size()) / (loss == RobustLoss::kTukey ? 100 : 50);
    EXPECT_LE(missed, loss == RobustLoss::kTukey ? 0 : 5) << summary.Brief();
    EXPECT_LT(false_alarms, allowed) << summary.Brief();
    EXPECT_LT(WorstCenterError(scene), loss == RobustLoss::kTukey ? 0.01 : 0.03) << summary.Brief();
  }
}

TEST(AdjustBundleTest, FixedCamerasAndPointsDoNotMove) {
  SceneOptions scene_options;
  scene_options.noise_px = 0.5;
  scene_options.fixed_points = 40;
  Scene scene = MakeScene(scene_options);
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

TEST(AdjustBundleTest, FindsAPoseAmongFixedPoints) {
  SceneOptions scene_options;
  scene_options.cameras = 1;
  scene_options.fixed_cameras = 0;
  scene_options.fixed_points = scene_options.points;
  Scene scene = MakeScene(scene_options);
  const BundleSummary summary = AdjustBundle(WithIterations(30), &scene.problem);
  EXPECT_EQ(summary.outcome, Outcome::kConverged) << summary.Brief();
  EXPECT_LT(WorstCenterError(scene), 1e-9) << summary.Brief();
}

TEST(AdjustBundleTest, FindsPointsAmongFixedCameras) {
  SceneOptions scene_options;
  scene_options.fixed_cameras = scene_options.cameras;
  Scene scene = MakeScene(scene_options);
  const BundleSummary summary = AdjustBundle(WithIterations(30), &scene.problem);
  EXPECT_EQ(summary.outcome, Outcome::kConverged) << summary.Brief();
  EXPECT_LT(WorstPointError(scene), 1e-5) << summary.Brief();
}

TEST(AdjustBundleTest, WithNothingFixedTheResidualsStillVanish) {
  SceneOptions scene_options;
  scene_options.fixed_cameras = 0;
  Scene scene = MakeScene(scene_options);
  const BundleSummary summary = AdjustBundle(WithIterations(50), &scene.problem);
  EXPECT_LT(summary.final_cost, 1e-9) << summary.Brief();
}

TEST(AdjustBundleTest, NothingFreeIsNothingToDo) {
  SceneOptions scene_options;
  scene_options.fixed_cameras = scene_options.cameras;
  scene_options.fixed_points = scene_options.points;
  scene_options.noise_px = 0.5;
  Scene scene = MakeScene(scene_options);
  const BundleSummary summary = AdjustBundle(WithIterations(10), &scene.problem);
  EXPECT_EQ(summary.outcome, Outcome::kConverged);
  EXPECT_EQ(summary.iterations, 0);
  EXPECT_NEAR(summary.sigma, 0.5, 0.05);
  BundleProblem empty;
  EXPECT_EQ(AdjustBundle(WithIterations(10), &empty).outcome, Outcome::kConverged);
}

TEST(AdjustBundleTest, PointsBehindTheirCamerasAreOutliersAndHarmNothing) {
  for (const RobustLoss loss : {RobustLoss::kTukey, RobustLoss::kHuber}) {
    SceneOptions scene_options;
    scene_options.cameras = 8;
    Scene scene = MakeScene(scene_options);
    const std::size_t exact = scene.problem.measurements.size();
    for (int i = 0; i < 20; ++i) {
      scene.problem.points[static_cast<std::size_t>(i)].position.z() *=
          -1;  // every measurement of it is behind
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
    // The cost of what cannot be projected stays, and the solver's tolerance is relative to the whole.
    EXPECT_LT(WorstCenterError(scene), 1e-4) << summary.Brief();
    for (std::size_t i = exact; i < scene.problem.measurements.size(); ++i) {
      EXPECT_TRUE(scene.problem.measurements[i].outlier);
    }
    EXPECT_EQ(scene.problem.points.back().position, behind.position);
    for (std::size_t i = 0; i < 20; ++i) {
      scene.points[i] = scene.problem.points[i].position;
    }
    EXPECT_LT(WorstPointError(scene), 1e-3) << summary.Brief();
  }
}

TEST(AdjustBundleTest, APointThatIsNoNumberIsAnOutlierAndHarmsNothing) {
  Scene scene = MakeScene({});
  scene.problem.points[5].position.x() = std::numeric_limits<double>::quiet_NaN();
  const BundleSummary summary = AdjustBundle(WithIterations(50), &scene.problem);
  EXPECT_LT(WorstCenterError(scene), 1e-4) << summary.Brief();
  for (const BundleProblem::Measurement& measurement : scene.problem.measurements) {
    EXPECT_EQ(measurement.outlier, measurement.point == 5);
  }
}

TEST(AdjustBundleTest, APointWithOneMeasurementDoesNotRunAway) {
  SceneOptions scene_options;
  Scene scene = MakeScene(scene_options);
  for (const int camera : {0, 4}) {  // a fixed one and a free one
    Scene lone = scene;
    const Eigen::Vector3d in_camera(0.2, 0.1, 3);
    const auto& truth = lone.cameras[static_cast<std::size_t>(camera)];
    const Eigen::Vector3d start = in_camera + Eigen::Vector3d(0.01, -0.02, 0);
    lone.problem.points.push_back({truth.inverse() * start, false});
    lone.points.push_back(truth.inverse() * in_camera);
    const auto pixel = lone.problem.cameras[0].model->Project(in_camera);
    lone.problem.measurements.push_back({camera, scene_options.points, *pixel, 1, false});
    AdjustBundle(WithIterations(50), &lone.problem);
    const Eigen::Vector3d found = truth * lone.problem.points.back().position;
    EXPECT_LT((found.head<2>() / found.z() - in_camera.head<2>() / in_camera.z()).norm(), 1e-6);
    EXPECT_NEAR(found.z(), 3, 0.5);
  }
}

TEST(AdjustBundleTest, NeverEndsWorseThanItBegan) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    SceneOptions scene_options;
    scene_options.seed = seed;
    scene_options.pose_error = 0.3;  // far outside what the adjustment is made for
    scene_options.point_error = 1.0;
    scene_options.outlier_ratio = 0.3;
    Scene scene = MakeScene(scene_options);
    const BundleSummary summary = AdjustBundle(WithIterations(8), &scene.problem);
    EXPECT_LE(summary.final_cost, summary.initial_cost) << summary.Brief();
    for (const BundleProblem::Camera& camera : scene.problem.cameras) {
      EXPECT_TRUE(camera.camera_from_map.translation.allFinite());
    }
  }
}

TEST(AdjustBundleTest, TheSameInputGivesTheSameBytes) {
  SceneOptions scene_options;
  scene_options.noise_px = 0.7;
  scene_options.outlier_ratio = 0.1;
  Scene first = MakeScene(scene_options), second = MakeScene(scene_options);
  const BundleSummary a = AdjustBundle(WithIterations(7), &first.problem);
  const BundleSummary b = AdjustBundle(WithIterations(7), &second.problem);
  EXPECT_TRUE(SameBytes(first.problem, second.problem));
  EXPECT_EQ(std::memcmp(&a.final_cost, &b.final_cost, sizeof(double)), 0);
  EXPECT_EQ(a.iterations, b.iterations);
}

TEST(AdjustBundleTest, AnInterruptFromTheBeginningChangesNothing) {
  Scene scene = MakeScene({});
  const BundleProblem before = scene.problem;
  const std::atomic<bool> interrupt{true};
  BundleOptions options = WithIterations(50);
  options.interrupt = &interrupt;
  const BundleSummary summary = AdjustBundle(options, &scene.problem);
  EXPECT_EQ(summary.outcome, Outcome::kInterrupted);
  EXPECT_EQ(summary.iterations, 0);
  EXPECT_TRUE(SameBytes(scene.problem, before));
}

// Wherever the interrupt falls, the result is a state that the adjustment passed through. A problem of this
// size takes much longer than the waits, but nothing here depends on that.
TEST(AdjustBundleTest, AnInterruptOnTheWayKeepsWhatWasReached) {
  SceneOptions scene_options;
  scene_options.cameras = 20;
  scene_options.points = 1500;
  scene_options.noise_px = 0.5;
  int interrupted = 0;
  for (int wait_ms = 1; wait_ms <= 256; wait_ms *= 2) {
    Scene scene = MakeScene(scene_options);
    std::atomic<bool> interrupt{false};
    BundleOptions options = WithIterations(200);
    options.interrupt = &interrupt;
    std::thread other([&] {
      std::this_thread::sleep_for(std::chrono::milliseconds(wait_ms));
      interrupt = true;
    });
    const BundleSummary summary = AdjustBundle(options, &scene.problem);
    other.join();
    interrupted += summary.outcome == Outcome::kInterrupted ? 1 : 0;
    EXPECT_LE(summary.final_cost, summary.initial_cost) << summary.Brief();
    // A random move of the poses' own size never ends this near by chance: it is the start or better.
    EXPECT_LT(WorstCenterError(scene), 0.05 * std::sqrt(3.0)) << summary.Brief();
    if (summary.outcome == Outcome::kConverged) {
      EXPECT_LT(WorstCenterError(scene), 0.01) << summary.Brief();
    }
  }
  EXPECT_GT(interrupted, 0);
}

TEST(AdjustBundleTest, TheBriefSaysWhatHappened) {
  Scene scene = MakeScene({});
  const std::string brief = AdjustBundle(WithIterations(50), &scene.problem).Brief();
  EXPECT_EQ(brief.find("converged after"), 0u) << brief;
}

TEST(EstimateSigmaTest, FindsTheSigmaOfNormalResidualsDespiteOutliers) {
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

double TotalCost(const BundleEvaluation& evaluation) {
  double sum = evaluation.remainder() * evaluation.remainder();
  for (const BundleEvaluation::Pair& pair : evaluation.pairs()) {
    sum += pair.residual[0] * pair.residual[0] + pair.residual[1] * pair.residual[1];
  }
  for (const BundleEvaluation::Condensed& condensed : evaluation.condensed()) {
    for (const double residual : condensed.residual) {
      sum += residual * residual;
    }
  }
  return 0.5 * sum;
}

// Gradient with respect to all poses (six each) and points (three each), put together from the blocks.
Eigen::VectorXd Gradient(const BundleEvaluation& evaluation, const BundleProblem& problem) {
  const auto poses = static_cast<Eigen::Index>(6 * problem.cameras.size());
  Eigen::VectorXd gradient =
      Eigen::VectorXd::Zero(poses + static_cast<Eigen::Index>(3 * problem.points.size()));
  for (const BundleEvaluation::Pair& pair : evaluation.pairs()) {
    for (int row = 0; row < 2; ++row) {
      const double residual = pair.residual[static_cast<std::size_t>(row)];
      gradient.segment<6>(6 * pair.camera) +=
          residual * Eigen::Map<const Twist>(pair.by_pose.data() + row * BundleEvaluation::kPoseSize);
      gradient.segment<3>(poses + 3 * pair.point) +=
          residual * Eigen::Map<const Eigen::Vector3d>(pair.by_point.data() + row * 3);
    }
  }
  for (const BundleEvaluation::Condensed& condensed : evaluation.condensed()) {
    for (int row = 0; row < 4; ++row) {
      gradient.segment<3>(poses + 3 * condensed.point) +=
          condensed.residual[static_cast<std::size_t>(row)] *
          Eigen::Map<const Eigen::Vector3d>(condensed.by_point.data() + row * 3);
    }
  }
  return gradient;
}

class BundleEvaluationTest : public testing::TestWithParam<RobustLoss> {
 protected:
  BundleEvaluationTest() {
    SceneOptions options;
    options.cameras = 5;
    options.points = 30;
    options.noise_px = 1;
    options.outlier_ratio = 0.2;
    scene_ = MakeScene(options);
  }
  Scene scene_;
};

TEST_P(BundleEvaluationTest, TheBlocksAddUpToTheRobustCost) {
  BundleEvaluation evaluation(scene_.problem, GetParam(), nullptr);
  evaluation.set_threshold(15);
  ASSERT_TRUE(evaluation.Evaluate(false));
  const double expected = RobustCost(GetParam(), 15, evaluation.squared_norms());
  EXPECT_NEAR(TotalCost(evaluation), expected, 1e-9 * expected);
  ASSERT_TRUE(evaluation.Evaluate(true));
  EXPECT_NEAR(TotalCost(evaluation), expected, 1e-9 * expected);
}

TEST_P(BundleEvaluationTest, JacobiansGiveTheRobustCostsNumericGradient) {
  BundleEvaluation evaluation(scene_.problem, GetParam(), nullptr);
  evaluation.set_threshold(15);
  ASSERT_TRUE(evaluation.Evaluate(true));
  const Eigen::VectorXd gradient = Gradient(evaluation, scene_.problem);
  const auto cost = [&] {
    EXPECT_TRUE(evaluation.Evaluate(false));
    return RobustCost(GetParam(), 15, evaluation.squared_norms());
  };
  constexpr double kStep = 1e-6;
  for (int camera = 0; camera < 5; ++camera) {
    double* state = evaluation.pose_state(camera);
    const Rigid3 pose = BundleEvaluation::UnpackPose(state);
    for (int axis = 0; axis < 6; ++axis) {
      const Twist step = kStep * Twist::Unit(axis);
      BundleEvaluation::PackPose(Rigid3::Exp(step) * pose, state);
      const double plus = cost();
      BundleEvaluation::PackPose(Rigid3::Exp(-step) * pose, state);
      const double minus = cost();
      BundleEvaluation::PackPose(pose, state);
      const double expected = camera < 2 ? 0 : (plus - minus) / (2 * kStep);
      EXPECT_NEAR(gradient[6 * camera + axis], expected, 1e-5 * gradient.norm()) << camera << ' ' << axis;
    }
  }
  for (int point = 0; point < 30; ++point) {
    double* state = evaluation.point_state(point);
    for (int axis = 0; axis < 3; ++axis) {
      const double start = state[axis];
      state[axis] = start + kStep;
      const double plus = cost();
      state[axis] = start - kStep;
      const double minus = cost();
      state[axis] = start;
      EXPECT_NEAR(gradient[6 * 5 + 3 * point + axis], (plus - minus) / (2 * kStep), 1e-5 * gradient.norm());
    }
  }
}

// The residuals of one point's fixed cameras, written out one by one, have the condensed block's J^T J.
TEST_P(BundleEvaluationTest, CondensingKeepsTheNormalEquations) {
  BundleEvaluation evaluation(scene_.problem, GetParam(), nullptr);
  evaluation.set_threshold(15);
  ASSERT_TRUE(evaluation.Evaluate(true));
  for (const BundleEvaluation::Condensed& condensed : evaluation.condensed()) {
    Eigen::Matrix3d expected = Eigen::Matrix3d::Zero();
    for (const BundleProblem::Measurement& measurement : scene_.problem.measurements) {
      const BundleProblem::Camera& camera =
          scene_.problem.cameras[static_cast<std::size_t>(measurement.camera)];
      if (measurement.point != condensed.point || !camera.fixed) {
        continue;
      }
      Eigen::Vector2d pixel;
      Eigen::Matrix<double, 2, 3> jacobian;
      const Eigen::Vector3d& position =
          scene_.problem.points[static_cast<std::size_t>(condensed.point)].position;
      ASSERT_TRUE(camera.model->Project(camera.camera_from_map * position, &pixel, &jacobian));
      jacobian = (jacobian * camera.camera_from_map.rotation.matrix() / measurement.sigma_px).eval();
      const double squared_norm = ((pixel - measurement.pixel) / measurement.sigma_px).squaredNorm();
      expected += EvaluateLoss(GetParam(), 15, squared_norm).slope * jacobian.transpose() * jacobian;
    }
    const Eigen::Map<const Eigen::Matrix<double, 4, 3, Eigen::RowMajor>> by_point(condensed.by_point.data());
    EXPECT_LT((by_point.transpose() * by_point - expected).norm(), 1e-9 * (1 + expected.norm()));
  }
}

TEST_P(BundleEvaluationTest, ATighterThresholdLeavesTheCostContinuous) {
  BundleEvaluation evaluation(scene_.problem, GetParam(), nullptr);
  evaluation.set_threshold(30);
  ASSERT_TRUE(evaluation.Evaluate(false));
  const double before = TotalCost(evaluation);
  evaluation.TightenThreshold(8);
  ASSERT_TRUE(evaluation.Evaluate(true));
  EXPECT_NEAR(TotalCost(evaluation), before, 1e-9 * before);
}

TEST_P(BundleEvaluationTest, AnInterruptIsSeenInsideAnEvaluation) {
  std::atomic<bool> interrupt{false};
  BundleEvaluation evaluation(scene_.problem, GetParam(), &interrupt);
  EXPECT_TRUE(evaluation.Evaluate(true));
  interrupt = true;
  EXPECT_FALSE(evaluation.Evaluate(true));
}

INSTANTIATE_TEST_SUITE_P(Losses, BundleEvaluationTest,
                         testing::Values(RobustLoss::kTukey, RobustLoss::kHuber), [](const auto& parameter) {
                           return parameter.param == RobustLoss::kTukey ? "Tukey" : "Huber";
                         });

}  // namespace
}  // namespace docent::engine
