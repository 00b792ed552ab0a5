// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/loop_closing.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>
#include <utility>

#include "engine/mapping/covisibility.h"

namespace docent::engine {
namespace {

constexpr int kIterationsPerStep = 2;
constexpr int kMaxRounds = 15;
// Relative decrease of the cost in one round, below which it has converged.
constexpr double kConverged = 1e-4;
// Neighbours of each candidate's keyframe that are searched for duplicate points afterwards.
constexpr std::size_t kNeighbours = 16;
constexpr double kDegrees = 57.29577951308232;

// The error of the loop that the candidate implies, for reports.
std::string DescribeError(const LoopCandidate& candidate, Map* map) {
  const Sim3 error = KnownFromRecent(candidate, map);
  const KeyFrame& keyframe = map->FindKeyFrame(candidate.keyframe)->keyframe;
  const Eigen::Vector3d center = keyframe.camera_from_map.OriginInSource();
  const double shift = (error * center - center).norm();
  const double path_length = Covisibility(*map).PathLengthBetween(candidate.keyframe, candidate.place, *map);
  char text[160];
  std::snprintf(text, sizeof(text), "drift of %.1f %% of the path, %.2f degrees, %+.1f %% in scale",
                100 * shift / path_length, kDegrees * error.rotation.Angle(), 100 * (error.scale - 1));
  return text;
}

}  // namespace

void LoopCloser::Reset() {
  detector_.Clear();
  queue_.clear();
  loop_.reset();
  nearby_.clear();
  to_fuse_.clear();
  closed_by_ = kNoId;
  searcher_.Release();
}

void LoopCloser::Enqueue(KeyFrameId keyframe) {
  if (!options_.enabled) return;
  queue_.push_back(keyframe);
}

LoopCloser::Progress LoopCloser::Step(Map* map) {
  const Progress progress = DoStep(map);
  if (!HasLoop() && queue_.empty()) searcher_.Release();
  return progress;
}

LoopCloser::Progress LoopCloser::DoStep(Map* map) {
  if (!to_fuse_.empty()) {
    Fuse(map);
    return to_fuse_.empty() ? Progress::kFused : Progress::kWorked;
  }
  if (loop_) {
    Progress progress = Progress::kWorked;
    OptimizePoseGraph(map, &progress);
    return progress;
  }
  if (queue_.empty()) return Progress::kNothing;
  std::vector<LoopCandidate> candidates = detector_.Detect(queue_.front(), map, &searcher_);
  queue_.pop_front();
  if (candidates.empty()) return Progress::kWorked;
  Loop found;
  found.graph = MakeLoopGraph(options_.correction, candidates, map);
  found.candidates = std::move(candidates);
  loop_ = std::move(found);
  return Progress::kWorked;
}

// Optimizes the pose graph by one round; corrects the map once it has converged.
void LoopCloser::OptimizePoseGraph(Map* map, Progress* progress) {
  PoseGraphOptions one_round = options_.correction.graph;
  one_round.max_iterations = kIterationsPerStep;
  const PoseGraphSummary summary = SolvePoseGraph(one_round, &loop_->graph.graph);
  if (!summary.solved) {
    loop_.reset();
    return;
  }
  const double decrease = summary.initial_cost - summary.final_cost;
  if (decrease > kConverged * summary.initial_cost && ++loop_->rounds < kMaxRounds) return;
  if (IsConsistent(options_.correction, loop_->graph) && Close(map)) *progress = Progress::kMoved;
  loop_.reset();
}

bool LoopCloser::Close(Map* map) {
  // Keyframes of the candidates may have been removed in the meantime.
  for (const LoopCandidate& candidate : loop_->candidates)
    if (!map->FindKeyFrame(candidate.keyframe) || !map->FindKeyFrame(candidate.place)) return false;
  const LoopCandidate& last = loop_->candidates.back();
  report_ = DescribeError(last, map);
  closed_by_ = last.keyframe;
  ApplyLoopGraph(loop_->graph, map);
  std::set<KeyFrameId> about;
  int fused = 0;
  for (const LoopCandidate& candidate : loop_->candidates) {
    fused += FuseCandidateDuplicates(candidate, map);
    about.insert({candidate.keyframe, candidate.place});
    auto neighbours = map->Covisible(candidate.keyframe);
    if (neighbours.size() > kNeighbours) neighbours.resize(kNeighbours);
    for (const auto& [id, shared] : neighbours) about.insert(id);
  }
  nearby_.assign(about.begin(), about.end());
  to_fuse_.assign(about.begin(), about.end());
  for (const KeyFrameId id : nearby_) map->UpdateDepth(map->FindKeyFrame(id));
  searcher_.Clear();
  report_ += "; " + last.Brief() + ", " + std::to_string(fused) + " points fused";
  return true;
}

void LoopCloser::Fuse(Map* map) {
  std::set<MapPointId> points;
  for (const KeyFrameId id : nearby_) {
    const Map::KeyFrameRecord* record = map->FindKeyFrame(id);
    if (!record) continue;
    for (const Observation& observation : record->observations) points.insert(observation.point);
  }
  MatchAndFusePoints(to_fuse_.front(), {points.begin(), points.end()}, map, &searcher_);
  to_fuse_.pop_front();
}

}  // namespace docent::engine
