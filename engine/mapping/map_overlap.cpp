// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/map_overlap.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <optional>
#include <set>
#include <utility>

namespace docent::engine {
namespace {

constexpr int kCellsAcross = 4;

std::pair<int, int> CellOf(const Eigen::Vector2d& pixel, const KeyFrame& keyframe, int across) {
  return {static_cast<int>(across * pixel.x() / keyframe.camera->width_px()),
          static_cast<int>(across * pixel.y() / keyframe.camera->height_px())};
}

// A keyframe of B that was recognised, and where it puts B.
struct Recognition {
  std::size_t order = 0;  // of the keyframe in B
  LoopCandidate sighting;
  Sim3 a_from_b;
};

// What the keyframes of both maps say of one similarity.
struct Evidence {
  Sim3 a_from_b;
  std::size_t in_a_row = 0, looking = 0;
  std::vector<LoopCandidate> sightings;
  double found = 0;
  std::size_t regions = 0, contradicted = 0;

  std::size_t Points() const {
    std::size_t points = 0;
    for (const LoopCandidate& sighting : sightings) points += sighting.seen.size();
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
    using Verdict = MapOverlap::Verdict;
    MapOverlap overlap;
    const std::size_t fewest = options_.in_a_row;
    if (in_a_.size() < fewest || in_b_.size() < fewest) return overlap;
    Recognise(&overlap);
    overlap.verdict = Verdict::kNothingRecognised;
    std::vector<Evidence> examined;
    for (const std::size_t seed : BySupport()) {
      if (examined.size() >= options_.hypotheses || Interrupted()) break;
      const bool known = std::any_of(examined.begin(), examined.end(), [&](const Evidence& evidence) {
        return Says(evidence, recognitions_[seed].sighting);
      });
      if (!known) examined.push_back(Examine(seed));
    }
    std::stable_sort(examined.begin(), examined.end(),
                     [](const Evidence& a, const Evidence& b) { return a.Points() > b.Points(); });
    Evidence best;
    if (!examined.empty()) best = std::move(examined.front());
    for (std::size_t i = 1; i < examined.size(); ++i) {
      std::size_t elsewhere = 0;
      for (const LoopCandidate& sighting : examined[i].sightings)
        elsewhere += Says(best, sighting) ? 0 : sighting.seen.size();
      overlap.second_points = std::max(overlap.second_points, elsewhere);
    }
    overlap.a_from_b = best.a_from_b;
    overlap.in_a_row = best.in_a_row;
    overlap.looking = best.looking;
    overlap.confirmed = best.sightings.size();
    overlap.found = best.found;
    overlap.points = best.Points();
    overlap.regions = best.regions;
    overlap.contradicted = best.contradicted;
    overlap.sightings = std::move(best.sightings);
    if (Interrupted()) {
      overlap.verdict = Verdict::kInterrupted;
    } else if (overlap.recognised > 0) {
      overlap.verdict = Judge(overlap);
    }
    return overlap;
  }

 private:
  const KeyFrame& At(KeyFrameId id) const { return map_->keyframes().at(id).keyframe; }
  bool IsOfA(KeyFrameId id) const { return id < first_of_b_; }
  bool Interrupted() const { return interrupt_ && *interrupt_; }
  MapOverlap::Verdict Judge(const MapOverlap& overlap) const;
  void Recognise(MapOverlap* overlap);
  std::vector<std::size_t> BySupport() const;
  bool Says(const Evidence& evidence, const LoopCandidate& sighting) const;
  std::size_t LongestRow(const Sim3& a_from_b) const;
  bool IsFromElsewhere(const KeyFrame& a, const KeyFrame& b) const;
  // Of the two at a keyframe, in the coordinates of B.
  double Difference(const Sim3& a_from_b, const Sim3& other_a_from_b, const KeyFrame& keyframe) const {
    return SizeAt(a_from_b.inverse() * other_a_from_b, keyframe).largest();
  }
  Evidence Examine(std::size_t seed);
  std::vector<KeyFrameId> KeyFramesWithTheView(const KeyFrame& keyframe, const Rigid3& camera_from_other,
                                               double scale) const;
  std::vector<MapPointId> PointsInView(const KeyFrame& keyframe, const std::vector<KeyFrameId>& others,
                                       const Rigid3& camera_from_other);
  std::optional<PredictedPoint> Predict(MapPointId id, const KeyFrame& keyframe,
                                        const Rigid3& camera_from_other);
  void CompareSurfaces(const LoopCandidate& sighting, const std::vector<MapPointId>& points,
                       Evidence* evidence);
  bool HasSurface(const Map::KeyFrameRecord& keyframe, const Eigen::Vector2d& pixel, double depth) const;

  const MapOverlapOptions& options_;
  const KeyFrameId first_of_b_;
  const std::atomic<bool>* const interrupt_;
  Map* const map_;
  LoopCandidateSearch search_;
  PointSearcher searcher_;
  std::vector<KeyFrameId> in_a_, in_b_;  // localized, in the order in which they were made
  std::vector<Recognition> recognitions_;
};

MapOverlap::Verdict OverlapFinder::Judge(const MapOverlap& overlap) const {
  using Verdict = MapOverlap::Verdict;
  if (overlap.in_a_row < options_.in_a_row) return Verdict::kTooFewInARow;
  const auto confirmed = static_cast<double>(overlap.confirmed);
  if (confirmed < options_.min_confirmed * static_cast<double>(overlap.looking) ||
      overlap.found < options_.min_found ||
      static_cast<double>(overlap.contradicted) >
          options_.max_contradicted * static_cast<double>(overlap.regions)) {
    return Verdict::kContradicted;
  }
  if (static_cast<double>(overlap.second_points) > options_.max_second * static_cast<double>(overlap.points))
    return Verdict::kAmbiguous;
  return Verdict::kOverlap;
}

void OverlapFinder::Recognise(MapOverlap* overlap) {
  std::set<KeyFrameId> all_of_b;
  for (const auto& [id, record] : map_->keyframes()) {
    if (!IsOfA(id)) all_of_b.insert(id);
  }
  for (std::size_t order = 0; order < in_b_.size() && !Interrupted(); ++order) {
    const std::size_t before = recognitions_.size();
    search_.Find(in_b_[order], all_of_b, map_, &searcher_, [&](LoopCandidate sighting) {
      const Sim3 a_from_b = KnownFromRecent(sighting, map_);
      recognitions_.push_back({order, std::move(sighting), a_from_b});
      return false;
    });
    if (recognitions_.size() > before) ++overlap->recognised;
  }
  search_.Clear();
}

// The recognitions, those first that most keyframes agree with.
std::vector<std::size_t> OverlapFinder::BySupport() const {
  std::vector<std::pair<std::size_t, std::size_t>> ranked;
  for (std::size_t seed = 0; seed < recognitions_.size(); ++seed) {
    std::set<std::size_t> agreeing;
    for (const Recognition& other : recognitions_) {
      if (Difference(recognitions_[seed].a_from_b, other.a_from_b, At(other.sighting.keyframe)) <=
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

// Whether the evidence has the keyframe of the sighting at the same place: one similarity that drift bends is
// no second hypothesis.
bool OverlapFinder::Says(const Evidence& evidence, const LoopCandidate& sighting) const {
  const Sim3 said = KnownFromRecent(sighting, map_);
  return std::any_of(evidence.sightings.begin(), evidence.sightings.end(), [&](const LoopCandidate& other) {
    return other.keyframe == sighting.keyframe &&
           SizeAt(said.inverse() * KnownFromRecent(other, map_), At(other.keyframe)).largest() <=
               options_.distinct;
  });
}

bool OverlapFinder::IsFromElsewhere(const KeyFrame& a, const KeyFrame& b) const {
  const double shift = (a.camera_from_map.OriginInSource() - b.camera_from_map.OriginInSource()).norm();
  const double turn = (a.camera_from_map.rotation * b.camera_from_map.rotation.inverse()).Angle();
  return shift > options_.min_viewpoint_step * b.mean_depth || turn > options_.min_viewpoint_step;
}

// The most keyframes of B in a row that were recognised where the similarity puts them.
std::size_t OverlapFinder::LongestRow(const Sim3& a_from_b) const {
  std::set<std::size_t> agreeing;
  for (const Recognition& recognition : recognitions_) {
    if (Difference(a_from_b, recognition.a_from_b, At(recognition.sighting.keyframe)) <=
        options_.max_disagreement)
      agreeing.insert(recognition.order);
  }
  std::size_t longest = 0, row = 0, last = 0;
  for (const std::size_t order : agreeing) {
    const bool goes_on = row > 0 && order == last + 1;
    if (!goes_on) {
      row = 1;
    } else if (IsFromElsewhere(At(in_b_[last]), At(in_b_[order]))) {
      ++row;
    }
    last = order;
    longest = std::max(longest, row);
  }
  return longest;
}

// Goes through the keyframes of both maps from the seed outwards, each where the nearest confirmed one puts
// it: drift within a map bends what one similarity cannot.
Evidence OverlapFinder::Examine(std::size_t seed) {
  Evidence evidence;
  evidence.a_from_b = recognitions_[seed].a_from_b;
  evidence.in_a_row = LongestRow(evidence.a_from_b);
  struct Known {
    Eigen::Vector3d center_in_a;
    Sim3 a_from_b;
  };
  const auto center_in_a = [&](KeyFrameId id) -> Eigen::Vector3d {
    const Eigen::Vector3d center = At(id).camera_from_map.OriginInSource();
    return IsOfA(id) ? center : evidence.a_from_b * center;
  };
  std::vector<Known> known = {{center_in_a(recognitions_[seed].sighting.keyframe), evidence.a_from_b}};
  struct Pending {
    KeyFrameId id;
    double distance;
    std::size_t nearest;  // of those known
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
    const Sim3 other_from_own = IsOfA(id) ? a_from_b.inverse() : a_from_b;
    const Rigid3 camera_from_other = CarriedAlong(At(id).camera_from_map, other_from_own);
    const std::vector<KeyFrameId> others =
        KeyFramesWithTheView(At(id), camera_from_other, other_from_own.scale);
    const std::vector<MapPointId> points = PointsInView(At(id), others, camera_from_other);
    if (points.empty()) continue;
    ++evidence.looking;
    shares.push_back(0);
    auto sighting =
        VerifyLoopCandidate(options_.search.verification, id, others, camera_from_other, map_, &searcher_);
    if (!sighting) continue;
    const Sim3 says = KnownFromRecent(*sighting, map_);
    if (SizeAt(other_from_own.inverse() * says, At(id)).largest() > options_.max_disagreement) continue;
    shares.back() = static_cast<double>(sighting->seen.size()) / sighting->expected;
    known.push_back({center_in_a(id), IsOfA(id) ? says.inverse() : says});
    for (Pending& other : pending) {
      const double distance = (center_in_a(other.id) - known.back().center_in_a).norm();
      if (distance < other.distance) {
        other.distance = distance;
        other.nearest = known.size() - 1;
      }
    }
    CompareSurfaces(*sighting, points, &evidence);
    evidence.sightings.push_back(std::move(*sighting));
  }
  if (!shares.empty()) {
    const auto middle = shares.begin() + static_cast<std::ptrdiff_t>(shares.size() / 2);
    std::nth_element(shares.begin(), middle, shares.end());
    evidence.found = *middle;
  }
  return evidence;
}

// Keyframes of the other map with about the same view, the most alike first. scale: of the other map's unit.
std::vector<KeyFrameId> OverlapFinder::KeyFramesWithTheView(const KeyFrame& keyframe,
                                                            const Rigid3& camera_from_other,
                                                            double scale) const {
  std::vector<std::pair<double, KeyFrameId>> ranked;
  for (const KeyFrameId id : IsOfA(keyframe.id) ? in_b_ : in_a_) {
    const Rigid3& other = At(id).camera_from_map;
    const double distance =
        (camera_from_other.OriginInSource() - other.OriginInSource()).norm() / (scale * keyframe.mean_depth);
    // Between the optical axes: a camera that rolls sees the same.
    const double cosine = (camera_from_other.rotation.inverse() * Eigen::Vector3d::UnitZ())
                              .dot(other.rotation.inverse() * Eigen::Vector3d::UnitZ());
    const double angle = std::acos(std::clamp(cosine, -1.0, 1.0));
    if (distance > options_.max_view_distance || angle > options_.max_view_angle) continue;
    ranked.emplace_back(distance + angle, id);
  }
  std::sort(ranked.begin(), ranked.end());
  if (ranked.size() > options_.search.group) ranked.resize(options_.search.group);
  std::vector<KeyFrameId> ids;
  for (const auto& [difference, id] : ranked) ids.push_back(id);
  return ids;
}

// The points of the others that should be seen in the keyframe; none where they are too few, or not spread
// over the image.
std::vector<MapPointId> OverlapFinder::PointsInView(const KeyFrame& keyframe,
                                                    const std::vector<KeyFrameId>& others,
                                                    const Rigid3& camera_from_other) {
  std::set<MapPointId> points;
  for (const KeyFrameId id : others) {
    for (const Observation& observation : map_->FindKeyFrame(id)->observations)
      points.insert(observation.point);
  }
  std::vector<MapPointId> in_view;
  std::set<std::pair<int, int>> cells;
  for (const MapPointId id : points) {
    const auto predicted = Predict(id, keyframe, camera_from_other);
    if (!predicted) continue;
    in_view.push_back(id);
    cells.insert(CellOf(predicted->pixel, keyframe, kCellsAcross));
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

// Whether the keyframe's own map has a surface at a pixel, at about this depth.
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

// Where both maps have a surface at one depth, the points of one are found in a keyframe of the other, unless
// something else is to be seen there.
void OverlapFinder::CompareSurfaces(const LoopCandidate& sighting, const std::vector<MapPointId>& points,
                                    Evidence* evidence) {
  const Map::KeyFrameRecord& record = *map_->FindKeyFrame(sighting.keyframe);
  const KeyFrame& keyframe = record.keyframe;
  const Sim3 seen_from_other = sighting.keyframe_from_place * AsSim3(At(sighting.place).camera_from_map);
  const Rigid3 camera_from_other{seen_from_other.rotation,
                                 seen_from_other.translation / seen_from_other.scale};
  struct Region {
    int points = 0, found = 0;
  };
  std::map<std::pair<int, int>, Region> regions;
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
    Region& region = regions[CellOf(predicted->pixel, keyframe, options_.regions_across)];
    ++region.points;
    region.found += found ? 1 : 0;
  }
  for (const auto& [cell, region] : regions) {
    if (region.points < options_.min_region_points) continue;
    ++evidence->regions;
    if (region.found <= options_.min_region_found * region.points) ++evidence->contradicted;
  }
}

}  // namespace

LoopCandidateSearchOptions MapOverlapOptions::ThoroughSearch() {
  LoopCandidateSearchOptions search;
  search.new_descriptions = std::numeric_limits<std::size_t>::max();
  search.proved = 4;
  return search;
}

std::string MapOverlap::Brief() const {
  char text[320];
  std::snprintf(text, sizeof(text),
                "%zu keyframes recognised, %zu in a row, %zu of %zu that look at the other map confirm it, "
                "median share of points found %.2f, %zu of %zu regions contradict, %zu points in all, %zu of "
                "another hypothesis, scale %.4g",
                recognised, in_a_row, confirmed, looking, found, contradicted, regions, points, second_points,
                a_from_b.scale);
  return text;
}

std::string ReasonNotToJoin(const MapOverlap& overlap) {
  using Verdict = MapOverlap::Verdict;
  char text[200] = "";
  switch (overlap.verdict) {
    case Verdict::kOverlap:
      break;
    case Verdict::kNothingToCompare:
      return "one of them has too few keyframes with a position to be compared";
    case Verdict::kNothingRecognised:
      return "no place of one is recognised in the other";
    case Verdict::kTooFewInARow:
      std::snprintf(text, sizeof(text), "only %zu keyframes in a row are recognised at the same place",
                    overlap.in_a_row);
      break;
    case Verdict::kContradicted:
      if (overlap.contradicted > 0 && overlap.confirmed == overlap.looking) {
        std::snprintf(
            text, sizeof(text),
            "they look alike, but in %zu of %zu parts of the images where both show a surface it is "
            "another one",
            overlap.contradicted, overlap.regions);
        break;
      }
      std::snprintf(text, sizeof(text),
                    "they look alike, but only %zu of %zu keyframes that should show the other map do, and "
                    "find %.0f %% of its points",
                    overlap.confirmed, overlap.looking, 100 * overlap.found);
      break;
    case Verdict::kAmbiguous:
      return "more than one place of the other map looks the same";
    case Verdict::kInterrupted:
      return "the comparison was interrupted";
  }
  return text;
}

MapOverlap FindOverlap(const MapOverlapOptions& options, KeyFrameId first_of_b,
                       const std::atomic<bool>* interrupt, Map* map) {
  return OverlapFinder(options, first_of_b, interrupt, map).Find();
}

}  // namespace docent::engine
