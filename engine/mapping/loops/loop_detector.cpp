// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/loops/loop_detector.h"

#include <algorithm>
#include <utility>

#include "engine/mapping/points/covisibility.h"

namespace docent::engine {

std::optional<std::string> LoopDetectorOptions::Validate() const {
  return OptionCheck()
      .Contained(search.Validate())
      .AtLeast(min_error, 0, "smallest error of a loop")
      .Positive(max_translation, "drift of a loop")
      .Positive(max_rotation, "rotation error of a loop")
      .Positive(max_log_scale, "scale error of a loop")
      .That(min_consecutive > 0, "A loop needs at least one keyframe.")
      .Positive(max_disagreement, "disagreement of loop candidates")
      .fault();
}

void LoopDetector::Clear() {
  search_.Clear();
  candidates_.clear();
}

std::vector<LoopCandidate> LoopDetector::Detect(KeyFrameId id, Map* map, PointSearcher* searcher) {
  const Map::KeyFrameRecord* record = map->FindKeyFrame(id);
  if (!record || record->keyframe.kind != KeyFrameKind::kSixDof) return {};
  const std::optional<LoopCandidate> candidate = FindCandidate(id, map, searcher);
  std::erase_if(candidates_, [&](const LoopCandidate& earlier) {
    return !map->FindKeyFrame(earlier.keyframe) || !map->FindKeyFrame(earlier.place);
  });
  if (!candidate) {
    // Another camera looks elsewhere and says nothing of the place.
    if (!candidates_.empty() && map->FindKeyFrame(candidates_.back().keyframe)
                                    ->keyframe.camera->HasSameLens(*record->keyframe.camera))
      candidates_.clear();
    return {};
  }
  if (!candidates_.empty() && !Agree(candidates_.back(), *candidate, map)) candidates_.clear();
  // Small disagreements of neighbours add up, or the first candidate was wrong: the series starts later then.
  candidates_.erase(candidates_.begin(), std::ranges::find_if(candidates_, [&](const LoopCandidate& earlier) {
                      return Agree(earlier, *candidate, map);
                    }));
  candidates_.push_back(*candidate);
  if (candidates_.size() < options_.min_consecutive) return {};
  return std::exchange(candidates_, {});
}

std::optional<LoopCandidate> LoopDetector::FindCandidate(KeyFrameId id, Map* map, PointSearcher* searcher) {
  const LoopCandidateSearchOptions& search = options_.search;
  std::optional<LoopCandidate> plausible;
  Neighbourhoods neighbourhoods(search.min_covisibility_ratio, map);
  search_.Find(id, neighbourhoods.Of(id, search.hops), &neighbourhoods, searcher,
               [&](LoopCandidate candidate) {
                 if (!IsPlausible(candidate, map)) return false;
                 plausible = std::move(candidate);
                 return true;
               });
  return plausible;
}

bool LoopDetector::IsPlausible(const LoopCandidate& candidate, Map* map) const {
  const KeyFrame& keyframe = map->FindKeyFrame(candidate.keyframe)->keyframe;
  const SimilarityMagnitude error = MagnitudeAt(KnownFromRecent(candidate, map), keyframe);
  if (error.largest() < options_.min_error) return false;
  if (error.rotation > options_.max_rotation || error.log_scale > options_.max_log_scale) return false;
  const double path_length = Covisibility(*map).PathLengthBetween(candidate.keyframe, candidate.place, *map);
  return error.translation * keyframe.mean_depth <= options_.max_translation * path_length;
}

bool LoopDetector::Agree(const LoopCandidate& a, const LoopCandidate& b, Map* map) const {
  const Sim3 difference = KnownFromRecent(a, map).inverse() * KnownFromRecent(b, map);
  return MagnitudeAt(difference, map->FindKeyFrame(b.keyframe)->keyframe).largest() <=
         options_.max_disagreement;
}

}  // namespace docent::engine
