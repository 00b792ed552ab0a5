// SPDX-License-Identifier: Apache-2.0
#include "engine/matching/guided_matching.h"

#include <algorithm>

#include "engine/base/option_check.h"

namespace docent::engine {

std::optional<std::string> GuidedMatchingOptions::Validate() const {
  return OptionCheck()
      .Positive(radius_px, "radius of guided matching")
      .Positive(max_error_sigmas, "error of a guided match")
      .fault();
}

int MatchMapPoints(const GuidedMatchingOptions& options, KeyFrameId keyframe, PointSearcher* searcher,
                   Map* map, const std::vector<MapPointId>* among) {
  const Map::KeyFrameRecord* const record = map->FindKeyFrame(keyframe);
  if (!record || record->keyframe.kind != KeyFrameKind::kSixDof) return 0;
  std::vector<Observation> found;
  const auto search = [&](const Map::PointRecord& point) {
    if (!point.alive || point.point.infinite()) return;
    if (std::binary_search(point.observers.begin(), point.observers.end(), keyframe)) return;
    const Map::KeyFrameRecord* const source = map->FindKeyFrame(point.point.source_keyframe);
    if (!source) return;
    const auto predicted = searcher->Predict(point.point, source->keyframe, *record->keyframe.camera,
                                             record->keyframe.camera_from_map);
    if (!predicted) return;
    const auto seen = searcher->Find(point.point, source->keyframe, *predicted, *record->keyframe.features,
                                     options.radius_px, false);
    if (!seen) return;
    const double error = (seen->pixel.cast<double>() - predicted->pixel).norm();
    if (error > options.max_error_sigmas * (1 << predicted->level)) return;
    found.push_back({keyframe, point.point.id, seen->pixel, static_cast<std::uint8_t>(predicted->level)});
  };
  if (among != nullptr) {
    for (const MapPointId id : *among) {
      if (const Map::PointRecord* point = map->FindPoint(id)) search(*point);
    }
  } else {
    for (const Map::PointRecord& point : map->points()) search(point);
  }
  for (const Observation& observation : found) map->AddObservation(observation);
  return static_cast<int>(found.size());
}

}  // namespace docent::engine
