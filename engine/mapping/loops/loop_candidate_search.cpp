// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/loops/loop_candidate_search.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include "engine/recognition/absolute_pose.h"

namespace docent::engine {

std::optional<std::string> LoopCandidateSearchOptions::Validate() const {
  return OptionCheck()
      .Ratio(min_covisibility_ratio, "covisibility of a neighbourhood")
      .AtLeast(hops, 0, "number of steps of a neighbourhood")
      .That(max_places > 0 && max_compared > 0, "At least one place must be compared with a keyframe.")
      .That(max_verified > 0 && max_group > 0, "At least one place must be verified.")
      .That(max_described_points > 0, "At least one point of a keyframe must be described.")
      .AtLeast(levels_around, 0, "number of further levels of a description")
      .Ratio(max_ratio, "ratio of the distances of two matches")
      .Positive(inlier_px, "inlier threshold of a place")
      .AtLeast(min_pose_inliers, 4, "number of inliers of a place")
      .Contained(verification.Validate())
      .fault();
}

const std::set<KeyFrameId>& Neighbourhoods::Of(KeyFrameId keyframe, int hops) {
  const auto [entry, is_new] = known_.try_emplace({keyframe, hops});
  if (!is_new) return entry->second;
  entry->second.insert(keyframe);
  for (int hop = 0; hop < hops; ++hop) AddStep(&entry->second);
  return entry->second;
}

void Neighbourhoods::AddStep(std::set<KeyFrameId>* known) {
  std::vector<MapPointId> points;
  for (const KeyFrameId id : *known) {
    for (const Observation& observation : map_.FindKeyFrame(id)->observations)
      points.push_back(observation.point);
  }
  std::sort(points.begin(), points.end());
  points.erase(std::unique(points.begin(), points.end()), points.end());
  std::map<KeyFrameId, std::size_t> shared;
  for (const MapPointId id : points) {
    const Map::PointRecord* point = map_.FindPoint(id);
    if (!point || point->point.infinite()) continue;
    for (const KeyFrameId observer : point->observers) ++shared[observer];
  }
  for (const auto& [id, count] : shared) {
    const auto all = static_cast<double>(FinitePointsOf(id));
    if (static_cast<double>(count) >= min_covisibility_ratio_ * all) known->insert(id);
  }
}

std::ptrdiff_t Neighbourhoods::FinitePointsOf(KeyFrameId keyframe) {
  const auto [entry, is_new] = finite_points_.try_emplace(keyframe);
  if (!is_new) return entry->second;
  entry->second = std::ranges::count_if(map_.FindKeyFrame(keyframe)->observations,
                                        [this](const Observation& observation) {
                                          const Map::PointRecord* point = map_.FindPoint(observation.point);
                                          return point && !point->point.infinite();
                                        });
  return entry->second;
}

double SimilarityMagnitude::largest() const {
  return std::max({translation, rotation, log_scale});
}

SimilarityMagnitude MagnitudeAt(const Sim3& after_from_before, const KeyFrame& keyframe) {
  const Eigen::Vector3d center = keyframe.camera_from_map.OriginInSource();
  return {(after_from_before * center - center).norm() / keyframe.mean_depth,
          after_from_before.rotation.Angle(), std::abs(std::log(after_from_before.scale))};
}

Sim3 KnownFromRecent(const LoopCandidate& candidate, Map* map) {
  const Sim3 keyframe = AsSim3(map->FindKeyFrame(candidate.keyframe)->keyframe.camera_from_map);
  const Sim3 place = AsSim3(map->FindKeyFrame(candidate.place)->keyframe.camera_from_map);
  return (candidate.keyframe_from_place * place).inverse() * keyframe;
}

void LoopCandidateSearch::Find(KeyFrameId id, const std::set<KeyFrameId>& here,
                               Neighbourhoods* neighbourhoods, PointSearcher* searcher, const Take& take) {
  Map* const map = &neighbourhoods->map();
  const KeyFrame& keyframe = map->FindKeyFrame(id)->keyframe;
  AbsolutePoseOptions pose_options;
  pose_options.pixel_angle = keyframe.camera->PixelAngle();
  pose_options.inlier_px = options_.inlier_px;
  pose_options.min_inliers = options_.min_pose_inliers;
  pose_options.seed = id + 1;
  for (const PlaceMatches& place : Compare(id, here, neighbourhoods)) {
    std::vector<Eigen::Vector3d> rays, points;
    for (const Match& match : place.matches) {
      const Map::PointRecord* point = map->FindPoint(match.point);
      const auto ray = keyframe.camera->Unproject(match.pixel.cast<double>());
      if (!point || point->point.infinite() || !ray) continue;
      rays.push_back(*ray);
      points.push_back(point->point.position());
    }
    const auto pose = EstimateAbsolutePose(rays, points, pose_options);
    if (!pose) continue;
    auto candidate =
        VerifyLoopCandidate(options_.verification, id, place.group, pose->camera_from_map, map, searcher);
    if (candidate && take(std::move(*candidate))) return;
  }
}

// The places with most descriptor matches with the keyframe, best first.
std::vector<LoopCandidateSearch::PlaceMatches> LoopCandidateSearch::Compare(KeyFrameId id,
                                                                            const std::set<KeyFrameId>& here,
                                                                            Neighbourhoods* neighbourhoods) {
  Map* const map = &neighbourhoods->map();
  std::erase_if(described_, [&](const auto& entry) { return !map->FindKeyFrame(entry.first); });
  Describe(id, map);
  std::vector<PlaceMatches> places;
  std::size_t new_descriptions = 0;
  for (const KeyFrameId best : RankByThumbnail(map->FindKeyFrame(id)->keyframe, here, neighbourhoods)) {
    PlaceMatches place;
    place.group = {best};
    const std::set<KeyFrameId>& about = neighbourhoods->Of(best, 1);
    for (const auto& [other, shared] : map->Covisible(best)) {
      if (place.group.size() >= options_.max_group) break;
      if (about.contains(other) && !here.contains(other)) place.group.push_back(other);
    }
    for (std::size_t i = 0; i < std::min(options_.max_compared, place.group.size()); ++i) {
      const KeyFrameId known = place.group[i];
      if (!described_.contains(known) && ++new_descriptions > options_.max_new_descriptions) continue;
      Describe(known, map);
      AddMatches(described_.at(id), described_.at(known), &place.matches);
    }
    if (place.matches.size() >= options_.min_matches) places.push_back(std::move(place));
  }
  std::stable_sort(places.begin(), places.end(), [](const PlaceMatches& a, const PlaceMatches& b) {
    return a.matches.size() > b.matches.size();
  });
  if (places.size() > options_.max_verified) places.resize(options_.max_verified);
  return places;
}

// Keyframes of different places outside `here`, the most similar thumbnail first.
std::vector<KeyFrameId> LoopCandidateSearch::RankByThumbnail(const KeyFrame& keyframe,
                                                             const std::set<KeyFrameId>& here,
                                                             Neighbourhoods* neighbourhoods) {
  std::vector<std::pair<double, KeyFrameId>> ranked;
  for (const auto& [id, record] : neighbourhoods->map().keyframes()) {
    if (record.keyframe.kind != KeyFrameKind::kSixDof || here.contains(id)) continue;
    const double difference =
        Difference(keyframe.features->small_blurry, record.keyframe.features->small_blurry);
    if (std::isfinite(difference)) ranked.emplace_back(difference, id);
  }
  std::sort(ranked.begin(), ranked.end());
  std::vector<KeyFrameId> places;
  std::set<KeyFrameId> covered;
  for (const auto& [difference, id] : ranked) {
    if (places.size() >= options_.max_places) break;
    if (covered.contains(id)) continue;
    places.push_back(id);
    const std::set<KeyFrameId>& about = neighbourhoods->Of(id, 1);
    covered.insert(about.begin(), about.end());
  }
  return places;
}

void LoopCandidateSearch::Describe(KeyFrameId id, Map* map) {
  const auto [place, is_new] = described_.try_emplace(id);
  if (!is_new) return;
  const Map::KeyFrameRecord& record = *map->FindKeyFrame(id);
  std::vector<Observation> observations;
  for (const Observation& observation : record.observations) {
    const Map::PointRecord* point = map->FindPoint(observation.point);
    if (point && !point->point.infinite()) observations.push_back(observation);
  }
  std::stable_sort(observations.begin(), observations.end(),
                   [](const Observation& a, const Observation& b) { return a.level > b.level; });
  if (observations.size() > options_.max_described_points) observations.resize(options_.max_described_points);
  std::vector<DescribedKeypoint> descriptions;
  for (const Observation& observation : observations) {
    descriptions.clear();
    DescribeKeypoint(*record.keyframe.features, observation.pixel, observation.level - options_.levels_around,
                     observation.level + options_.levels_around, &descriptions);
    for (const DescribedKeypoint& description : descriptions) {
      place->second.push_back({description.oriented.descriptor, observation.point, observation.pixel,
                               description.level == observation.level});
    }
  }
}

// Adds pairs that are mutual nearest neighbours and pass the ratio test against every other point.
void LoopCandidateSearch::AddMatches(const std::vector<Described>& own, const std::vector<Described>& known,
                                     std::vector<Match>* matches) const {
  constexpr int kFar = std::numeric_limits<int>::max();
  struct Nearest {
    std::size_t index = 0;
    int distance = kFar, second = kFar;  // second: of another point
  };
  std::vector<Nearest> of_own(own.size()), of_known(known.size());
  const auto take = [](int distance, std::size_t index, const std::vector<Described>& others,
                       Nearest* nearest) {
    const bool same = nearest->distance != kFar && others[nearest->index].point == others[index].point;
    if (distance < nearest->distance) {
      if (!same) nearest->second = nearest->distance;
      nearest->index = index;
      nearest->distance = distance;
    } else if (!same) {
      nearest->second = std::min(nearest->second, distance);
    }
  };
  for (std::size_t i = 0; i < own.size(); ++i) {
    if (!own[i].own_level) continue;
    for (std::size_t k = 0; k < known.size(); ++k) {
      const int distance = SquaredDistance(own[i].descriptor, known[k].descriptor);
      take(distance, k, known, &of_own[i]);
      take(distance, i, own, &of_known[k]);
    }
  }
  for (std::size_t i = 0; i < own.size(); ++i) {
    const Nearest& nearest = of_own[i];
    if (nearest.distance == kFar || !(nearest.distance < options_.max_ratio * nearest.second)) continue;
    if (own[of_known[nearest.index].index].point != own[i].point) continue;
    matches->push_back({own[i].pixel, known[nearest.index].point});
  }
}

}  // namespace docent::engine
