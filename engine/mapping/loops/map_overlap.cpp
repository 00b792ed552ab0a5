// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/loops/map_overlap.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <set>
#include <utility>

#include "engine/base/option_check.h"
#include "engine/geometry/image_grid.h"

namespace docent::engine {
namespace {

constexpr int kVisibleCells = 4;

// A recognised keyframe of B, and the similarity that it implies.
struct Recognition {
  std::size_t order = 0;  // index of the keyframe in in_b_
  LoopCandidate candidate;
  Sim3 a_from_b;
};

// The evidence that the keyframes of both maps give about one similarity.
struct OverlapEvidence {
  Sim3 a_from_b;
  std::size_t consecutive = 0, with_view = 0;
  std::vector<LoopCandidate> candidates;
  double found_ratio = 0;
  std::size_t regions = 0, contradicted = 0;

  std::size_t Points() const {
    std::size_t points = 0;
    for (const LoopCandidate& candidate : candidates) points += candidate.seen.size();
    return points;
  }
};

class OverlapFinder {
 public:
  OverlapFinder(const MapOverlapOptions& options, KeyFrameId first_of_b, const std::atomic<bool>* interrupt,
                Map* map)
      : options_(options),
        first_of_b_(first_of_b),
        interrupt_(interrupt),
        map_(map),
        search_(options.search) {
    for (const auto& [id, record] : map->keyframes()) {
      if (record.keyframe.kind != KeyFrameKind::kSixDof) continue;
      (id < first_of_b ? in_a_ : in_b_).push_back(id);
    }
  }

  MapOverlap Find() {
    using Outcome = MapOverlap::Outcome;
    MapOverlap overlap;
    const std::size_t min_keyframes = options_.min_consecutive;
    if (in_a_.size() < min_keyframes || in_b_.size() < min_keyframes) return overlap;
    RecogniseKeyFrames(&overlap);
    overlap.outcome = Outcome::kNothingRecognised;
    std::vector<OverlapEvidence> examined;
    for (const std::size_t seed : BySupport()) {
      if (examined.size() >= options_.max_hypotheses || Interrupted()) break;
      const bool known = std::any_of(examined.begin(), examined.end(), [&](const OverlapEvidence& evidence) {
        return Confirms(evidence, recognitions_[seed].candidate);
      });
      if (!known) examined.push_back(Examine(seed));
    }
    std::stable_sort(
        examined.begin(), examined.end(),
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
    overlap.found_ratio = best.found_ratio;
    overlap.points = best.Points();
    overlap.regions = best.regions;
    overlap.contradicted = best.contradicted;
    overlap.candidates = std::move(best.candidates);
    if (Interrupted()) {
      overlap.outcome = Outcome::kInterrupted;
    } else if (overlap.recognised > 0) {
      overlap.outcome = Decide(overlap);
    }
    return overlap;
  }

 private:
  const KeyFrame& At(KeyFrameId id) const { return map_->keyframes().at(id).keyframe; }
  bool IsOfA(KeyFrameId id) const { return id < first_of_b_; }
  bool Interrupted() const { return interrupt_ && *interrupt_; }
  MapOverlap::Outcome Decide(const MapOverlap& overlap) const;
  void RecogniseKeyFrames(MapOverlap* overlap);
  std::vector<std::size_t> BySupport() const;
  bool Confirms(const OverlapEvidence& evidence, const LoopCandidate& candidate) const;
  std::size_t LongestSeries(const Sim3& a_from_b) const;
  bool IsOtherViewpoint(const KeyFrame& a, const KeyFrame& b) const;
  // The difference of two similarities at a keyframe of B, in the coordinates of B.
  double Difference(const Sim3& a_from_b, const Sim3& other_a_from_b, const KeyFrame& keyframe) const {
    return MagnitudeAt(a_from_b.inverse() * other_a_from_b, keyframe).largest();
  }
  OverlapEvidence Examine(std::size_t seed);
  std::optional<Sim3> VerifyPrediction(KeyFrameId id, const Sim3& a_from_b, OverlapEvidence* evidence,
                                       std::vector<double>* shares);
  std::vector<KeyFrameId> KeyFramesWithSameView(const KeyFrame& keyframe, const Rigid3& camera_from_other,
                                                double scale) const;
  std::vector<MapPointId> PointsInView(const KeyFrame& keyframe, const std::vector<KeyFrameId>& others,
                                       const Rigid3& camera_from_other);
  std::optional<PredictedPoint> Predict(MapPointId id, const KeyFrame& keyframe,
                                        const Rigid3& camera_from_other);
  void CompareSurfaces(const LoopCandidate& candidate, const std::vector<MapPointId>& points,
                       OverlapEvidence* evidence);
  bool HasSurface(const Map::KeyFrameRecord& keyframe, const Eigen::Vector2d& pixel, double depth) const;

  const MapOverlapOptions& options_;
  const KeyFrameId first_of_b_;
  const std::atomic<bool>* const interrupt_;
  Map* const map_;
  LoopCandidateSearch search_;
  PointSearcher searcher_;
  std::vector<KeyFrameId> in_a_, in_b_;  // localized, in order of creation
  std::vector<Recognition> recognitions_;
};

MapOverlap::Outcome OverlapFinder::Decide(const MapOverlap& overlap) const {
  using Outcome = MapOverlap::Outcome;
  if (overlap.consecutive < options_.min_consecutive) return Outcome::kTooFewConsecutive;
  const auto confirmed = static_cast<double>(overlap.confirmed);
  if (confirmed < options_.min_confirmed_ratio * static_cast<double>(overlap.with_view) ||
      overlap.found_ratio < options_.min_found_ratio ||
      static_cast<double>(overlap.contradicted) >
          options_.max_contradicted_ratio * static_cast<double>(overlap.regions)) {
    return Outcome::kContradicted;
  }
  if (static_cast<double>(overlap.second_points) >
      options_.max_second_ratio * static_cast<double>(overlap.points))
    return Outcome::kAmbiguous;
  return Outcome::kOverlap;
}

void OverlapFinder::RecogniseKeyFrames(MapOverlap* overlap) {
  std::set<KeyFrameId> all_of_b;
  for (const auto& [id, record] : map_->keyframes()) {
    if (!IsOfA(id)) all_of_b.insert(id);
  }
  for (std::size_t order = 0; order < in_b_.size() && !Interrupted(); ++order) {
    const std::size_t before = recognitions_.size();
    search_.Find(in_b_[order], all_of_b, map_, &searcher_, [&](LoopCandidate candidate) {
      const Sim3 a_from_b = KnownFromRecent(candidate, map_);
      recognitions_.push_back({order, std::move(candidate), a_from_b});
      return false;
    });
    if (recognitions_.size() > before) ++overlap->recognised;
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

// The largest number of consecutive keyframes of B that were recognised in agreement with the similarity.
std::size_t OverlapFinder::LongestSeries(const Sim3& a_from_b) const {
  std::set<std::size_t> agreeing;
  for (const Recognition& recognition : recognitions_) {
    if (Difference(a_from_b, recognition.a_from_b, At(recognition.candidate.keyframe)) <=
        options_.max_disagreement)
      agreeing.insert(recognition.order);
  }
  std::size_t longest = 0, row = 0, last = 0;
  for (const std::size_t order : agreeing) {
    const bool continues = row > 0 && order == last + 1;
    if (!continues) {
      row = 1;
    } else if (IsOtherViewpoint(At(in_b_[last]), At(in_b_[order]))) {
      ++row;
    }
    last = order;
    longest = std::max(longest, row);
  }
  return longest;
}

// Verifies a keyframe that a similarity predicts, and adds what it shows to the evidence. Returns the
// similarity that the keyframe implies; empty if it does not confirm the prediction.
std::optional<Sim3> OverlapFinder::VerifyPrediction(KeyFrameId id, const Sim3& a_from_b,
                                                    OverlapEvidence* evidence, std::vector<double>* shares) {
  const Sim3 other_from_own = IsOfA(id) ? a_from_b.inverse() : a_from_b;
  const Rigid3 camera_from_other = CorrectedPose(At(id).camera_from_map, other_from_own);
  const std::vector<KeyFrameId> others =
      KeyFramesWithSameView(At(id), camera_from_other, other_from_own.scale);
  const std::vector<MapPointId> points = PointsInView(At(id), others, camera_from_other);
  if (points.empty()) return std::nullopt;
  ++evidence->with_view;
  shares->push_back(0);
  auto candidate =
      VerifyLoopCandidate(options_.search.verification, id, others, camera_from_other, map_, &searcher_);
  if (!candidate) return std::nullopt;
  const Sim3 implied = KnownFromRecent(*candidate, map_);
  if (MagnitudeAt(other_from_own.inverse() * implied, At(id)).largest() > options_.max_disagreement)
    return std::nullopt;
  shares->back() = static_cast<double>(candidate->seen.size()) / candidate->expected;
  CompareSurfaces(*candidate, points, evidence);
  evidence->candidates.push_back(std::move(*candidate));
  return IsOfA(id) ? implied.inverse() : implied;
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
    return IsOfA(id) ? center : evidence.a_from_b * center;
  };
  std::vector<Known> known = {{center_in_a(recognitions_[seed].candidate.keyframe), evidence.a_from_b}};
  struct Pending {
    KeyFrameId id;
    double distance;
    std::size_t nearest;  // index of the nearest known keyframe
  };
  std::vector<Pending> pending;
  for (const auto* ids : {&in_a_, &in_b_}) {
    for (const KeyFrameId id : *ids)
      pending.push_back({id, (center_in_a(id) - known[0].center_in_a).norm(), 0});
  }
  std::vector<double> shares;
  while (!pending.empty() && !Interrupted()) {
    const auto next =
        std::min_element(pending.begin(), pending.end(),
                         [](const Pending& a, const Pending& b) { return a.distance < b.distance; });
    const KeyFrameId id = next->id;
    const Sim3 a_from_b = known[next->nearest].a_from_b;
    pending.erase(next);
    const auto implied = VerifyPrediction(id, a_from_b, &evidence, &shares);
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
  if (!shares.empty()) {
    const auto middle = shares.begin() + static_cast<std::ptrdiff_t>(shares.size() / 2);
    std::nth_element(shares.begin(), middle, shares.end());
    evidence.found_ratio = *middle;
  }
  return evidence;
}

// Keyframes of the other map with about the same view, the most similar first. scale: of the other map's
// unit.
std::vector<KeyFrameId> OverlapFinder::KeyFramesWithSameView(const KeyFrame& keyframe,
                                                             const Rigid3& camera_from_other,
                                                             double scale) const {
  std::vector<std::pair<double, KeyFrameId>> ranked;
  for (const KeyFrameId id : IsOfA(keyframe.id) ? in_b_ : in_a_) {
    const Rigid3& other = At(id).camera_from_map;
    const double distance =
        (camera_from_other.OriginInSource() - other.OriginInSource()).norm() / (scale * keyframe.mean_depth);
    // The angle between the optical axes, since a camera that rolls sees the same.
    const double cosine = (camera_from_other.rotation.inverse() * Eigen::Vector3d::UnitZ())
                              .dot(other.rotation.inverse() * Eigen::Vector3d::UnitZ());
    const double angle = std::acos(std::clamp(cosine, -1.0, 1.0));
    if (distance > options_.max_view_distance || angle > options_.max_view_angle) continue;
    ranked.emplace_back(distance + angle, id);
  }
  std::sort(ranked.begin(), ranked.end());
  if (ranked.size() > options_.search.max_group) ranked.resize(options_.search.max_group);
  std::vector<KeyFrameId> ids;
  for (const auto& [difference, id] : ranked) ids.push_back(id);
  return ids;
}

// Points of the given keyframes that should be visible in the keyframe; none if they are too few or do not
// cover enough of the image.
std::vector<MapPointId> OverlapFinder::PointsInView(const KeyFrame& keyframe,
                                                    const std::vector<KeyFrameId>& others,
                                                    const Rigid3& camera_from_other) {
  std::set<MapPointId> points;
  for (const KeyFrameId id : others) {
    for (const Observation& observation : map_->FindKeyFrame(id)->observations)
      points.insert(observation.point);
  }
  std::vector<MapPointId> in_view;
  std::set<std::size_t> cells;
  for (const MapPointId id : points) {
    const auto predicted = Predict(id, keyframe, camera_from_other);
    if (!predicted) continue;
    in_view.push_back(id);
    cells.insert(GridCell(predicted->pixel, *keyframe.camera, kVisibleCells, kVisibleCells));
  }
  if (static_cast<int>(in_view.size()) < options_.min_expected ||
      static_cast<int>(cells.size()) < options_.min_cells)
    in_view.clear();
  return in_view;
}

std::optional<PredictedPoint> OverlapFinder::Predict(MapPointId id, const KeyFrame& keyframe,
                                                     const Rigid3& camera_from_other) {
  const Map::PointRecord* const record = map_->FindPoint(id);
  if (!record || record->point.infinite()) return std::nullopt;
  const Map::KeyFrameRecord* const source = map_->FindKeyFrame(record->point.source_keyframe);
  if (!source) return std::nullopt;
  return searcher_.Predict(record->point, source->keyframe, *keyframe.camera, camera_from_other);
}

// True if the keyframe's own map has a surface at this pixel and about this depth.
bool OverlapFinder::HasSurface(const Map::KeyFrameRecord& keyframe, const Eigen::Vector2d& pixel,
                               double depth) const {
  return std::any_of(keyframe.observations.begin(), keyframe.observations.end(),
                     [&](const Observation& observation) {
                       if ((observation.pixel.cast<double>() - pixel).norm() > options_.surface_px)
                         return false;
                       const Map::PointRecord* const point = map_->FindPoint(observation.point);
                       if (!point || point->point.infinite()) return false;
                       const double own = (keyframe.keyframe.camera_from_map * point->point.position()).z();
                       return std::abs(own - depth) <= options_.surface_depth * depth;
                     });
}

// Where both maps have a surface at the same depth, the points of one must be found in a keyframe of the
// other, unless the surfaces differ.
void OverlapFinder::CompareSurfaces(const LoopCandidate& candidate, const std::vector<MapPointId>& points,
                                    OverlapEvidence* evidence) {
  const Map::KeyFrameRecord& record = *map_->FindKeyFrame(candidate.keyframe);
  const KeyFrame& keyframe = record.keyframe;
  const Sim3 seen_from_other = candidate.keyframe_from_place * AsSim3(At(candidate.place).camera_from_map);
  const Rigid3 camera_from_other{seen_from_other.rotation,
                                 seen_from_other.translation / seen_from_other.scale};
  struct Region {
    int points = 0, found = 0;
  };
  std::map<std::size_t, Region> regions;
  for (const MapPointId id : points) {
    const auto predicted = Predict(id, keyframe, camera_from_other);
    if (!predicted) continue;
    const MapPoint& point = map_->FindPoint(id)->point;
    const auto match = searcher_.Find(point, At(point.source_keyframe), *predicted, *keyframe.features,
                                      options_.search.verification.radius_px, false);
    const bool found = match && (match->pixel.cast<double>() - predicted->pixel).norm() <=
                                    options_.max_error_px * (1 << predicted->level);
    const double depth = seen_from_other.scale * predicted->point_in_camera.z();
    if (!found && !HasSurface(record, predicted->pixel, depth)) continue;
    Region& region = regions[GridCell(predicted->pixel, *keyframe.camera, options_.regions_across,
                                      options_.regions_across)];
    ++region.points;
    region.found += found ? 1 : 0;
  }
  for (const auto& [cell, region] : regions) {
    if (region.points < options_.min_region_points) continue;
    ++evidence->regions;
    if (region.found <= options_.min_region_found_ratio * region.points) ++evidence->contradicted;
  }
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
