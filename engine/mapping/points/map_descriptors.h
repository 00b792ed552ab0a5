// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "engine/map/map.h"
#include "engine/recognition/descriptor_database.h"

namespace docent::engine {

struct AppearanceOptions {
  int levels_around = 1;  // observations are described on so many levels above and below their own
  double inlier_px = 4;   // RANSAC, pixels of level 0
  int min_inliers = 15;  // of descriptor matches; low, since the pose is verified by guided search afterwards
  double min_inlier_ratio = 0.1;

  // Describes the first invalid option in one sentence, or empty.
  std::optional<std::string> Validate() const;
};

// Descriptors of the finite points of a map, to estimate the pose of a keyframe that is too far off for
// guided search (hybrid-slam §5.1, §5.4). Owned by the mapper and used on its thread only. Updated keyframe
// by keyframe, and only before a query.
class MapDescriptors {
 public:
  explicit MapDescriptors(const VocabularyTree& tree) : database_(tree) {}

  void Clear();
  // Describes the new observations of one keyframe and removes the descriptors of those that it lost. Returns
  // false if every keyframe is up to date.
  bool UpdateOne(const AppearanceOptions& options, Map* map);
  // The pose of a keyframe from three-point RANSAC over descriptor matches of its corners; empty if there are
  // too few inliers. The pose is unverified, since repeated structure gives wrong matches.
  std::optional<Rigid3> SuggestPose(const AppearanceOptions& options, const KeyFrame& keyframe,
                                    std::uint64_t seed, Map* map) const;

  const DescriptorDatabase& database() const { return database_; }

 private:
  DescriptorDatabase database_;
  std::map<KeyFrameId, std::vector<MapPointId>> described_;  // points described per keyframe, ascending
  std::vector<MapPointId> finite_;                           // scratch memory
};

}  // namespace docent::engine
