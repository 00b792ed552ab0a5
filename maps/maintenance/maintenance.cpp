// SPDX-License-Identifier: Apache-2.0
#include "maps/maintenance/maintenance.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/base/error.h"
#include "engine/map/map.h"
#include "engine/mapping/bundle/map_adjustment.h"
#include "engine/mapping/points/keyframe_culling.h"
#include "engine/matching/guided_matching.h"

namespace docent::maps {

double ReprojectionRms(const engine::MapSnapshot& map, const engine::MapSnapshot& counted) {
  double squares = 0;
  std::size_t count = 0;
  const auto before = [](const engine::Observation& a, const engine::Observation& b) {
    return std::pair(a.keyframe, a.point) < std::pair(b.keyframe, b.point);
  };
  for (const engine::Observation& observation : map.observations) {
    if (!std::binary_search(counted.observations.begin(), counted.observations.end(), observation, before))
      continue;
    const engine::KeyFrame* const keyframe = map.FindKeyFrame(observation.keyframe);
    const engine::MapPoint* const point = map.FindPoint(observation.point);
    if (!keyframe || !point || point->infinite()) continue;
    const auto pixel = keyframe->camera->Project(keyframe->camera_from_map * point->position());
    if (!pixel) continue;
    squares += (*pixel - observation.pixel.cast<double>()).squaredNorm();
    ++count;
  }
  return count > 0 ? std::sqrt(squares / static_cast<double>(count)) : 0;
}

namespace {

struct Change {
  Optimization::Outcome outcome = Optimization::Outcome::kFailed;
  std::size_t found = 0;
  std::size_t keyframes_removed = 0, observations_of_keyframes = 0;
};

// No camera is in an idle map, so its newest keyframes are treated like the others.
void CullRedundantKeyFrame(const std::atomic<bool>* interrupt, engine::Map* map, Change* change) {
  while (!interrupt || !*interrupt) {
    const engine::KeyFrameId id = engine::FindRedundantKeyFrame({}, engine::kNoId, map);
    if (id == engine::kNoId) return;
    change->observations_of_keyframes += map->FindKeyFrame(id)->observations.size();
    engine::CullKeyFrame(id, map);
    ++change->keyframes_removed;
  }
}

// Two bundle adjustments, with guided matching between them.
Change Adjust(const std::atomic<bool>* interrupt, engine::Map* map) {
  using Outcome = Optimization::Outcome;
  // There is no time limit, so the adjustment runs until it has nearly converged.
  engine::MapAdjustmentOptions options;
  options.global_iterations = 40;
  const std::size_t points = map->AlivePoints();
  Change change;
  engine::PointSearcher searcher;
  double cost_reduction = 0, cost = 0;
  int outliers = 0;
  for (const bool guided_matching : {false, true}) {
    if (guided_matching) {
      std::vector<engine::KeyFrameId> ids;
      for (const auto& [id, record] : map->keyframes()) ids.push_back(id);
      for (const engine::KeyFrameId id : ids) {
        if (interrupt && *interrupt) {
          change.outcome = Outcome::kInterrupted;
          return change;
        }
        change.found += static_cast<std::size_t>(engine::MatchMapPoints({}, id, &searcher, map));
      }
      if (change.found == 0) break;
    }
    const engine::BundleSummary summary = engine::AdjustGlobally(options, interrupt, map);
    if ((interrupt && *interrupt) || summary.outcome == engine::BundleSummary::Outcome::kInterrupted) {
      change.outcome = Outcome::kInterrupted;
      return change;
    }
    if (summary.outcome == engine::BundleSummary::Outcome::kFailed) return change;
    if (!guided_matching) {
      cost = summary.initial_cost;
      cost_reduction = summary.initial_cost - summary.final_cost;
    }
    outliers += summary.outliers;
  }
  const bool same_points = points == map->AlivePoints();
  CullRedundantKeyFrame(interrupt, map, &change);
  if (interrupt && *interrupt) {
    change.outcome = Outcome::kInterrupted;
    return change;
  }
  // Saving a negligible improvement would only wear the disk. Observations that were added and then rejected
  // as outliers do not count as a change.
  constexpr double kMinCostReduction = 1e-6;  // Ratio of the initial cost.
  const bool same_observations =
      static_cast<std::size_t>(outliers) == change.found && same_points && change.keyframes_removed == 0;
  change.outcome = same_observations && cost_reduction <= kMinCostReduction * cost ? Outcome::kAlreadyOptimal
                                                                                   : Outcome::kAdjusted;
  return change;
}

}  // namespace

AdjustedMap AdjustIdleMap(const engine::MapSnapshot& snapshot, const std::atomic<bool>* interrupt) {
  using Outcome = Optimization::Outcome;
  AdjustedMap adjusted;
  Optimization& result = adjusted.optimization;
  if (snapshot.keyframes.size() < 2 || !snapshot.HasFinitePoints()) {
    result.outcome = Outcome::kTooSmall;
    return adjusted;
  }
  engine::Map map(snapshot);
  const Change change = Adjust(interrupt, &map);
  result.outcome = change.outcome;
  if (change.outcome != Outcome::kAdjusted) return adjusted;
  adjusted.snapshot = map.Snapshot();
  const std::size_t before = snapshot.observations.size(), after = adjusted.snapshot->observations.size();
  result.rms_before_px = ReprojectionRms(snapshot, *adjusted.snapshot);
  result.rms_after_px = ReprojectionRms(*adjusted.snapshot, snapshot);
  result.points_removed = snapshot.points.size() - adjusted.snapshot->points.size();
  result.observations_added = change.found;
  result.keyframes_removed = change.keyframes_removed;
  result.observations_removed = before + change.found - after - change.observations_of_keyframes;
  return adjusted;
}

Optimization OptimizeMap(Library* library, std::uint64_t key, const std::atomic<bool>* interrupt,
                         const MoveScene& move_scene) {
  using Outcome = Optimization::Outcome;
  Optimization result;
  if (!MayChangeStructure(library->Find(key).policy)) {
    result.outcome = Outcome::kNotAllowed;
    return result;
  }
  const StoredMap stored = library->Load(key);
  AdjustedMap adjusted = AdjustIdleMap(*stored.snapshot, interrupt);
  if (!adjusted.snapshot) return adjusted.optimization;
  MapRecord record;
  record.key = key;
  record.name = stored.info.name;
  record.snapshot = std::move(adjusted.snapshot);
  record.expected = stored.info;
  if (move_scene) {
    StoredContent content{std::make_shared<const SceneRecord>(stored.scene), nullptr};
    try {
      if (auto history = library->LoadHistory(key))
        content.history = std::make_shared<const SceneRecord>(std::move(*history));
    } catch (const Error&) {
      content.history.reset();  // A damaged history is lost when the scene moves.
    }
    StoredContent moved = move_scene(content, *stored.snapshot, *record.snapshot);
    record.scene = std::move(moved.scene);
    record.history = std::move(moved.history);
  }
  if (!library->Save(record)) adjusted.optimization.outcome = Outcome::kChangedMeanwhile;
  return adjusted.optimization;
}

}  // namespace docent::maps
