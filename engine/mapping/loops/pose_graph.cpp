// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/loops/pose_graph.h"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/base/option_check.h"

namespace docent::engine {
namespace {

constexpr int kDimension = 7;  // translation, rotation, logarithm of the scale
using Vector7 = Eigen::Matrix<double, kDimension, 1>;
using Matrix7 = Eigen::Matrix<double, kDimension, kDimension>;

// The similarity of a small step, applied on the left of a node.
Sim3 Step(const Vector7& step) {
  Sim3 result;
  result.translation = step.head<3>();
  result.rotation = Rotation3::Exp(step.segment<3>(3));
  result.scale = std::exp(step[6]);
  return result;
}

Sim3 Residual(const PoseGraph& graph, const PoseGraph::Edge& edge) {
  const auto& a = graph.nodes[static_cast<std::size_t>(edge.a)];
  const auto& b = graph.nodes[static_cast<std::size_t>(edge.b)];
  return edge.a_from_b * (b.node_from_map * a.node_from_map.inverse());
}

Vector7 Error(const Sim3& residual, double depth) {
  Vector7 error;
  error << residual.translation / depth, residual.rotation.Log(), std::log(residual.scale);
  return error;
}

// Inverse of SO(3)'s left Jacobian at a rotation vector: Log(Exp(w) R) = Log(R) + this * w to first order.
Eigen::Matrix3d InverseLeftJacobian(const Eigen::Vector3d& rotation) {
  const double angle = rotation.norm();
  const Eigen::Matrix3d hat = Hat(rotation);
  double square = 1.0 / 12;
  if (angle > 1e-4) square = 1 / (angle * angle) - (1 + std::cos(angle)) / (2 * angle * std::sin(angle));
  return Eigen::Matrix3d::Identity() - 0.5 * hat + square * hat * hat;
}

struct LinearizedEdge {
  Vector7 error;
  Matrix7 by_a, by_b;  // derivatives with respect to steps on the left of the nodes
};

LinearizedEdge Linearize(const PoseGraph& graph, const PoseGraph::Edge& edge) {
  const double depth = graph.nodes[static_cast<std::size_t>(edge.a)].depth;
  const Sim3 residual = Residual(graph, edge);
  LinearizedEdge result;
  result.error = Error(residual, depth);
  const Eigen::Vector3d rotation = result.error.segment<3>(3);
  const Eigen::Matrix3d inverse_jacobian = InverseLeftJacobian(rotation);

  // A step of b transferred to a: Z * step * Z^-1, as a step on the left of the residual similarity.
  const Eigen::Matrix3d edge_rotation = edge.a_from_b.rotation.matrix();
  const Eigen::Vector3d& edge_translation = edge.a_from_b.translation;
  Matrix7 transferred = Matrix7::Zero();
  transferred.block<3, 3>(0, 0) = edge.a_from_b.scale * edge_rotation;
  transferred.block<3, 3>(0, 3) = Hat(edge_translation) * edge_rotation;
  transferred.block<3, 1>(0, 6) = -edge_translation;
  transferred.block<3, 3>(3, 3) = edge_rotation;
  transferred(6, 6) = 1;
  Matrix7 by_step = Matrix7::Zero();
  by_step.block<3, 3>(0, 0).setIdentity();
  by_step.block<3, 3>(0, 3) = -Hat(residual.translation);
  by_step.block<3, 1>(0, 6) = residual.translation;
  by_step.topRows<3>() /= depth;
  by_step.block<3, 3>(3, 3) = inverse_jacobian;
  by_step(6, 6) = 1;
  result.by_b = by_step * transferred;

  // The inverse of a step of a, on the right of the residual similarity.
  result.by_a.setZero();
  result.by_a.block<3, 3>(0, 0) = -residual.scale / depth * residual.rotation.matrix();
  result.by_a.block<3, 3>(3, 3) = -inverse_jacobian.transpose();
  result.by_a(6, 6) = -1;
  return result;
}

// The normal equations of the free nodes.
struct Normal {
  Eigen::SparseMatrix<double> matrix;  // lower triangle
  Eigen::VectorXd gradient;
};

Normal Assemble(const PoseGraph& graph, const std::vector<int>& first_row, int rows) {
  std::vector<Eigen::Triplet<double>> triplets;
  triplets.reserve(graph.edges.size() * 3 * kDimension * kDimension);
  Normal normal;
  normal.gradient = Eigen::VectorXd::Zero(rows);
  const auto add = [&](int row, int column, const Matrix7& block) {
    for (int i = 0; i < kDimension; ++i) {
      for (int j = 0; j < kDimension; ++j) {
        if (row + i >= column + j) triplets.emplace_back(row + i, column + j, block(i, j));
      }
    }
  };
  for (const PoseGraph::Edge& edge : graph.edges) {
    const LinearizedEdge linear = Linearize(graph, edge);
    const int a = first_row[static_cast<std::size_t>(edge.a)],
              b = first_row[static_cast<std::size_t>(edge.b)];
    if (a >= 0) {
      add(a, a, edge.weight * linear.by_a.transpose() * linear.by_a);
      normal.gradient.segment<kDimension>(a) += edge.weight * linear.by_a.transpose() * linear.error;
    }
    if (b >= 0) {
      add(b, b, edge.weight * linear.by_b.transpose() * linear.by_b);
      normal.gradient.segment<kDimension>(b) += edge.weight * linear.by_b.transpose() * linear.error;
    }
    if (a >= 0 && b >= 0) {
      const Matrix7 cross = edge.weight * linear.by_a.transpose() * linear.by_b;
      if (a > b) {
        add(a, b, cross);
      } else {
        add(b, a, cross.transpose());
      }
    }
  }
  normal.matrix.resize(rows, rows);
  normal.matrix.setFromTriplets(triplets.begin(), triplets.end());
  return normal;
}

bool AllConstrained(const PoseGraph& graph) {
  std::vector<bool> constrained;
  for (const PoseGraph::Node& node : graph.nodes) constrained.push_back(node.fixed);
  bool more = true;
  while (more) {
    more = false;
    for (const PoseGraph::Edge& edge : graph.edges) {
      const auto a = static_cast<std::size_t>(edge.a), b = static_cast<std::size_t>(edge.b);
      if (constrained[a] == constrained[b]) continue;
      constrained[a] = constrained[b] = more = true;
    }
  }
  return std::find(constrained.begin(), constrained.end(), false) == constrained.end();
}

}  // namespace

std::optional<std::string> PoseGraphOptions::Validate() const {
  return OptionCheck()
      .AtLeast(max_iterations, 1, "number of iterations of a pose graph")
      .AtLeast(min_decrease, 0, "decrease of the cost of a pose graph")
      .fault();
}

double PoseGraphCost(const PoseGraph& graph) {
  double cost = 0;
  for (const PoseGraph::Edge& edge : graph.edges) {
    const double depth = graph.nodes[static_cast<std::size_t>(edge.a)].depth;
    cost += 0.5 * edge.weight * Error(Residual(graph, edge), depth).squaredNorm();
  }
  return cost;
}

double LargestError(const PoseGraph& graph, const PoseGraph::Edge& edge) {
  const Vector7 error = Error(Residual(graph, edge), graph.nodes[static_cast<std::size_t>(edge.a)].depth);
  return std::max({error.head<3>().norm(), error.segment<3>(3).norm(), std::abs(error[6])});
}

PoseGraphSummary SolvePoseGraph(const PoseGraphOptions& options, PoseGraph* graph) {
  PoseGraphSummary summary;
  std::vector<int> first_row;
  int rows = 0;
  for (const PoseGraph::Node& node : graph->nodes) {
    first_row.push_back(node.fixed ? -1 : rows);
    if (!node.fixed) rows += kDimension;
  }
  double cost = summary.initial_cost = summary.final_cost = PoseGraphCost(*graph);
  if (rows == 0 || !std::isfinite(cost) || !AllConstrained(*graph)) return summary;
  const std::vector<PoseGraph::Node> start = graph->nodes;
  double damping = 1e-8;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower> solver;
  bool analyzed = false;
  constexpr double kMaxDamping = 1e3;
  constexpr double kMinStep = 1e-12;  // near machine precision
  while (summary.iterations < options.max_iterations && damping < kMaxDamping) {
    ++summary.iterations;
    Normal normal = Assemble(*graph, first_row, rows);
    for (int i = 0; i < rows; ++i) normal.matrix.coeffRef(i, i) *= 1 + damping;
    if (!std::exchange(analyzed, true)) solver.analyzePattern(normal.matrix);
    solver.factorize(normal.matrix);
    const Eigen::VectorXd step = solver.info() == Eigen::Success
                                     ? Eigen::VectorXd(-solver.solve(normal.gradient))
                                     : Eigen::VectorXd::Constant(rows, NAN);
    if (!step.allFinite()) {
      graph->nodes = start;
      summary.final_cost = summary.initial_cost;
      return summary;
    }
    if (step.lpNorm<Eigen::Infinity>() < kMinStep) break;
    const std::vector<PoseGraph::Node> before = graph->nodes;
    for (std::size_t i = 0; i < graph->nodes.size(); ++i) {
      if (first_row[i] < 0) continue;
      Sim3& pose = graph->nodes[i].node_from_map;
      pose = Step(step.segment<kDimension>(first_row[i])) * pose;
    }
    const double next = PoseGraphCost(*graph);
    if (!(next <= cost)) {
      graph->nodes = before;
      damping = std::max(1e-6, damping * 100);
      continue;
    }
    const double decrease = cost - next;
    const bool converged = decrease <= options.min_decrease * cost;
    cost = next;
    damping *= 0.1;
    if (converged) break;
  }
  summary.final_cost = cost;
  summary.solved = true;
  return summary;
}

}  // namespace docent::engine
