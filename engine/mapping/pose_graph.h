// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "engine/geometry/sim3.h"

// Keyframes as nodes that hold to each other by measured similarities: where a loop closes, the error that
// has gathered along it, of scale too, is spread over its edges (Strasdat, Montiel and Davison 2010). A pure
// function of its input: single-threaded, same input, same result.
namespace docent::engine {

struct PoseGraph {
  struct Node {
    Sim3 node_from_map;  // in: start; out: result
    bool fixed = false;
    double depth = 1;  // of what it sees, in its own units: the length in which its translations are weighed
  };
  struct Edge {
    int a = 0, b = 0;  // indices of nodes
    Sim3 a_from_b;     // as measured
    double weight = 1;
  };
  std::vector<Node> nodes;
  std::vector<Edge> edges;
};

struct PoseGraphOptions {
  int max_iterations = 20;
  double min_decrease = 1e-6;  // of the cost, relative: with less it has converged
};

// Half the weighted sum of squared errors; the error of an edge is what is left of a_from_b * b_from_a: its
// translation in depths, its rotation vector, and the logarithm of its scale.
double PoseGraphCost(const PoseGraph& graph);
// The largest part of one edge's error: of the depth, radians, or logarithm of the scale.
double LargestError(const PoseGraph& graph, const PoseGraph::Edge& edge);

struct PoseGraphSummary {
  bool solved = false;  // false: the nodes are as they were
  int iterations = 0;
  double initial_cost = 0, final_cost = 0;
};

// Moves the free nodes to the least cost near their start (Levenberg-Marquardt on Sim(3), sparse). At least
// one node of each connected part must be fixed, and depths and weights be positive; else it says so by
// `solved`.
PoseGraphSummary RelaxPoseGraph(const PoseGraphOptions& options, PoseGraph* graph);

}  // namespace docent::engine
