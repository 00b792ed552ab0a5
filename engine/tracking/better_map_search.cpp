// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/better_map_search.h"

#include <algorithm>
#include <bit>
#include <utility>

namespace docent::engine {

std::shared_ptr<const MapSnapshot> BetterMapSearch::Continue(const PoseSearch& search,
                                                             MapTrackResult* result) const {
  auto map = search.MapOfHypothesis();
  if (!map) return nullptr;
  RelocalizationResult unused;
  *result = search.verification->Continue(
      search.Query(&unused), *map, search.hypothesis->Predict(search.image), search.hypothesis->panorama());
  return search.RejectionReasonOf(*result, *map) == RejectionReason::kNone ? map : nullptr;
}

std::optional<FoundPose> BetterMapSearch::SearchOtherPlace(const PoseSearch& search, bool pending,
                                                           double visible_inlier_ratio, TrackedFrame* out) {
  if (!pending) return std::nullopt;
  ++frames_since_relocalization_;
  if (visible_inlier_ratio >= options_.poor_visible_ratio) return std::nullopt;
  // Less and less often: the place may have changed permanently.
  constexpr unsigned kMaxInterval = 32;
  const unsigned frames = frames_since_relocalization_;
  if (frames < 2 || !(std::has_single_bit(frames) || frames % kMaxInterval == 0)) return std::nullopt;
  RelocalizationResult unused;
  const auto other =
      search.verification->BestElsewhere(search.Query(&unused), search.map_key, out->camera_from_map, kNoId);
  const double needed = std::max(options_.poor_visible_ratio, options_.better_ratio * visible_inlier_ratio);
  std::optional<FoundPose> found;
  if (other && other->result.VisibleInlierRatio() >= needed)
    found = ReturnToMap(search, *other, options_.poor_visible_ratio, &unused);
  out->relocalization = {};
  return found;
}

std::optional<FoundPose> BetterMapSearch::SearchOverlappingMap(const PoseSearch& search,
                                                               double visible_inlier_ratio,
                                                               const TrackedFrame& out) {
  MapHypothesis& hypothesis = *search.hypothesis;
  if (visible_inlier_ratio >= options_.poor_visible_ratio) {
    hypothesis.Clear();
    return std::nullopt;
  }
  const auto is_better = [&](const MapTrackResult& result) {
    return result.VisibleInlierRatio() > options_.better_ratio * visible_inlier_ratio;
  };
  if (hypothesis.exists()) {
    MapTrackResult result;
    auto map = Continue(search, &result);
    if (!map || !is_better(result)) {
      hypothesis.Clear();
      return std::nullopt;
    }
    hypothesis.Confirm(result.camera_from_map);
    if (hypothesis.frames() < options_.confirming_frames) return std::nullopt;
    return EnterMap(search, std::move(map));
  }
  const bool good = out.quality >= options_.good_quality;
  if (++frames_since_search_ < options_.frames_between_better_map_searches && good) return std::nullopt;
  frames_since_search_ = 0;
  std::vector<AlignedPlace> others =
      search.retrieval->ByThumbnail(search.image, *search.finder, search.map_key);
  if (others.size() > options_.max_verified) others.resize(options_.max_verified);
  RelocalizationResult unused;
  for (const AlignedPlace& place : others) {
    const VerifiedPlace verified = search.verification->Try(search.Query(&unused), place);
    if (search.RejectionReasonOf(verified.result, *place.candidate.map) != RejectionReason::kNone ||
        !is_better(verified.result))
      continue;
    hypothesis.Begin(verified);
    break;
  }
  return std::nullopt;
}

std::optional<FoundPose> BetterMapSearch::SearchKnownMaps(const PoseSearch& search) {
  // About four searches per second, and more often while little would be lost by returning.
  const int frames_between = search.map->HasFinitePoints() ? 8 : 2;
  MapHypothesis& hypothesis = *search.hypothesis;
  if (hypothesis.exists() && hypothesis.map_key() != search.map_key) {
    MapTrackResult result;
    auto map = Continue(search, &result);
    if (!map || result.VisibleInlierRatio() < options_.poor_visible_ratio) {
      hypothesis.Clear();
      return std::nullopt;
    }
    hypothesis.Confirm(result.camera_from_map);
    if (hypothesis.frames() < options_.confirming_frames) return std::nullopt;
    return EnterMap(search, std::move(map));
  }
  if (++frames_since_search_ < frames_between) return std::nullopt;
  frames_since_search_ = 0;
  RelocalizationResult unused;
  const std::vector<VerifiedPlace> found = search.verification->Verify(
      search.Query(&unused), search.retrieval->ByThumbnail(search.image, *search.finder, search.map_key));
  if (found.empty() || found.front().result.VisibleInlierRatio() < options_.poor_visible_ratio)
    return std::nullopt;
  const bool competitor = found.size() > 1 && found.front().result.Quality() <
                                                  options_.min_quality_ratio * found[1].result.Quality();
  if (!competitor) hypothesis.Begin(found.front());
  return std::nullopt;
}

}  // namespace docent::engine
