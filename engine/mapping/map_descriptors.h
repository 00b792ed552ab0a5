// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "engine/map/map.h"
#include "engine/recognition/descriptor_database.h"

namespace docent::engine {

struct AppearanceOptions {
  int levels_around = 1;  // on which an observation is described beside its own
  double inlier_px = 4;   // RANSAC, level 0
  int min_inliers = 15;   // of matches by looks alone; what they suggest is searched for thoroughly then
  double min_inlier_ratio = 0.1;
};

// The finite points of a map by their looks: for a keyframe whose pose is too far off for active search
// (hybrid-slam §5.1, §5.4). Owned by the mapper and touched by its thread alone. Brought into step with the
// map keyframe by keyframe, and only when somebody is going to ask.
class MapDescriptors {
 public:
  explicit MapDescriptors(const VocabularyTree& tree) : database_(tree) {}

  void Clear();
  // Describes what one keyframe saw and is not known here yet, and forgets what it no longer sees; false when
  // every keyframe is in step.
  bool UpdateOne(const AppearanceOptions& options, Map* map);
  // The pose of a keyframe by three-point RANSAC over points that look like its corners; empty where too few
  // agree. Nothing but a suggestion: many of them may look alike.
  std::optional<Rigid3> SuggestPose(const AppearanceOptions& options, const KeyFrame& keyframe,
                                    std::uint64_t seed, Map* map) const;

  const DescriptorDatabase& database() const { return database_; }

 private:
  DescriptorDatabase database_;
  std::map<KeyFrameId, std::vector<MapPointId>> described_;  // ascending points
  std::vector<MapPointId> finite_;                           // scratch
};

}  // namespace docent::engine
