// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "engine/geometry/sim3.h"

// A pose graph: keyframes as nodes, measured relative similarities as edges. After a loop the accumulated
// error, scale drift included, is distributed over the edges (Strasdat, Montiel and Davison 2010). A pure
// function of its input: single-threaded, equal input gives an equal result.
namespace docent::engine {

struct PoseGraph {
  struct Node {
    Sim3 node_from_map;  // in: initial value; out: result
    bool fixed = false;
    double depth = 1;  // median depth in its own units: the unit in which its translation errors are weighted
  };
  struct Edge {
    int a = 0, b = 0;  // indices of nodes
    Sim3 a_from_b;     // measurement
    double weight = 1;
  };
  std::vector<Node> nodes;
  std::vector<Edge> edges;
};

struct PoseGraphOptions {
  int max_iterations = 20;
  double min_decrease = 1e-6;  // relative decrease of the cost below which it has converged

  // Describes the first invalid option in one sentence, or empty.
  std::optional<std::string> Validate() const;
};

// Half the weighted sum of squared errors. The error of an edge is that of a_from_b * b_from_a: its
// translation as a ratio of the depth, its rotation vector, and the logarithm of its scale.
double PoseGraphCost(const PoseGraph& graph);
// The largest component of one edge's error: ratio of the depth, radians, or logarithm of the scale.
double LargestError(const PoseGraph& graph, const PoseGraph::Edge& edge);

struct PoseGraphSummary {
  bool solved = false;  // false: the nodes are unchanged
  int iterations = 0;
  double initial_cost = 0, final_cost = 0;
};

// Moves the free nodes to the nearest minimum of the cost (Levenberg-Marquardt on Sim(3), sparse). Each
// connected component needs a fixed node, and depths and weights must be positive; otherwise `solved` is
// false.
PoseGraphSummary SolvePoseGraph(const PoseGraphOptions& options, PoseGraph* graph);

}  // namespace docent::engine
