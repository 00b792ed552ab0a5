// SPDX-License-Identifier: Apache-2.0
#include "maps/upkeep.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/map/map.h"
#include "engine/mapping/map_adjustment.h"
#include "engine/mapping/refinding.h"

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
};

// Both adjustments and the refinding between them.
Change Adjust(const std::atomic<bool>* interrupt, engine::Map* map) {
  using Outcome = Optimization::Outcome;
  // Nobody waits for it: it goes on until it has converged, or nearly.
  engine::MapAdjustmentOptions options;
  options.global_iterations = 40;
  const std::size_t points = map->AlivePoints();
  Change change;
  engine::PointSearcher searcher;
  double gained = 0, cost = 0;
  int outliers = 0;
  for (const bool refind : {false, true}) {
    if (refind) {
      std::vector<engine::KeyFrameId> ids;
      for (const auto& [id, record] : map->keyframes()) ids.push_back(id);
      for (const engine::KeyFrameId id : ids) {
        if (interrupt && *interrupt) {
          change.outcome = Outcome::kInterrupted;
          return change;
        }
        change.found += static_cast<std::size_t>(engine::RefindPoints({}, id, &searcher, map));
      }
      if (change.found == 0) break;
    }
    const engine::BundleSummary summary = engine::AdjustGlobally(options, interrupt, map);
    if ((interrupt && *interrupt) || summary.outcome == engine::BundleSummary::Outcome::kInterrupted) {
      change.outcome = Outcome::kInterrupted;
      return change;
    }
    if (summary.outcome == engine::BundleSummary::Outcome::kFailed) return change;
    if (!refind) {
      cost = summary.initial_cost;
      gained = summary.initial_cost - summary.final_cost;
    }
    outliers += summary.outliers;
  }
  // Saving what moved by nothing that counts would only wear the disk. What was found and did not hold is
  // nothing either.
  constexpr double kWorthwhile = 1e-6;
  const bool same_observations =
      static_cast<std::size_t>(outliers) == change.found && points == map->AlivePoints();
  change.outcome =
      same_observations && gained <= kWorthwhile * cost ? Outcome::kAlreadyBest : Outcome::kAdjusted;
  return change;
}

}  // namespace

Optimization OptimizeMap(Library* library, std::uint64_t key, const std::atomic<bool>* interrupt) {
  using Outcome = Optimization::Outcome;
  Optimization result;
  if (!MayChangeStructure(library->Find(key).policy)) {
    result.outcome = Outcome::kNotAllowed;
    return result;
  }
  const StoredMap stored = library->Load(key);
  if (stored.snapshot->keyframes.size() < 2 || !stored.snapshot->HasFinitePoints()) {
    result.outcome = Outcome::kTooSmall;
    return result;
  }
  engine::Map map(*stored.snapshot);
  const Change change = Adjust(interrupt, &map);
  if (change.outcome != Outcome::kAdjusted) {
    result.outcome = change.outcome;
    return result;
  }
  if (library->Find(key).modified != stored.info.modified) {
    result.outcome = Outcome::kChangedMeanwhile;
    return result;
  }
  const auto adjusted = map.Snapshot();
  const std::size_t before = stored.snapshot->observations.size(), after = adjusted->observations.size();
  result.outcome = Outcome::kAdjusted;
  result.rms_before_px = ReprojectionRms(*stored.snapshot, *adjusted);
  result.rms_after_px = ReprojectionRms(*adjusted, *stored.snapshot);
  result.points_removed = stored.snapshot->points.size() - adjusted->points.size();
  result.observations_added = change.found;
  result.observations_removed = before + change.found - after;
  MapRecord record;
  record.key = key;
  record.name = stored.info.name;
  record.snapshot = adjusted;
  library->Save(record);
  return result;
}

}  // namespace docent::maps
