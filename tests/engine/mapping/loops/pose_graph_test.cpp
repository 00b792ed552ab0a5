// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/loops/pose_graph.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/base/random.h"
#include "tests/engine/geometry/test_math.h"

namespace docent::engine {
namespace {

Sim3 MakeSim3(const Eigen::Vector3d& rotation, const Eigen::Vector3d& translation, double scale) {
  Sim3 result;
  result.rotation = Rotation3::Exp(rotation);
  result.translation = translation;
  result.scale = scale;
  return result;
}

// The unweighted error of an edge between the two similarities: zero if they are equal.
double EdgeError(const Sim3& a, const Sim3& b) {
  const Sim3 left = a * b.inverse();
  return std::max({left.translation.norm(), left.rotation.Angle(), std::abs(std::log(left.scale))});
}

// Cameras on a circle, each looking along it, with different units of length.
std::vector<Sim3> Circle(int count) {
  std::vector<Sim3> nodes;
  for (int i = 0; i < count; ++i) {
    const double angle = 2 * kPi * i / count;
    const Rotation3 rotation = Rotation3::Exp({0, angle, 0});
    const Eigen::Vector3d center(5 * std::sin(angle), 0.1 * std::sin(3 * angle), 5 * std::cos(angle));
    const double scale = 1 + 0.2 * std::sin(angle);
    nodes.push_back(MakeSim3(rotation.Log(), -scale * (rotation * center), scale));
  }
  return nodes;
}

// Edges between neighbours and next neighbours, around the whole circle.
PoseGraph ExactGraph(const std::vector<Sim3>& truth) {
  PoseGraph graph;
  const int count = static_cast<int>(truth.size());
  for (const Sim3& node : truth) graph.nodes.push_back({node, false, 2.0});
  graph.nodes.front().fixed = true;
  for (int i = 0; i < count; ++i) {
    for (const int step : {1, 2}) {
      const int j = (i + step) % count;
      graph.edges.push_back(
          {i, j, truth[static_cast<std::size_t>(i)] * truth[static_cast<std::size_t>(j)].inverse(),
           0.3 + 0.1 * step});
    }
  }
  return graph;
}

TEST(PoseGraph, ReturnsToTheTruthFromADisturbedStart) {
  const std::vector<Sim3> truth = Circle(30);
  PoseGraph graph = ExactGraph(truth);
  Random random(3);
  for (PoseGraph::Node& node : graph.nodes) {
    if (!node.fixed)
      node.node_from_map =
          MakeSim3(RandomVector(&random, 0.2), RandomVector(&random, 0.5), random.Uniform(0.8, 1.2)) *
          node.node_from_map;
  }
  const PoseGraphSummary summary = SolvePoseGraph({}, &graph);
  EXPECT_TRUE(summary.solved);
  EXPECT_GT(summary.initial_cost, 0.1);
  EXPECT_LT(summary.final_cost, 1e-12);
  // Wrong derivatives would take many more iterations.
  EXPECT_LE(summary.iterations, 10);
  for (std::size_t i = 0; i < truth.size(); ++i)
    EXPECT_LT(EdgeError(graph.nodes[i].node_from_map, truth[i]), 1e-5) << "node " << i;
}

TEST(PoseGraph, DistributesTheErrorOfALoopEvenly) {
  // Every step is measured 1 % too short, with too little rotation, and 0.5 % off in scale.
  constexpr int kCount = 40;
  const std::vector<Sim3> truth = Circle(kCount);
  PoseGraph graph;
  graph.nodes.push_back({truth[0], true, 2.0});
  const Sim3 slip = MakeSim3({0, 0.004, 0.001}, {0.005, 0, -0.01}, 1.005);
  for (int i = 1; i < kCount; ++i) {
    const Sim3 measured =
        slip * (truth[static_cast<std::size_t>(i)] * truth[static_cast<std::size_t>(i - 1)].inverse());
    graph.nodes.push_back({measured * graph.nodes.back().node_from_map, false, 2.0});
    graph.edges.push_back({i, i - 1, measured, 1.0});
  }
  const double drifted = EdgeError(graph.nodes.back().node_from_map, truth.back());
  EXPECT_GT(drifted, 0.15);
  graph.edges.push_back({kCount - 1, 0, truth.back() * truth.front().inverse(), 1.0});
  const PoseGraphSummary summary = SolvePoseGraph({}, &graph);
  ASSERT_TRUE(summary.solved);
  EXPECT_LT(summary.final_cost, 0.1 * summary.initial_cost);
  EXPECT_LT(EdgeError(graph.nodes.back().node_from_map, truth.back()), 0.1 * drifted);
  // The remaining error of each edge is about the error of one step.
  const double slipped = EdgeError(slip, Sim3());
  for (const PoseGraph::Edge& edge : graph.edges) {
    const Sim3 a_from_b = graph.nodes[static_cast<std::size_t>(edge.a)].node_from_map *
                          graph.nodes[static_cast<std::size_t>(edge.b)].node_from_map.inverse();
    EXPECT_LT(EdgeError(edge.a_from_b, a_from_b), 3 * slipped) << edge.a << " from " << edge.b;
  }
}

TEST(PoseGraph, RejectsAComponentWithoutAFixedNode) {
  const std::vector<Sim3> truth = Circle(6);
  PoseGraph graph = ExactGraph(truth);
  graph.nodes.push_back({Sim3(), false, 1.0});
  const PoseGraph before = graph;
  EXPECT_FALSE(SolvePoseGraph({}, &graph).solved);
  for (std::size_t i = 0; i < graph.nodes.size(); ++i)
    EXPECT_EQ(graph.nodes[i].node_from_map.translation, before.nodes[i].node_from_map.translation) << i;
}

TEST(PoseGraph, DoesNotMoveFixedNodes) {
  const std::vector<Sim3> truth = Circle(8);
  PoseGraph graph = ExactGraph(truth);
  graph.nodes[3].fixed = true;
  graph.nodes[3].node_from_map.translation.x() += 0.3;
  const Sim3 held = graph.nodes[3].node_from_map;
  EXPECT_TRUE(SolvePoseGraph({}, &graph).solved);
  EXPECT_EQ(graph.nodes[3].node_from_map.translation, held.translation);
  EXPECT_EQ(graph.nodes[0].node_from_map.translation, truth[0].translation);
  EXPECT_GT(EdgeError(graph.nodes[4].node_from_map, truth[4]), 0.01) << "its neighbours move with it";
}

}  // namespace
}  // namespace docent::engine
