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

constexpr int kIterationsAStep = 2;
constexpr int kMaxRounds = 15;
constexpr double kSettled = 1e-4;        // of the cost, by which a round makes it less
constexpr std::size_t kNeighbours = 16;  // of each sighting's keyframe, that are gone through afterwards
constexpr double kDegrees = 57.29577951308232;

// What the loop was wrong by.
std::string SizeOfError(const LoopCandidate& sighting, Map* map) {
  const Sim3 error = KnownFromRecent(sighting, map);
  const KeyFrame& keyframe = map->FindKeyFrame(sighting.keyframe)->keyframe;
  const Eigen::Vector3d center = keyframe.camera_from_map.OriginInSource();
  const double shift = (error * center - center).norm();
  const double way = Covisibility(*map).PathLengthBetween(sighting.keyframe, sighting.place, *map);
  char text[160];
  std::snprintf(text, sizeof(text), "off by %.1f %% of the way, %.2f degrees, %+.1f %% of scale",
                100 * shift / way, kDegrees * error.rotation.Angle(), 100 * (error.scale - 1));
  return text;
}

}  // namespace

void LoopCloser::Begin() {
  finder_.Clear();
  to_look_.clear();
  loop_.reset();
  about_.clear();
  to_fuse_.clear();
  closed_by_ = kNoId;
  searcher_.Release();
}

void LoopCloser::Look(KeyFrameId keyframe) {
  if (!options_.enabled) return;
  to_look_.push_back(keyframe);
}

LoopCloser::Progress LoopCloser::Step(Map* map) {
  const Progress progress = DoStep(map);
  if (!HasFound() && to_look_.empty()) searcher_.Release();
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
  if (to_look_.empty()) return Progress::kNothing;
  std::vector<LoopCandidate> sightings = finder_.Look(to_look_.front(), map, &searcher_);
  to_look_.pop_front();
  if (sightings.empty()) return Progress::kWorked;
  Loop found;
  found.graph = MakeLoopGraph(options_.correction, sightings, map);
  found.sightings = std::move(sightings);
  loop_ = std::move(found);
  return Progress::kWorked;
}

// Spreads the error a little more; at last moves the map.
void LoopCloser::OptimizePoseGraph(Map* map, Progress* progress) {
  PoseGraphOptions one_round = options_.correction.graph;
  one_round.max_iterations = kIterationsAStep;
  const PoseGraphSummary summary = RelaxPoseGraph(one_round, &loop_->graph.graph);
  if (!summary.solved) {
    loop_.reset();
    return;
  }
  const double decrease = summary.initial_cost - summary.final_cost;
  if (decrease > kSettled * summary.initial_cost && ++loop_->rounds < kMaxRounds) return;
  if (IsConsistent(options_.correction, loop_->graph) && Close(map)) *progress = Progress::kMoved;
  loop_.reset();
}

bool LoopCloser::Close(Map* map) {
  // Whatever happened since the keyframes were seen may have taken some away.
  for (const LoopCandidate& sighting : loop_->sightings)
    if (!map->FindKeyFrame(sighting.keyframe) || !map->FindKeyFrame(sighting.place)) return false;
  const LoopCandidate& last = loop_->sightings.back();
  report_ = SizeOfError(last, map);
  closed_by_ = last.keyframe;
  ApplyLoopGraph(loop_->graph, map);
  std::set<KeyFrameId> about;
  int fused = 0;
  for (const LoopCandidate& sighting : loop_->sightings) {
    fused += FuseTwins(sighting, map);
    about.insert({sighting.keyframe, sighting.place});
    auto neighbours = map->Covisible(sighting.keyframe);
    if (neighbours.size() > kNeighbours) neighbours.resize(kNeighbours);
    for (const auto& [id, shared] : neighbours) about.insert(id);
  }
  about_.assign(about.begin(), about.end());
  to_fuse_.assign(about.begin(), about.end());
  for (const KeyFrameId id : about_) map->UpdateDepth(map->FindKeyFrame(id));
  searcher_.Clear();
  report_ += "; " + last.Brief() + ", " + std::to_string(fused) + " points fused";
  return true;
}

void LoopCloser::Fuse(Map* map) {
  std::set<MapPointId> points;
  for (const KeyFrameId id : about_) {
    const Map::KeyFrameRecord* record = map->FindKeyFrame(id);
    if (!record) continue;
    for (const Observation& observation : record->observations) points.insert(observation.point);
  }
  FuseSeenTwice(to_fuse_.front(), {points.begin(), points.end()}, map, &searcher_);
  to_fuse_.pop_front();
}

}  // namespace docent::engine
