// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/loop_detector.h"

#include <algorithm>
#include <utility>

#include "engine/mapping/covisibility.h"

namespace docent::engine {

void LoopDetector::Clear() {
  search_.Clear();
  sightings_.clear();
}

std::vector<LoopCandidate> LoopDetector::Look(KeyFrameId id, Map* map, PointSearcher* searcher) {
  const Map::KeyFrameRecord* record = map->FindKeyFrame(id);
  if (!record || record->keyframe.kind != KeyFrameKind::kSixDof) return {};
  const std::optional<LoopCandidate> sighting = Sight(id, map, searcher);
  if (!sighting) {
    sightings_.clear();
    return {};
  }
  std::erase_if(sightings_, [&](const LoopCandidate& before) {
    return !map->FindKeyFrame(before.keyframe) || !map->FindKeyFrame(before.place);
  });
  if (!sightings_.empty() && !Agree(sightings_.back(), *sighting, map)) sightings_.clear();
  sightings_.push_back(*sighting);
  if (sightings_.size() < options_.agreeing || !Agree(sightings_.front(), *sighting, map)) return {};
  return std::exchange(sightings_, {});
}

std::optional<LoopCandidate> LoopDetector::Sight(KeyFrameId id, Map* map, PointSearcher* searcher) {
  const LoopCandidateSearchOptions& search = options_.search;
  std::optional<LoopCandidate> plausible;
  search_.Find(id, Neighbourhood(id, search.min_share, search.hops, map), map, searcher,
               [&](LoopCandidate sighting) {
                 if (!IsPlausible(sighting, map)) return false;
                 plausible = std::move(sighting);
                 return true;
               });
  return plausible;
}

bool LoopDetector::IsPlausible(const LoopCandidate& sighting, Map* map) const {
  const KeyFrame& keyframe = map->FindKeyFrame(sighting.keyframe)->keyframe;
  const SimilaritySize error = SizeAt(KnownFromRecent(sighting, map), keyframe);
  if (error.largest() < options_.least_error) return false;
  if (error.turn > options_.max_turn || error.scale > options_.max_scale) return false;
  const double way = Covisibility(*map).PathLengthBetween(sighting.keyframe, sighting.place, *map);
  return error.shift * keyframe.mean_depth <= options_.max_shift * way;
}

bool LoopDetector::Agree(const LoopCandidate& a, const LoopCandidate& b, Map* map) const {
  const Sim3 difference = KnownFromRecent(a, map).inverse() * KnownFromRecent(b, map);
  return SizeAt(difference, map->FindKeyFrame(b.keyframe)->keyframe).largest() <= options_.max_disagreement;
}

}  // namespace docent::engine
