// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/refinding.h"

#include <algorithm>

namespace docent::engine {

int RefindPoints(const RefindOptions& options, KeyFrameId keyframe, PointSearcher* searcher, Map* map) {
  const Map::KeyFrameRecord* const record = map->FindKeyFrame(keyframe);
  if (!record || record->keyframe.kind != KeyFrameKind::kSixDof) return 0;
  std::vector<Observation> found;
  for (const Map::PointRecord& point : map->points()) {
    if (!point.alive || point.point.infinite()) continue;
    if (std::binary_search(point.observers.begin(), point.observers.end(), keyframe)) continue;
    const Map::KeyFrameRecord* const source = map->FindKeyFrame(point.point.source_keyframe);
    if (!source) continue;
    const auto predicted = searcher->Predict(point.point, source->keyframe, *record->keyframe.camera,
                                             record->keyframe.camera_from_map);
    if (!predicted) continue;
    const auto seen = searcher->Find(point.point, source->keyframe, *predicted, *record->keyframe.features,
                                     options.radius_px, false);
    if (!seen) continue;
    const double error = (seen->pixel.cast<double>() - predicted->pixel).norm();
    if (error > options.max_error_sigmas * (1 << predicted->level)) continue;
    found.push_back({keyframe, point.point.id, seen->pixel, static_cast<std::uint8_t>(predicted->level)});
  }
  for (const Observation& observation : found) map->AddObservation(observation);
  return static_cast<int>(found.size());
}

}  // namespace docent::engine
