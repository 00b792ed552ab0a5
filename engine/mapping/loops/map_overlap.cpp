// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/loops/map_overlap.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <set>
#include <utility>

#include "engine/base/option_check.h"
#include "engine/base/stable_sort.h"
#include "engine/mapping/loops/overlap_verification.h"

namespace docent::engine {
namespace {

// A recognized keyframe of B, and the similarity that it implies.
struct Recognition {
  std::size_t order = 0;  // index of the keyframe in OverlapKeyFrames::in_b
  LoopCandidate candidate;
  Sim3 a_from_b;
};

class OverlapFinder {
 public:
  OverlapFinder(const MapOverlapOptions& options, KeyFrameId first_of_b, const std::atomic<bool>* interrupt,
                Map* map)
      : options_(options),
        interrupt_(interrupt),
        map_(map),
        search_(options.search),
        keyframes_{first_of_b, {}, {}},
        verification_(options, &keyframes_, map, &searcher_) {
    for (const auto& [id, record] : map->keyframes()) {
      if (record.keyframe.kind != KeyFrameKind::kSixDof) continue;
      (keyframes_.IsOfA(id) ? keyframes_.in_a : keyframes_.in_b).push_back(id);
    }
  }

  MapOverlap Find() {
    using Outcome = MapOverlap::Outcome;
    MapOverlap overlap;
    const std::size_t min_keyframes = options_.min_consecutive;
    if (keyframes_.in_a.size() < min_keyframes || keyframes_.in_b.size() < min_keyframes) return overlap;
    RecognizeKeyFrames(&overlap);
    overlap.outcome = Outcome::kNothingRecognized;
    std::vector<OverlapEvidence> examined;
    for (const std::size_t seed : BySupport()) {
      if (examined.size() >= options_.max_hypotheses || Interrupted()) break;
      const bool known = std::any_of(examined.begin(), examined.end(), [&](const OverlapEvidence& evidence) {
        return Confirms(evidence, recognitions_[seed].candidate);
      });
      if (!known) examined.push_back(Examine(seed));
    }
    StableSort(&examined,
               [](const OverlapEvidence& a, const OverlapEvidence& b) { return a.Points() > b.Points(); });
    OverlapEvidence best;
    if (!examined.empty()) best = std::move(examined.front());
    for (std::size_t i = 1; i < examined.size(); ++i) {
      std::size_t other_points = 0;
      for (const LoopCandidate& candidate : examined[i].candidates)
        other_points += Confirms(best, candidate) ? 0 : candidate.seen.size();
      overlap.second_points = std::max(overlap.second_points, other_points);
    }
    overlap.a_from_b = best.a_from_b;
    overlap.consecutive = best.consecutive;
    overlap.with_view = best.with_view;
    overlap.confirmed = best.candidates.size();
    overlap.found_ratio = best.MedianFoundRatio();
    overlap.points = best.Points();
    overlap.regions = best.regions;
    overlap.contradicted = best.contradicted;
    overlap.candidates = std::move(best.candidates);
    if (Interrupted()) {
      overlap.outcome = Outcome::kInterrupted;
    } else if (overlap.recognized > 0) {
      overlap.outcome = Decide(overlap);
    }
    return overlap;
  }

 private:
  const KeyFrame& At(KeyFrameId id) const { return map_->keyframes().at(id).keyframe; }
  bool Interrupted() const { return interrupt_ && *interrupt_; }
  MapOverlap::Outcome Decide(const MapOverlap& overlap) const;
  void RecognizeKeyFrames(MapOverlap* overlap);
  std::vector<std::size_t> BySupport() const;
  bool Confirms(const OverlapEvidence& evidence, const LoopCandidate& candidate) const;
  std::size_t LongestSeries(const Sim3& a_from_b) const;
  std::size_t LongestSeries(const std::set<std::size_t>& agreeing,
                            const std::vector<std::size_t>& orders) const;
  bool IsOtherViewpoint(const KeyFrame& a, const KeyFrame& b) const;
  // The difference of two similarities at a keyframe of B, in the coordinates of B.
  double Difference(const Sim3& a_from_b, const Sim3& other_a_from_b, const KeyFrame& keyframe) const {
    return MagnitudeAt(a_from_b.inverse() * other_a_from_b, keyframe).largest();
  }
  OverlapEvidence Examine(std::size_t seed);

  const MapOverlapOptions& options_;
  const std::atomic<bool>* const interrupt_;
  Map* const map_;
  LoopCandidateSearch search_;
  PointSearcher searcher_;
  OverlapKeyFrames keyframes_;
  OverlapVerification verification_;
  std::vector<Recognition> recognitions_;
};

MapOverlap::Outcome OverlapFinder::Decide(const MapOverlap& overlap) const {
  using Outcome = MapOverlap::Outcome;
  if (overlap.consecutive < options_.min_consecutive) return Outcome::kTooFewConsecutive;
  if (static_cast<double>(overlap.confirmed) <
      options_.min_confirmed_ratio * static_cast<double>(overlap.with_view))
    return Outcome::kTooFewConfirmed;
  if (overlap.found_ratio < options_.min_found_ratio) return Outcome::kTooFewPoints;
  if (static_cast<double>(overlap.contradicted) >
      options_.max_contradicted_ratio * static_cast<double>(overlap.regions))
    return Outcome::kSurfacesDiffer;
  if (static_cast<double>(overlap.second_points) >
      options_.max_second_ratio * static_cast<double>(overlap.points))
    return Outcome::kAmbiguous;
  return Outcome::kOverlap;
}

void OverlapFinder::RecognizeKeyFrames(MapOverlap* overlap) {
  std::set<KeyFrameId> all_of_b;
  for (const auto& [id, record] : map_->keyframes()) {
    if (!keyframes_.IsOfA(id)) all_of_b.insert(id);
  }
  Neighbourhoods neighbourhoods(options_.search.min_covisibility_ratio, map_);
  for (std::size_t order = 0; order < keyframes_.in_b.size() && !Interrupted(); ++order) {
    const std::size_t before = recognitions_.size();
    search_.Find(keyframes_.in_b[order], all_of_b, &neighbourhoods, &searcher_, [&](LoopCandidate candidate) {
      const Sim3 a_from_b = KnownFromRecent(candidate, map_);
      recognitions_.push_back({order, std::move(candidate), a_from_b});
      return false;
    });
    if (recognitions_.size() > before) ++overlap->recognized;
  }
  search_.Clear();
}

// Indices of the recognitions, those with most agreeing keyframes first.
std::vector<std::size_t> OverlapFinder::BySupport() const {
  std::vector<std::pair<std::size_t, std::size_t>> ranked;
  for (std::size_t seed = 0; seed < recognitions_.size(); ++seed) {
    std::set<std::size_t> agreeing;
    for (const Recognition& other : recognitions_) {
      if (Difference(recognitions_[seed].a_from_b, other.a_from_b, At(other.candidate.keyframe)) <=
          options_.max_disagreement)
        agreeing.insert(other.order);
    }
    ranked.emplace_back(agreeing.size(), seed);
  }
  std::stable_sort(ranked.begin(), ranked.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<std::size_t> seeds;
  for (const auto& [support, seed] : ranked) seeds.push_back(seed);
  return seeds;
}

// True if the evidence places the candidate's keyframe at about the same pose. Drift bends a map, so one
// similarity that varies slightly is not a second hypothesis.
bool OverlapFinder::Confirms(const OverlapEvidence& evidence, const LoopCandidate& candidate) const {
  const Sim3 implied = KnownFromRecent(candidate, map_);
  return std::any_of(evidence.candidates.begin(), evidence.candidates.end(), [&](const LoopCandidate& other) {
    return other.keyframe == candidate.keyframe &&
           MagnitudeAt(implied.inverse() * KnownFromRecent(other, map_), At(other.keyframe)).largest() <=
               options_.min_hypothesis_difference;
  });
}

bool OverlapFinder::IsOtherViewpoint(const KeyFrame& a, const KeyFrame& b) const {
  const double shift = (a.camera_from_map.OriginInSource() - b.camera_from_map.OriginInSource()).norm();
  const double rotation = (a.camera_from_map.rotation * b.camera_from_map.rotation.inverse()).Angle();
  return shift > options_.min_viewpoint_step * b.mean_depth || rotation > options_.min_viewpoint_step;
}

// The largest number of keyframes, consecutive among those in `orders`, that agree.
std::size_t OverlapFinder::LongestSeries(const std::set<std::size_t>& agreeing,
                                         const std::vector<std::size_t>& orders) const {
  std::size_t longest = 0, row = 0, last = 0;
  for (const std::size_t order : orders) {
    if (!agreeing.contains(order)) {
      row = 0;
      continue;
    }
    if (row == 0 || IsOtherViewpoint(At(keyframes_.in_b[last]), At(keyframes_.in_b[order]))) ++row;
    last = order;
    longest = std::max(longest, row);
  }
  return longest;
}

// The largest number of consecutive keyframes of B, or of one of its cameras, that were recognized in
// agreement with the similarity.
std::size_t OverlapFinder::LongestSeries(const Sim3& a_from_b) const {
  std::set<std::size_t> agreeing;
  for (const Recognition& recognition : recognitions_) {
    if (Difference(a_from_b, recognition.a_from_b, At(recognition.candidate.keyframe)) <=
        options_.max_disagreement)
      agreeing.insert(recognition.order);
  }
  std::vector<std::size_t> all;
  // The keyframes of several cameras come by turns, and one camera may look elsewhere.
  std::vector<std::vector<std::size_t>> by_lens;
  for (std::size_t order = 0; order < keyframes_.in_b.size(); ++order) {
    all.push_back(order);
    const CameraModel& camera = *At(keyframes_.in_b[order]).camera;
    const auto same = std::find_if(by_lens.begin(), by_lens.end(), [&](const auto& orders) {
      return At(keyframes_.in_b[orders.front()]).camera->HasSameLens(camera);
    });
    if (same == by_lens.end()) {
      by_lens.push_back({order});
    } else {
      same->push_back(order);
    }
  }
  std::size_t longest = LongestSeries(agreeing, all);
  for (const std::vector<std::size_t>& orders : by_lens)
    longest = std::max(longest, LongestSeries(agreeing, orders));
  return longest;
}

// Visits the keyframes of both maps from the seed outwards. Each is predicted from the nearest confirmed
// keyframe, because drift within a map bends it in ways that one similarity cannot describe.
OverlapEvidence OverlapFinder::Examine(std::size_t seed) {
  OverlapEvidence evidence;
  evidence.a_from_b = recognitions_[seed].a_from_b;
  evidence.consecutive = LongestSeries(evidence.a_from_b);
  struct Known {
    Eigen::Vector3d center_in_a;
    Sim3 a_from_b;
  };
  const auto center_in_a = [&](KeyFrameId id) -> Eigen::Vector3d {
    const Eigen::Vector3d center = At(id).camera_from_map.OriginInSource();
    return keyframes_.IsOfA(id) ? center : evidence.a_from_b * center;
  };
  std::vector<Known> known = {{center_in_a(recognitions_[seed].candidate.keyframe), evidence.a_from_b}};
  struct Pending {
    KeyFrameId id;
    double distance;
    std::size_t nearest;  // index of the nearest known keyframe
  };
  std::vector<Pending> pending;
  for (const auto* ids : {&keyframes_.in_a, &keyframes_.in_b}) {
    for (const KeyFrameId id : *ids)
      pending.push_back({id, (center_in_a(id) - known[0].center_in_a).norm(), 0});
  }
  while (!pending.empty() && !Interrupted()) {
    const auto next =
        std::min_element(pending.begin(), pending.end(),
                         [](const Pending& a, const Pending& b) { return a.distance < b.distance; });
    const KeyFrameId id = next->id;
    const Sim3 a_from_b = known[next->nearest].a_from_b;
    pending.erase(next);
    const auto implied = verification_.Verify(id, a_from_b, &evidence);
    if (!implied) continue;
    known.push_back({center_in_a(id), *implied});
    for (Pending& other : pending) {
      const double distance = (center_in_a(other.id) - known.back().center_in_a).norm();
      if (distance < other.distance) {
        other.distance = distance;
        other.nearest = known.size() - 1;
      }
    }
  }
  return evidence;
}

}  // namespace

std::optional<std::string> MapOverlapOptions::Validate() const {
  return OptionCheck()
      .Contained(search.Validate())
      .That(min_consecutive > 0, "An overlap needs at least one keyframe.")
      .Positive(max_disagreement, "disagreement of keyframes of an overlap")
      .AtLeast(min_viewpoint_step, 0, "step between two viewpoints")
      .Positive(min_hypothesis_difference, "difference of two hypotheses")
      .That(max_hypotheses > 0, "At least one hypothesis of an overlap must be examined.")
      .Positive(max_view_distance, "distance of two similar views")
      .Positive(max_view_angle, "angle between two similar views")
      .AtLeast(min_expected, 1, "number of points of a counted view")
      .Within(min_cells, 0, 16, "number of occupied cells of a view")
      .Ratio(min_confirmed_ratio, "ratio of confirming keyframes")
      .Ratio(min_found_ratio, "ratio of points found")
      .AtLeast(regions_across, 1, "number of regions across an image")
      .AtLeast(min_region_points, 1, "number of points of a region")
      .Ratio(min_region_found_ratio, "ratio of points found in a region")
      .Positive(max_error_px, "error of a point found")
      .Positive(surface_px, "radius of a surface")
      .Positive(surface_depth, "difference of depth on a surface")
      .Ratio(max_contradicted_ratio, "ratio of contradicting regions")
      .Ratio(max_second_ratio, "ratio of points of the second hypothesis")
      .fault();
}

LoopCandidateSearchOptions MapOverlapOptions::ThoroughSearch() {
  LoopCandidateSearchOptions search;
  search.max_new_descriptions = std::numeric_limits<std::size_t>::max();
  search.max_verified = 4;
  return search;
}

MapOverlap FindOverlap(const MapOverlapOptions& options, KeyFrameId first_of_b,
                       const std::atomic<bool>* interrupt, Map* map) {
  return OverlapFinder(options, first_of_b, interrupt, map).Find();
}

}  // namespace docent::engine
