// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/loops/loop_correction.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "tests/engine/geometry/test_math.h"
#include "tests/engine/geometry/transform_laws.h"
#include "tests/engine/mapping/loops/there_and_back.h"
#include "tests/engine/mapping/panorama/panorama_scene.h"

namespace docent::engine {
namespace {

using testing_world::BlankKeyFrame;
using testing_world::CameraAt;
using testing_world::GalleryCamera;
using testing_world::ThereAndBack;
using testing_world::TruePoseThereAndBack;

constexpr int kLinks = 10;  // of the chains of keyframes below

// Points that two keyframes observe, `ahead` of the first one, which is their source.
std::vector<MapPointId> Link(KeyFrameId a, KeyFrameId b, int points, Map* map) {
  std::vector<MapPointId> added;
  for (int i = 0; i < points; ++i) {
    MapPoint point;
    const Rigid3 map_from_camera = map->FindKeyFrame(a)->keyframe.camera_from_map.inverse();
    point.point_in_map << map_from_camera * Eigen::Vector3d(0.01 * i, 0.1, 2), 1;
    point.source_keyframe = a;
    added.push_back(map->AddPoint(point));
    for (const KeyFrameId observer : {a, b}) map->AddObservation({observer, added.back(), {32, 32}, 0});
  }
  return added;
}

// Keyframes one unit apart, each of which shares a hundred points with the next one. The first one is fixed.
Map Chain() {
  Map map;
  for (int i = 0; i <= kLinks; ++i) {
    KeyFrame keyframe = BlankKeyFrame(CameraAt({static_cast<double>(i), 0, 0}, {0, 3.0 * i, 0}));
    keyframe.fixed = i == 0;
    map.AddKeyFrame(std::move(keyframe));
  }
  for (KeyFrameId id = 0; id < kLinks; ++id) Link(id, id + 1, 100, &map);
  return map;
}

// The candidate that moves the last keyframe of the chain by a similarity in map coordinates.
LoopCandidate LastMovedBy(const Sim3& after_from_before, Map* map) {
  LoopCandidate candidate;
  candidate.keyframe = kLinks;
  candidate.place = 0;
  candidate.keyframe_from_place = AsSim3(map->FindKeyFrame(kLinks)->keyframe.camera_from_map) *
                                  after_from_before.inverse() *
                                  AsSim3(map->FindKeyFrame(0)->keyframe.camera_from_map).inverse();
  return candidate;
}
Sim3 Shift(double x) {
  return {Rotation3(), {x, 0, 0}, 1};
}
// About the line that the keyframes stand on, so that an even distribution moves none of them.
Sim3 Twisted(double radians) {
  return {Rotation3::Exp({radians, 0, 0}), Eigen::Vector3d::Zero(), 1};
}

LoopGraph Optimized(const std::vector<LoopCandidate>& candidates, Map* map) {
  LoopGraph graph = MakeLoopGraph({}, candidates, map);
  PoseGraphOptions options;
  options.max_iterations = 100;
  options.min_decrease = 1e-12;
  EXPECT_TRUE(SolvePoseGraph(options, &graph.graph).solved);
  return graph;
}

bool HasEdge(const LoopGraph& graph, int a, int b) {
  return std::any_of(graph.graph.edges.begin(), graph.graph.edges.end(), [&](const PoseGraph::Edge& edge) {
    return (edge.a == a && edge.b == b) || (edge.a == b && edge.b == a);
  });
}

bool IsConnected(const PoseGraph& graph) {
  std::vector<std::size_t> part(graph.nodes.size());
  std::iota(part.begin(), part.end(), 0);
  for (const PoseGraph::Edge& edge : graph.edges) {
    const std::size_t from = part[static_cast<std::size_t>(edge.a)],
                      to = part[static_cast<std::size_t>(edge.b)];
    std::replace(part.begin(), part.end(), from, to);
  }
  return std::all_of(part.begin(), part.end(), [&](std::size_t root) { return root == part.front(); });
}

TEST(LoopGraph, HasTheLocalizedKeyframesAsNodesAndNoErrorButThatOfTheLoop) {
  Map map = Chain();
  KeyFrame dependent = BlankKeyFrame();
  dependent.kind = KeyFrameKind::kPanorama;
  map.AddKeyFrame(dependent);
  const LoopCandidate candidate = LastMovedBy(Shift(0.5), &map);
  const LoopGraph graph = MakeLoopGraph({}, {candidate}, &map);
  ASSERT_EQ(graph.keyframes.size(), static_cast<std::size_t>(kLinks) + 1);
  ASSERT_EQ(graph.graph.nodes.size(), graph.keyframes.size());
  for (std::size_t i = 0; i < graph.keyframes.size(); ++i) {
    EXPECT_EQ(graph.keyframes[i], i);
    EXPECT_EQ(graph.graph.nodes[i].fixed, i == 0);
  }
  ASSERT_EQ(graph.candidates, 1u);
  ASSERT_EQ(graph.graph.edges.size(), static_cast<std::size_t>(kLinks) + 1);
  for (std::size_t i = 0; i < kLinks; ++i)
    EXPECT_LT(LargestError(graph.graph, graph.graph.edges[i]), 1e-12) << i;
  const PoseGraph::Edge& loop = graph.graph.edges.back();
  EXPECT_EQ(loop.a, kLinks);
  EXPECT_EQ(loop.b, 0);
  EXPECT_LT(Difference(loop.a_from_b, candidate.keyframe_from_place), 1e-12);
  EXPECT_GT(LargestError(graph.graph, loop), 0.3);
  EXPECT_GT(loop.weight, graph.graph.edges.front().weight);
}

TEST(LoopGraph, FixesTheFirstKeyframeIfNoneIsFixed) {
  Map map = Chain();
  map.FindKeyFrame(0)->keyframe.fixed = false;
  const LoopGraph graph = MakeLoopGraph({}, {}, &map);
  for (std::size_t i = 0; i < graph.graph.nodes.size(); ++i)
    EXPECT_EQ(graph.graph.nodes[i].fixed, i == 0) << i;
}

TEST(LoopGraph, WeighsEdgesByTheNumberOfSharedPoints) {
  Map map;
  for (int i = 0; i < 4; ++i) map.AddKeyFrame(BlankKeyFrame(CameraAt({0.5 * i, 0, 0})));
  Link(0, 1, 300, &map);
  Link(1, 2, 80, &map);
  Link(2, 3, 40, &map);
  const LoopGraph graph = MakeLoopGraph({}, {}, &map);
  ASSERT_EQ(graph.graph.edges.size(), 3u);
  for (const PoseGraph::Edge& edge : graph.graph.edges) {
    const double expected = edge.a == 0 ? 1.0 : edge.a == 1 ? 0.8 : 0.4;
    EXPECT_NEAR(edge.weight, expected, 1e-12) << edge.a << ", " << edge.b;
  }
}

TEST(LoopGraph, JoinsEachKeyframeWithThoseThatShareMost) {
  Map map;
  constexpr int kKeyFrames = 5;
  for (int i = 0; i < kKeyFrames; ++i) map.AddKeyFrame(BlankKeyFrame(CameraAt({0.1 * i, 0, 0})));
  for (KeyFrameId a = 0; a < kKeyFrames; ++a) {
    // Nearer keyframes share more.
    for (KeyFrameId b = a + 1; b < kKeyFrames; ++b) Link(a, b, 110 - 10 * static_cast<int>(b - a), &map);
  }
  LoopCorrectionOptions options;
  options.edges = kKeyFrames;
  EXPECT_EQ(MakeLoopGraph(options, {}, &map).graph.edges.size(), 10u) << "all pairs share enough points";
  options.edges = 2;
  const LoopGraph graph = MakeLoopGraph(options, {}, &map);
  for (int i = 0; i + 1 < kKeyFrames; ++i) EXPECT_TRUE(HasEdge(graph, i, i + 1)) << i;
  EXPECT_TRUE(HasEdge(graph, 0, 2)) << "the first keyframe has no neighbour on the other side";
  EXPECT_TRUE(HasEdge(graph, 2, 4));
  EXPECT_EQ(graph.graph.edges.size(), 6u);
}

TEST(LoopGraph, IsConnectedByTheStrongestLinksThatAreLeft) {
  Map map;
  for (int i = 0; i < 6; ++i) map.AddKeyFrame(BlankKeyFrame(CameraAt({0.5 * i, 0, 0})));
  Link(0, 1, 100, &map);
  Link(2, 3, 100, &map);
  Link(4, 5, 100, &map);
  Link(1, 3, 5, &map);  // too few to be neighbours
  Link(0, 2, 3, &map);
  const LoopGraph graph = MakeLoopGraph({}, {}, &map);
  EXPECT_TRUE(IsConnected(graph.graph));
  EXPECT_TRUE(HasEdge(graph, 1, 3));
  EXPECT_FALSE(HasEdge(graph, 0, 2)) << "weaker, and no longer needed";
  EXPECT_TRUE(HasEdge(graph, 3, 4)) << "nothing is shared: in the order of the keyframes";
  EXPECT_EQ(graph.graph.edges.size(), 5u);
}

TEST(LoopCorrection, DistributesARotationEvenlyOverTheChain) {
  Map map = Chain();
  const auto before = map.Snapshot();
  ApplyLoopGraph(Optimized({LastMovedBy(Twisted(0.15), &map)}, &map), &map);
  for (KeyFrameId id = 0; id <= kLinks; ++id) {
    const Rigid3 &was = before->keyframes[id].camera_from_map,
                 &is = map.FindKeyFrame(id)->keyframe.camera_from_map;
    EXPECT_NEAR(AngleBetween(was.rotation, is.rotation), 0.15 * id / kLinks, 0.003) << id;
    EXPECT_LT((was.OriginInSource() - is.OriginInSource()).norm(), 1e-3) << id;
  }
}

// Scales and rotations take their part of it, so that the steps are not equal, but no edge takes much of it.
TEST(LoopCorrection, DistributesADisplacementOverTheChain) {
  constexpr double kError = 0.15;
  Map map = Chain();
  const auto before = map.Snapshot();
  ApplyLoopGraph(Optimized({LastMovedBy(Shift(-kError), &map)}, &map), &map);
  std::vector<double> moved;
  for (KeyFrameId id = 0; id <= kLinks; ++id) {
    moved.push_back((map.FindKeyFrame(id)->keyframe.camera_from_map.OriginInSource() -
                     before->keyframes[id].camera_from_map.OriginInSource())
                        .x());
  }
  EXPECT_NEAR(moved.back(), -kError, 0.03 * kError);
  for (std::size_t i = 1; i < moved.size(); ++i) {
    EXPECT_LT(moved[i], moved[i - 1]) << i;
    EXPECT_GT(moved[i], moved[i - 1] - 2 * kError / kLinks) << i;
  }
}

TEST(LoopCorrection, DistributesAChangeOfScaleToo) {
  Map map = Chain();
  const Sim3 zoom{Rotation3(), Eigen::Vector3d(-0.1 * kLinks, 0, 0), 1.1};
  const LoopCandidate candidate = LastMovedBy(zoom, &map);
  const LoopGraph before = MakeLoopGraph({}, {candidate}, &map), after = Optimized({candidate}, &map);
  const double error = LargestError(before.graph, before.graph.edges.back());
  EXPECT_LT(LargestError(after.graph, after.graph.edges.back()), 0.1 * error);
  for (std::size_t i = 0; i < kLinks; ++i)
    EXPECT_LT(LargestError(after.graph, after.graph.edges[i]), 0.4 * error) << i;
}

TEST(LoopCorrection, MovesPointsWithTheirSourceKeyframes) {
  Map map = Chain();
  const auto before = map.Snapshot();
  const LoopGraph graph =
      Optimized({LastMovedBy({Rotation3::Exp({0, 0.05, 0}), {0.1, 0.1, 0}, 1.05}, &map)}, &map);
  ApplyLoopGraph(graph, &map);
  const auto after = map.Snapshot();
  ASSERT_EQ(after->points.size(), before->points.size());
  for (std::size_t i = 0; i < before->points.size(); ++i) {
    const KeyFrameId source = before->points[i].source_keyframe;
    const Eigen::Vector3d seen = before->keyframes[source].camera_from_map * before->points[i].position();
    const Eigen::Vector3d sees = after->keyframes[source].camera_from_map * after->points[i].position();
    // The ray stays the same.
    EXPECT_LT(AngleBetween(seen, sees), 1e-9);
    EXPECT_NEAR(sees.norm() / seen.norm(), after->keyframes[source].mean_depth, 1e-9);
  }
  ASSERT_EQ(after->corrections.size(), 1u);
  EXPECT_EQ(after->corrections[0]->after_from_before.size(), map.keyframes().size());
}

TEST(LoopCorrection, DoesNotMoveFixedKeyframes) {
  Map map = Chain();
  map.FindKeyFrame(4)->keyframe.fixed = true;
  const auto before = map.Snapshot();
  ApplyLoopGraph(Optimized({LastMovedBy(Shift(0.2), &map)}, &map), &map);
  for (const KeyFrameId id : {0u, 4u})
    EXPECT_TRUE(IsNear(map.FindKeyFrame(id)->keyframe.camera_from_map, before->keyframes[id].camera_from_map,
                       1e-12, 1e-12))
        << id;
  EXPECT_FALSE(IsNear(map.FindKeyFrame(8)->keyframe.camera_from_map, before->keyframes[8].camera_from_map,
                      0.01, 0.01));
}

TEST(LoopCorrection, MovesANewKeyframeWithTheOneThatSharesMostPoints) {
  Map map = Chain();
  const LoopGraph graph = Optimized({LastMovedBy(Shift(0.2), &map)}, &map);
  const KeyFrameId fresh = map.AddKeyFrame(BlankKeyFrame(CameraAt({kLinks + 0.5, 0, 0}))).keyframe.id;
  Link(2, fresh, 20, &map);
  Link(kLinks, fresh, 30, &map);
  const auto before = map.Snapshot();
  ApplyLoopGraph(graph, &map);
  const auto corrections = map.Snapshot()->corrections;
  ASSERT_EQ(corrections.size(), 1u);
  const auto& moved = corrections[0]->after_from_before;
  EXPECT_LT(Difference(moved.at(fresh), moved.at(kLinks)), 1e-12);
  EXPECT_FALSE(IsNear(map.FindKeyFrame(fresh)->keyframe.camera_from_map,
                      before->keyframes[fresh].camera_from_map, 0.1, 0.1));
}

TEST(LoopCorrection, IgnoresKeyframesThatWereRemovedSince) {
  Map map = Chain();
  const LoopGraph graph = Optimized({LastMovedBy(Shift(0.2), &map)}, &map);
  const Rigid3 last = map.FindKeyFrame(kLinks)->keyframe.camera_from_map;
  map.RemoveKeyFrame(5);
  ApplyLoopGraph(graph, &map);
  EXPECT_EQ(map.FindKeyFrame(5), nullptr);
  EXPECT_NEAR(
      (map.FindKeyFrame(kLinks)->keyframe.camera_from_map.OriginInSource() - last.OriginInSource()).norm(),
      0.2, 0.01);
}

// The error of each of the ten edges is a tenth of that of the loop.
TEST(LoopConsistency, EndsWhereTheEdgesWouldHaveToBend) {
  const LoopCorrectionOptions options;
  for (const double part : {0.8, 1.2}) {
    Map map = Chain();
    const double error = part * kLinks * options.max_edge_residual;
    EXPECT_EQ(IsConsistent(options, Optimized({LastMovedBy(Twisted(error), &map)}, &map)), part < 1) << part;
  }
}

// A graph of equal poses whose edges measured a displacement, followed by the edge of a loop candidate.
LoopGraph GraphWithErrors(const std::vector<double>& errors) {
  LoopGraph graph;
  graph.graph.nodes.resize(2);
  for (const double error : errors) graph.graph.edges.push_back({0, 1, Shift(error), 1});
  graph.graph.edges.push_back({0, 1, Sim3(), 1});
  graph.candidates = 1;
  return graph;
}

TEST(LoopConsistency, AllowsALargerResidualInAFewOfManyEdges) {
  const LoopCorrectionOptions options;
  constexpr std::size_t kEdges = 300;
  const auto allowed = static_cast<std::size_t>(options.max_exceeding_edges * kEdges);
  ASSERT_GT(allowed, 0u);
  const double larger = 0.5 * (options.max_edge_residual + options.max_loop_residual);
  std::vector<double> errors(kEdges, 0.5 * options.max_edge_residual);
  EXPECT_TRUE(IsConsistent(options, GraphWithErrors(errors)));
  std::fill_n(errors.begin(), allowed, larger);
  EXPECT_TRUE(IsConsistent(options, GraphWithErrors(errors)));
  errors[allowed] = larger;
  EXPECT_FALSE(IsConsistent(options, GraphWithErrors(errors)));
}

TEST(LoopConsistency, AllowsNoEdgeALargerResidualThanACandidate) {
  const LoopCorrectionOptions options;
  std::vector<double> errors(300, 0.5 * options.max_edge_residual);
  errors[7] = 1.1 * options.max_loop_residual;
  EXPECT_FALSE(IsConsistent(options, GraphWithErrors(errors)));
}

TEST(LoopConsistency, RefusesCandidatesThatContradictEachOther) {
  LoopCorrectionOptions options;
  options.max_edge_residual = 10;
  for (const double apart : {1.0, 3.0}) {
    Map map = Chain();
    // The optimum lies in the middle between the two.
    const double off = 0.5 * apart * options.max_loop_residual;
    const std::vector<LoopCandidate> candidates = {LastMovedBy(Shift(off), &map),
                                                   LastMovedBy(Shift(-off), &map)};
    EXPECT_EQ(IsConsistent(options, Optimized(candidates, &map)), off < options.max_loop_residual) << apart;
  }
}

TEST(LoopCorrection, FusesTheDuplicatesOfACandidate) {
  Map map = Chain();
  const auto known = Link(0, 1, 3, &map), recent = Link(kLinks - 1, kLinks, 3, &map);
  LoopCandidate candidate;
  candidate.keyframe = kLinks;
  candidate.place = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    candidate.seen.push_back({kLinks, known[i], {30, 30}, 0});
    candidate.duplicates.push_back({known[i], recent[i]});
  }
  map.RemovePoint(recent[2]);  // since the candidate was found
  const std::size_t points = map.AlivePoints();
  EXPECT_EQ(FuseCandidateDuplicates(candidate, &map), 2);
  EXPECT_EQ(map.AlivePoints(), points - 2);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(map.FindPoint(recent[i]), nullptr) << i;
  const std::vector<KeyFrameId> both = {0, 1, kLinks - 1, kLinks}, seen_only = {0, 1, kLinks};
  EXPECT_EQ(map.FindPoint(known[0])->observers, both);
  EXPECT_EQ(map.FindPoint(known[1])->observers, both);
  EXPECT_EQ(map.FindPoint(known[2])->observers, seen_only);
  EXPECT_EQ(Validate(*map.Snapshot()), "");
}

// The way back has drifted by less than what the search copes with.
class LoopFusion : public testing::Test {
 protected:
  static constexpr KeyFrameId kBackAgain = 15;  // 0.3 m along the gallery, on the way back
  static Map SlightlyDrifted() { return ThereAndBack({Rotation3(), {0.004, 0.002, 0}, 1}); }
  // The points of the way out.
  static std::vector<MapPointId> KnownPoints(const Map& map) {
    std::vector<MapPointId> known;
    for (const Map::PointRecord& record : map.points())
      if (record.alive && record.observers.front() < 9) known.push_back(record.point.id);
    return known;
  }
};

TEST_F(LoopFusion, FusesPointsThatTheKeyframeSeesAtTheSamePlace) {
  Map map = SlightlyDrifted();
  const auto before = map.Snapshot();
  const std::vector<MapPointId> known = KnownPoints(map);
  PointSearcher searcher;
  const int fused = MatchAndFusePoints(kBackAgain, known, &map, &searcher);
  EXPECT_GT(fused, 40);
  const auto after = map.Snapshot();
  EXPECT_EQ(Validate(*after), "");
  EXPECT_EQ(after->points.size(), before->points.size() - static_cast<std::size_t>(fused));
  int seen = 0, misplaced = 0;
  for (const MapPointId id : known) {
    const Map::PointRecord* point = map.FindPoint(id);
    ASSERT_NE(point, nullptr) << "the older of two duplicates remains";
    if (!std::binary_search(point->observers.begin(), point->observers.end(), kBackAgain)) continue;
    ++seen;
    const auto& observations = map.FindKeyFrame(kBackAgain)->observations;
    const auto observation = std::find_if(observations.begin(), observations.end(),
                                          [&](const Observation& each) { return each.point == id; });
    ASSERT_NE(observation, observations.end());
    const Eigen::Vector2d truth =
        *GalleryCamera()->Project(TruePoseThereAndBack(kBackAgain) * before->FindPoint(id)->position());
    misplaced += (truth - observation->pixel.cast<double>()).norm() > 2.0 * (1 << observation->level);
  }
  EXPECT_GE(seen, fused);
  EXPECT_LE(misplaced, seen / 20);
}

TEST_F(LoopFusion, KeepsPointsAtDifferentDepthsApart) {
  Map map = SlightlyDrifted();
  const Eigen::Vector3d center = map.FindKeyFrame(kBackAgain)->keyframe.camera_from_map.OriginInSource();
  for (const Observation& observation : map.FindKeyFrame(kBackAgain)->observations) {
    Eigen::Vector4d& point = map.FindPoint(observation.point)->point.point_in_map;
    point.head<3>() = center + 1.2 * (point.head<3>() - center);
  }
  const std::size_t points = map.AlivePoints(), own = map.FindKeyFrame(kBackAgain)->observations.size();
  PointSearcher searcher;
  EXPECT_EQ(MatchAndFusePoints(kBackAgain, KnownPoints(map), &map, &searcher), 0);
  EXPECT_EQ(map.AlivePoints(), points);
  EXPECT_GT(map.FindKeyFrame(kBackAgain)->observations.size(), own + 40) << "it observes them nevertheless";
}

TEST_F(LoopFusion, NeedsAKeyframeWithAPosition) {
  Map map = SlightlyDrifted();
  PointSearcher searcher;
  const std::vector<MapPointId> known = KnownPoints(map);
  EXPECT_EQ(MatchAndFusePoints(999, known, &map, &searcher), 0);
  KeyFrame dependent = map.FindKeyFrame(kBackAgain)->keyframe;
  dependent.kind = KeyFrameKind::kPanorama;
  const KeyFrameId rotated = map.AddKeyFrame(dependent).keyframe.id;
  EXPECT_EQ(MatchAndFusePoints(rotated, known, &map, &searcher), 0);
  EXPECT_TRUE(map.FindKeyFrame(rotated)->observations.empty());
}

}  // namespace
}  // namespace docent::engine
