// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/loops/loop_closing.h"

#include <algorithm>
#include <set>
#include <utility>

#include "engine/mapping/points/covisibility.h"

namespace docent::engine {
namespace {

constexpr int kIterationsPerStep = 2;
constexpr int kMaxRounds = 15;
// Relative decrease of the cost in one round, below which it has converged.
constexpr double kConverged = 1e-4;
// Neighbours of each candidate's keyframe that are searched for duplicate points afterwards.
constexpr std::size_t kLoopNeighbours = 16;

// The figures of the loop that a candidate implies, before the map is corrected.
ClosedLoop FiguresOf(const LoopCandidate& candidate, Map* map) {
  const Sim3 error = KnownFromRecent(candidate, map);
  const KeyFrame& keyframe = map->FindKeyFrame(candidate.keyframe)->keyframe;
  const Eigen::Vector3d center = keyframe.camera_from_map.OriginInSource();
  const double path_length = Covisibility(*map).PathLengthBetween(candidate.keyframe, candidate.place, *map);
  ClosedLoop loop;
  loop.keyframe = candidate.keyframe;
  loop.place = candidate.place;
  loop.drift = (error * center - center).norm() / path_length;
  loop.rotation = error.rotation.Angle();
  loop.scale = error.scale;
  loop.found = candidate.seen.size();
  loop.expected = candidate.expected;
  loop.duplicates = candidate.duplicates.size();
  loop.reverse_inliers = candidate.reverse_inliers;
  return loop;
}

}  // namespace

std::optional<std::string> LoopOptions::Validate() const {
  return OptionCheck().Contained(detector.Validate()).Contained(correction.Validate()).fault();
}

void LoopCloser::Reset() {
  detector_.Clear();
  queue_.clear();
  loop_.reset();
  nearby_.clear();
  to_fuse_.clear();
  last_ = {};
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
  last_ = FiguresOf(loop_->candidates.back(), map);
  ApplyLoopGraph(loop_->graph, map);
  std::set<KeyFrameId> about;
  for (const LoopCandidate& candidate : loop_->candidates) {
    last_.fused += FuseCandidateDuplicates(candidate, map);
    about.insert({candidate.keyframe, candidate.place});
    auto neighbours = map->Covisible(candidate.keyframe);
    if (neighbours.size() > kLoopNeighbours) neighbours.resize(kLoopNeighbours);
    for (const auto& [id, shared] : neighbours) about.insert(id);
  }
  nearby_.assign(about.begin(), about.end());
  to_fuse_.assign(about.begin(), about.end());
  for (const KeyFrameId id : nearby_) map->UpdateDepth(map->FindKeyFrame(id));
  searcher_.Clear();
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
