// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/bundle/bundle_system.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "engine/mapping/bundle/robust_loss.h"
#include "tests/engine/mapping/bundle/bundle_scene.h"

namespace docent::engine {
namespace {

using SystemOutcome = BundleSystem::Outcome;
constexpr double kThreshold = 15;

// The problem with its unknowns moved by a vector: six numbers for each camera, then three for each point.
BundleProblem MovedBy(const BundleProblem& problem, const Eigen::VectorXd& step) {
  BundleProblem result = problem;
  const auto cameras = static_cast<Eigen::Index>(problem.cameras.size());
  for (Eigen::Index i = 0; i < cameras; ++i) {
    Rigid3& pose = result.cameras[static_cast<std::size_t>(i)].camera_from_map;
    pose = Rigid3::Exp(Vector6(step.segment<6>(6 * i))) * pose;
  }
  for (std::size_t i = 0; i < problem.points.size(); ++i)
    result.points[i].position += step.segment<3>(6 * cameras + static_cast<Eigen::Index>(3 * i));
  return result;
}

// Residuals in sigmas, two for each measurement.
Eigen::VectorXd Residuals(const BundleProblem& problem) {
  Eigen::VectorXd result(static_cast<Eigen::Index>(2 * problem.measurements.size()));
  for (std::size_t i = 0; i < problem.measurements.size(); ++i) {
    const BundleProblem::Measurement& measurement = problem.measurements[i];
    const BundleProblem::Camera& camera = problem.cameras[static_cast<std::size_t>(measurement.camera)];
    const auto pixel = camera.model->Project(
        camera.camera_from_map * problem.points[static_cast<std::size_t>(measurement.point)].position);
    result.segment<2>(static_cast<Eigen::Index>(2 * i)) =
        (pixel.value() - measurement.pixel.cast<double>()) / static_cast<double>(measurement.sigma_px);
  }
  return result;
}

double Cost(const BundleProblem& problem, RobustLoss loss) {
  const Eigen::VectorXd residuals = Residuals(problem);
  std::vector<double> squared_norms;
  for (Eigen::Index i = 0; i < residuals.size(); i += 2)
    squared_norms.push_back(residuals.segment<2>(i).squaredNorm());
  return RobustCost(loss, kThreshold, squared_norms);
}

// The damped normal equations as full matrices, from finite differences of the residuals.
struct Dense {
  Eigen::MatrixXd hessian;
  Eigen::VectorXd gradient;
  std::vector<Eigen::Index> unknowns;  // rows of the free unknowns
};

Dense MakeDense(const BundleProblem& problem, RobustLoss loss) {
  constexpr double kStep = 1e-6;
  const auto cameras = static_cast<Eigen::Index>(problem.cameras.size());
  const auto size = 6 * cameras + static_cast<Eigen::Index>(3 * problem.points.size());
  Dense dense;
  for (Eigen::Index i = 0; i < size; ++i) {
    const bool fixed = i < 6 * cameras
                           ? problem.cameras[static_cast<std::size_t>(i / 6)].fixed
                           : problem.points[static_cast<std::size_t>((i - 6 * cameras) / 3)].fixed;
    if (!fixed) dense.unknowns.push_back(i);
  }
  Eigen::VectorXd residuals = Residuals(problem);
  Eigen::MatrixXd jacobian(residuals.size(), static_cast<Eigen::Index>(dense.unknowns.size()));
  for (std::size_t i = 0; i < dense.unknowns.size(); ++i) {
    const Eigen::VectorXd step = kStep * Eigen::VectorXd::Unit(size, dense.unknowns[i]);
    jacobian.col(static_cast<Eigen::Index>(i)) =
        (Residuals(MovedBy(problem, step)) - Residuals(MovedBy(problem, -step))) / (2 * kStep);
  }
  for (Eigen::Index i = 0; i < residuals.size(); i += 2) {
    const double root =
        std::sqrt(EvaluateLoss(loss, kThreshold, residuals.segment<2>(i).squaredNorm()).slope);
    residuals.segment<2>(i) *= root;
    jacobian.middleRows<2>(i) *= root;
  }
  dense.hessian = jacobian.transpose() * jacobian;
  dense.gradient = jacobian.transpose() * residuals;
  return dense;
}

// The last step of a system that holds the state of the problem; takes the step.
Eigen::VectorXd StepOf(const BundleProblem& problem, const Dense& dense, BundleSystem* system) {
  system->Accept();
  BundleProblem after = problem;
  system->WriteBack(&after);
  const auto cameras = static_cast<Eigen::Index>(problem.cameras.size());
  Eigen::VectorXd full =
      Eigen::VectorXd::Zero(6 * cameras + static_cast<Eigen::Index>(3 * problem.points.size()));
  for (std::size_t i = 0; i < system->free_cameras().size(); ++i)
    full.segment<6>(6 * system->free_cameras()[i]) =
        system->camera_step().segment<6>(static_cast<Eigen::Index>(6 * i));
  for (const int i : system->free_points()) {
    const auto index = static_cast<std::size_t>(i);
    full.segment<3>(6 * cameras + 3 * i) = after.points[index].position - problem.points[index].position;
  }
  return full(dense.unknowns);
}

class BundleSystemTest : public testing::TestWithParam<RobustLoss> {
 protected:
  BundleSystemTest() {
    BundleSceneOptions options;
    options.cameras = 5;
    options.points = 40;
    options.fixed_points = 6;
    options.noise_px = 1;
    options.outlier_ratio = 0.2;
    problem_ = MakeBundleScene(options).problem;
  }

  void ExpectTheDenseStep() {
    constexpr double kDamping = 1e-2;
    BundleSystem system(problem_, GetParam(), nullptr);
    ASSERT_EQ(system.Step(kThreshold, kDamping), SystemOutcome::kDone);
    const Dense dense = MakeDense(problem_, GetParam());
    Eigen::MatrixXd damped = dense.hessian;
    damped.diagonal() += kDamping * dense.hessian.diagonal().cwiseMax(1e-6);
    const Eigen::VectorXd expected = -damped.llt().solve(dense.gradient);
    const Eigen::VectorXd found = StepOf(problem_, dense, &system);
    EXPECT_LT((found - expected).norm(), 1e-5 * expected.norm());
    const double decrease = -dense.gradient.dot(expected) - 0.5 * expected.dot(dense.hessian * expected);
    EXPECT_NEAR(system.predicted_decrease(), decrease, 1e-4 * decrease);
    EXPECT_NEAR(system.max_gradient(), dense.gradient.cwiseAbs().maxCoeff(),
                1e-5 * dense.gradient.cwiseAbs().maxCoeff());
  }
  BundleProblem problem_;
};

TEST_P(BundleSystemTest, TheStepSolvesTheFullDampedNormalEquations) {
  ExpectTheDenseStep();
}

TEST_P(BundleSystemTest, TwoMeasurementsOfAPointInOneImageBothCount) {
  BundleProblem::Measurement again = problem_.measurements.back();  // by a free camera
  again.pixel.x() += 0.7f;
  problem_.measurements.insert(problem_.measurements.begin(), again);
  ExpectTheDenseStep();
}

// The measurements may be in any order.
TEST_P(BundleSystemTest, TheStepDoesNotDependOnTheOrderOfTheMeasurements) {
  std::reverse(problem_.measurements.begin(), problem_.measurements.end());
  ExpectTheDenseStep();
}

TEST_P(BundleSystemTest, TheGradientIsThatOfTheRobustCost) {
  constexpr double kStep = 1e-6;
  const Dense dense = MakeDense(problem_, GetParam());
  const auto size = static_cast<Eigen::Index>(6 * problem_.cameras.size() + 3 * problem_.points.size());
  double steepest = 0;
  for (const Eigen::Index unknown : dense.unknowns) {
    const Eigen::VectorXd step = kStep * Eigen::VectorXd::Unit(size, unknown);
    const double slope =
        (Cost(MovedBy(problem_, step), GetParam()) - Cost(MovedBy(problem_, -step), GetParam())) /
        (2 * kStep);
    steepest = std::max(steepest, std::abs(slope));
  }
  BundleSystem system(problem_, GetParam(), nullptr);
  ASSERT_EQ(system.Step(kThreshold, 1e-4), SystemOutcome::kDone);
  EXPECT_NEAR(system.max_gradient(), steepest, 1e-4 * steepest);
}

TEST_P(BundleSystemTest, TheNormsAfterAStepAreThoseOfTheMovedProblem) {
  BundleSystem system(problem_, GetParam(), nullptr);
  ASSERT_EQ(system.Step(kThreshold, 1e-2), SystemOutcome::kDone);
  const std::vector<double> next = system.next_squared_norms();
  system.Accept();
  EXPECT_EQ(system.squared_norms(), next);
  BundleProblem moved = problem_;
  system.WriteBack(&moved);
  const Eigen::VectorXd residuals = Residuals(moved);
  for (std::size_t i = 0; i < next.size(); ++i) {
    const double expected = residuals.segment<2>(2 * system.measurement_index(i)).squaredNorm();
    EXPECT_NEAR(next[i], expected, 1e-6 * (1 + expected));
  }
  for (std::size_t i = 0; i < problem_.cameras.size(); ++i) {
    if (!problem_.cameras[i].fixed) continue;
    EXPECT_EQ(moved.cameras[i].camera_from_map.translation, problem_.cameras[i].camera_from_map.translation);
  }
}

TEST_P(BundleSystemTest, AnInterruptDuringAStepLeavesTheStateUnchanged) {
  std::atomic<bool> interrupt{false};
  BundleSystem system(problem_, GetParam(), &interrupt);
  const std::vector<double> before = system.squared_norms();
  interrupt = true;
  EXPECT_EQ(system.Step(kThreshold, 1e-2), SystemOutcome::kInterrupted);
  EXPECT_EQ(system.squared_norms(), before);
  interrupt = false;
  EXPECT_EQ(system.Step(kThreshold, 1e-2), SystemOutcome::kDone);
}

INSTANTIATE_TEST_SUITE_P(Losses, BundleSystemTest, testing::Values(RobustLoss::kTukey, RobustLoss::kHuber),
                         [](const auto& parameter) {
                           return parameter.param == RobustLoss::kTukey ? "Tukey" : "Huber";
                         });

}  // namespace
}  // namespace docent::engine
