// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/bundle_adjustment.h"

#include <ceres/evaluation_callback.h>
#include <ceres/iteration_callback.h>
#include <ceres/manifold.h>
#include <ceres/problem.h>
#include <ceres/sized_cost_function.h>
#include <ceres/solver.h>
#include <glog/logging.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <deque>
#include <memory>

#include "engine/mapping/bundle_adjustment_evaluation.h"

namespace docent::engine {
namespace {

constexpr int kPoseSize = BundleEvaluation::kPoseSize;
// Up to this many free cameras the reduced camera system is solved as a dense matrix.
constexpr int kMaxDenseCameras = 300;
// The robust threshold follows the residuals when they ask for less than this part of the one in use, and the
// solver is started again when at its end the two differ by more than the second.
constexpr double kThresholdDrop = 0.8;
constexpr double kThresholdChange = 0.1;

// Poses under Exp(twist) * camera_from_map. Jacobians are kept with respect to the twist itself throughout
// (see BundleEvaluation::Pair), so the manifold's own Jacobian only drops their empty seventh column.
class PoseManifold final : public ceres::Manifold {
 public:
  int AmbientSize() const override { return kPoseSize; }
  int TangentSize() const override { return 6; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override {
    const Eigen::Map<const Eigen::Matrix<double, 6, 1>> twist(delta);
    BundleEvaluation::PackPose(Rigid3::Exp(twist) * BundleEvaluation::UnpackPose(x), x_plus_delta);
    return true;
  }
  bool PlusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, kPoseSize, 6, Eigen::RowMajor>>(jacobian).setIdentity();
    return true;
  }
  bool Minus(const double* y, const double* x, double* y_minus_x) const override {
    Eigen::Map<Eigen::Matrix<double, 6, 1>> twist(y_minus_x);
    twist = (BundleEvaluation::UnpackPose(y) * BundleEvaluation::UnpackPose(x).inverse()).Log();
    return true;
  }
  bool MinusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 6, kPoseSize, Eigen::RowMajor>>(jacobian).setIdentity();
    return true;
  }
};

// What the cost functions hand on: the outputs that BundleEvaluation has worked out just before. Where it was
// cut short they make the solver stop without a sound: they refuse a state that is only tried out, and at one
// that has been accepted they show a stationary point.
struct Evaluated {
  enum class State { kComplete, kRefuse, kStopHere };
  BundleEvaluation* evaluation = nullptr;
  State state = State::kRefuse;

  bool Copy(const double* from, std::size_t count, double* to) const {
    if (to == nullptr) {
      return true;
    }
    if (state == State::kComplete) {
      std::copy_n(from, count, to);
    } else {
      std::fill_n(to, count, 0.0);
    }
    return state != State::kRefuse;
  }
};

class PairCost final : public ceres::SizedCostFunction<2, kPoseSize, 3> {
 public:
  PairCost(const Evaluated* evaluated, const BundleEvaluation::Pair* pair)
      : evaluated_(evaluated), pair_(pair) {}
  bool Evaluate(double const* const*, double* residuals, double** jacobians) const override {
    if (jacobians != nullptr) {
      evaluated_->Copy(pair_->by_pose.data(), pair_->by_pose.size(), jacobians[0]);
      evaluated_->Copy(pair_->by_point.data(), pair_->by_point.size(), jacobians[1]);
    }
    return evaluated_->Copy(pair_->residual.data(), 2, residuals);
  }

 private:
  const Evaluated* evaluated_;
  const BundleEvaluation::Pair* pair_;
};

class PoseCost final : public ceres::SizedCostFunction<2, kPoseSize> {
 public:
  PoseCost(const Evaluated* evaluated, const BundleEvaluation::Pair* pair)
      : evaluated_(evaluated), pair_(pair) {}
  bool Evaluate(double const* const*, double* residuals, double** jacobians) const override {
    if (jacobians != nullptr) {
      evaluated_->Copy(pair_->by_pose.data(), pair_->by_pose.size(), jacobians[0]);
    }
    return evaluated_->Copy(pair_->residual.data(), 2, residuals);
  }

 private:
  const Evaluated* evaluated_;
  const BundleEvaluation::Pair* pair_;
};

// Half of a condensed point: the solver's elimination is specialised for blocks of two rows.
class CondensedCost final : public ceres::SizedCostFunction<2, 3> {
 public:
  CondensedCost(const Evaluated* evaluated, const BundleEvaluation::Condensed* condensed, int half)
      : evaluated_(evaluated),
        residual_(condensed->residual.data() + 2 * half),
        by_point_(condensed->by_point.data() + 6 * half) {}
  bool Evaluate(double const* const*, double* residuals, double** jacobians) const override {
    if (jacobians != nullptr) {
      evaluated_->Copy(by_point_, 6, jacobians[0]);
    }
    return evaluated_->Copy(residual_, 2, residuals);
  }

 private:
  const Evaluated* evaluated_;
  const double* residual_;
  const double* by_point_;
};

// The part of the robust cost that no step is expected to change. It hangs on a variable of its own, which
// nothing else depends on, because the solver wants one.
class RemainderCost final : public ceres::SizedCostFunction<1, 1> {
 public:
  explicit RemainderCost(const Evaluated* evaluated) : evaluated_(evaluated) {}
  bool Evaluate(double const* const*, double* residuals, double** jacobians) const override {
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      jacobians[0][0] = 0;
    }
    const double remainder = evaluated_->evaluation->remainder();
    return evaluated_->Copy(&remainder, 1, residuals);
  }

 private:
  const Evaluated* evaluated_;
};

double RobustThreshold(const BundleOptions& options, double sigma) {
  return options.threshold_factor * std::max(options.min_sigma, sigma);
}

// Works everything out before the solver collects it, and tightens the robust threshold at each accepted
// state as the residuals shrink (the solver asks there for the Jacobians of the point whose cost it already
// has).
class Evaluator final : public ceres::EvaluationCallback {
 public:
  Evaluator(const BundleOptions& options, Evaluated* evaluated) : options_(options), evaluated_(evaluated) {}
  void PrepareForEvaluation(bool evaluate_jacobians, bool new_evaluation_point) override {
    BundleEvaluation& evaluation = *evaluated_->evaluation;
    if (evaluate_jacobians && !new_evaluation_point && evaluated_->state == Evaluated::State::kComplete) {
      const double threshold = RobustThreshold(options_, EstimateSigma(evaluation.squared_norms()));
      if (threshold < kThresholdDrop * evaluation.threshold()) {
        evaluation.TightenThreshold(threshold);
      }
    }
    if (evaluation.Evaluate(evaluate_jacobians)) {
      evaluated_->state = Evaluated::State::kComplete;
    } else {
      evaluated_->state = evaluate_jacobians ? Evaluated::State::kStopHere : Evaluated::State::kRefuse;
    }
  }

 private:
  const BundleOptions& options_;
  Evaluated* evaluated_;
};

class InterruptCallback final : public ceres::IterationCallback {
 public:
  explicit InterruptCallback(const BundleEvaluation& evaluation) : evaluation_(evaluation) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary&) override {
    return evaluation_.interrupted() ? ceres::SOLVER_TERMINATE_SUCCESSFULLY : ceres::SOLVER_CONTINUE;
  }

 private:
  const BundleEvaluation& evaluation_;
};

// The solver's view of a problem. Everything that it points to lives here, in a few containers whose
// elements stay where they are (cost functions can be neither copied nor moved).
class SolverProblem {
 public:
  SolverProblem(const BundleOptions& options, const BundleProblem& problem, BundleEvaluation* evaluation)
      : evaluated_{evaluation},
        evaluator_(options, &evaluated_),
        remainder_cost_(&evaluated_),
        problem_(ProblemOptions()) {
    MakeCosts();
    std::vector<char> is_pose_used(problem.cameras.size(), 0), is_point_used(problem.points.size(), 0);
    for (const BundleEvaluation::Pair& pair : evaluation->pairs()) {
      is_pose_used[static_cast<std::size_t>(pair.camera)] = 1;
      is_point_used[static_cast<std::size_t>(pair.point)] |= evaluation->is_point_free(pair.point);
    }
    for (const BundleEvaluation::Condensed& condensed : evaluation->condensed()) {
      is_point_used[static_cast<std::size_t>(condensed.point)] = 1;
    }
    ordering_ = std::make_shared<ceres::ParameterBlockOrdering>();
    for (std::size_t i = 0; i < is_point_used.size(); ++i) {
      if (is_point_used[i]) {
        double* state = evaluation->point_state(static_cast<int>(i));
        problem_.AddParameterBlock(state, 3);
        ordering_->AddElementToGroup(state, 0);
        ++point_count_;
      }
    }
    for (std::size_t i = 0; i < is_pose_used.size(); ++i) {
      if (is_pose_used[i]) {
        double* state = evaluation->pose_state(static_cast<int>(i));
        problem_.AddParameterBlock(state, kPoseSize, &manifold_);
        ordering_->AddElementToGroup(state, 1);
        ++pose_count_;
      }
    }
    problem_.AddParameterBlock(&remainder_variable_, 1);
    ordering_->AddElementToGroup(&remainder_variable_, 1);
    AddCosts();
  }

  bool empty() const { return point_count_ + pose_count_ == 0; }

  ceres::Solver::Summary Solve(int max_iterations, double trust_region_radius,
                               ceres::IterationCallback* callback) {
    ceres::Solver::Options options;
    options.max_num_iterations = max_iterations;
    options.initial_trust_region_radius = trust_region_radius;
    options.function_tolerance = 1e-6;
    options.parameter_tolerance = 1e-9;
    options.num_threads = 1;
    options.jacobi_scaling = false;  // the damping scales each column by itself
    options.logging_type = ceres::SILENT;
    options.callbacks.push_back(callback);
    if (point_count_ == 0) {
      options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
    } else {
      options.linear_solver_type = pose_count_ <= kMaxDenseCameras ? ceres::DENSE_SCHUR : ceres::SPARSE_SCHUR;
      options.linear_solver_ordering = std::make_shared<ceres::ParameterBlockOrdering>(*ordering_);
    }
    evaluated_.state = Evaluated::State::kRefuse;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem_, &summary);
    return summary;
  }

 private:
  ceres::Problem::Options ProblemOptions() {
    ceres::Problem::Options options;
    options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    options.enable_fast_removal = false;
    options.disable_all_safety_checks = true;
    options.evaluation_callback = &evaluator_;
    return options;
  }

  void MakeCosts() {
    const BundleEvaluation& evaluation = *evaluated_.evaluation;
    for (const BundleEvaluation::Pair& pair : evaluation.pairs()) {
      if (!evaluation.is_point_free(pair.point)) {
        pose_costs_.emplace_back(&evaluated_, &pair);
        pose_pairs_.push_back(&pair);
      } else {
        pair_costs_.emplace_back(&evaluated_, &pair);
        point_pairs_.push_back(&pair);
      }
    }
    for (const BundleEvaluation::Condensed& condensed : evaluation.condensed()) {
      condensed_costs_.emplace_back(&evaluated_, &condensed, 0);
      condensed_costs_.emplace_back(&evaluated_, &condensed, 1);
    }
  }

  void AddCosts() {
    BundleEvaluation& evaluation = *evaluated_.evaluation;
    for (std::size_t i = 0; i < pair_costs_.size(); ++i) {
      problem_.AddResidualBlock(&pair_costs_[i], nullptr, evaluation.pose_state(point_pairs_[i]->camera),
                                evaluation.point_state(point_pairs_[i]->point));
    }
    for (std::size_t i = 0; i < condensed_costs_.size(); ++i) {
      problem_.AddResidualBlock(&condensed_costs_[i], nullptr,
                                evaluation.point_state(evaluation.condensed()[i / 2].point));
    }
    for (std::size_t i = 0; i < pose_costs_.size(); ++i) {
      problem_.AddResidualBlock(&pose_costs_[i], nullptr, evaluation.pose_state(pose_pairs_[i]->camera));
    }
    problem_.AddResidualBlock(&remainder_cost_, nullptr, &remainder_variable_);
  }

  Evaluated evaluated_;
  Evaluator evaluator_;
  PoseManifold manifold_;
  std::vector<const BundleEvaluation::Pair*> point_pairs_, pose_pairs_;
  std::deque<PairCost> pair_costs_;
  std::deque<PoseCost> pose_costs_;
  std::deque<CondensedCost> condensed_costs_;
  RemainderCost remainder_cost_;
  double remainder_variable_ = 0;
  int point_count_ = 0, pose_count_ = 0;
  std::shared_ptr<ceres::ParameterBlockOrdering> ordering_;
  ceres::Problem problem_;  // last: it is destroyed before what it points to
};

BundleSummary::Outcome RunRounds(const BundleOptions& options, SolverProblem* solver,
                                 BundleEvaluation* evaluation, BundleSummary* summary) {
  using Outcome = BundleSummary::Outcome;
  InterruptCallback callback(*evaluation);
  double trust_region_radius = 1e4;
  while (summary->iterations < options.max_iterations) {
    const ceres::Solver::Summary round =
        solver->Solve(options.max_iterations - summary->iterations, trust_region_radius, &callback);
    summary->iterations += std::max(0, static_cast<int>(round.iterations.size()) - 1);
    if (evaluation->interrupted()) {
      return Outcome::kInterrupted;
    }
    if (round.termination_type == ceres::FAILURE || round.iterations.empty()) {
      return Outcome::kFailed;
    }
    trust_region_radius = std::max(1e4, round.iterations.back().trust_region_radius);
    if (!evaluation->Evaluate(false)) {
      return Outcome::kInterrupted;
    }
    const double threshold = RobustThreshold(options, EstimateSigma(evaluation->squared_norms()));
    const bool is_settled =
        std::abs(threshold - evaluation->threshold()) < kThresholdChange * evaluation->threshold();
    if (round.termination_type == ceres::CONVERGENCE && is_settled) {
      return Outcome::kConverged;
    }
    if (round.termination_type == ceres::NO_CONVERGENCE) {
      return Outcome::kIterationLimit;
    }
    evaluation->set_threshold(threshold);
  }
  return Outcome::kIterationLimit;
}

void WriteBack(BundleEvaluation* evaluation, BundleProblem* problem) {
  for (std::size_t i = 0; i < problem->cameras.size(); ++i) {
    if (evaluation->is_camera_free(static_cast<int>(i))) {
      problem->cameras[i].camera_from_map =
          BundleEvaluation::UnpackPose(evaluation->pose_state(static_cast<int>(i)));
    }
  }
  for (std::size_t i = 0; i < problem->points.size(); ++i) {
    if (evaluation->is_point_free(static_cast<int>(i))) {
      problem->points[i].position =
          Eigen::Map<const Eigen::Vector3d>(evaluation->point_state(static_cast<int>(i)));
    }
  }
}

void MarkOutliers(double threshold, const BundleEvaluation& evaluation,
                  const std::vector<double>& squared_norms, BundleProblem* problem, BundleSummary* summary) {
  summary->outliers = 0;
  for (std::size_t i = 0; i < squared_norms.size(); ++i) {
    const bool outlier = !(squared_norms[i] < threshold * threshold);
    problem->measurements[static_cast<std::size_t>(evaluation.measurement_index(i))].outlier = outlier;
    summary->outliers += outlier ? 1 : 0;
  }
}

const char* Name(BundleSummary::Outcome outcome) {
  switch (outcome) {
    case BundleSummary::Outcome::kConverged:
      return "converged";
    case BundleSummary::Outcome::kIterationLimit:
      return "stopped at the iteration limit";
    case BundleSummary::Outcome::kInterrupted:
      return "interrupted";
    case BundleSummary::Outcome::kFailed:
      return "failed";
  }
  return "unknown";
}

}  // namespace

std::string BundleSummary::Brief() const {
  char text[200];
  std::snprintf(text, sizeof(text),
                "%s after %d iterations, cost %.6g -> %.6g, sigma %.3f, %d outliers, %.1f ms", Name(outcome),
                iterations, initial_cost, final_cost, sigma, outliers, 1e3 * seconds);
  return text;
}

BundleSummary AdjustBundle(const BundleOptions& options, BundleProblem* problem) {
  // A step that cannot be solved is tried again with more damping. Ceres says so on standard error, where it
  // means nothing to the person.
  static const bool silenced = [] {
    FLAGS_minloglevel = google::GLOG_FATAL;
    return true;
  }();
  static_cast<void>(silenced);
  const auto begin = std::chrono::steady_clock::now();
  BundleSummary summary;
  BundleEvaluation evaluation(*problem, options.loss, options.interrupt);
  evaluation.EvaluateNorms();
  const std::vector<double> start_norms = evaluation.squared_norms();
  evaluation.set_threshold(RobustThreshold(options, EstimateSigma(start_norms)));
  if (evaluation.interrupted()) {
    summary.outcome = BundleSummary::Outcome::kInterrupted;
  } else {
    SolverProblem solver(options, *problem, &evaluation);
    summary.outcome = solver.empty() ? BundleSummary::Outcome::kConverged
                                     : RunRounds(options, &solver, &evaluation, &summary);
    evaluation.EvaluateNorms();
  }
  summary.sigma = EstimateSigma(evaluation.squared_norms());
  double threshold = RobustThreshold(options, summary.sigma);
  // Both under the same threshold: otherwise a tighter one alone would look like progress.
  summary.initial_cost = RobustCost(options.loss, threshold, start_norms);
  summary.final_cost = RobustCost(options.loss, threshold, evaluation.squared_norms());
  if (summary.final_cost <= summary.initial_cost) {
    WriteBack(&evaluation, problem);
    MarkOutliers(threshold, evaluation, evaluation.squared_norms(), problem, &summary);
  } else {
    summary.final_cost = summary.initial_cost;
    summary.sigma = EstimateSigma(start_norms);
    threshold = RobustThreshold(options, summary.sigma);
    MarkOutliers(threshold, evaluation, start_norms, problem, &summary);
  }
  summary.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return summary;
}

}  // namespace docent::engine
