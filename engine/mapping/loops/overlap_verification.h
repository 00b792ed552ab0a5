// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "engine/mapping/loops/map_overlap.h"

namespace docent::engine {

// The evidence that the keyframes of both maps give about one similarity.
struct OverlapEvidence {
  Sim3 a_from_b;
  std::size_t consecutive = 0, with_view = 0;
  std::vector<LoopCandidate> candidates;
  std::vector<double> found_ratios;  // of the candidates: points found, of those expected
  std::size_t regions = 0, contradicted = 0;

  std::size_t Points() const;
  double MedianFoundRatio() const;  // 0 without candidates
};

// The localized keyframes of both maps, in order of creation.
struct OverlapKeyFrames {
  KeyFrameId first_of_b = 0;
  std::vector<KeyFrameId> in_a, in_b;

  bool IsOfA(KeyFrameId id) const { return id < first_of_b; }
};

// Verifies whether a keyframe of one map shows what a similarity between the two maps predicts. For one
// thread at a time.
class OverlapVerification {
 public:
  // All pointers must outlive this.
  OverlapVerification(const MapOverlapOptions& options, const OverlapKeyFrames* keyframes, Map* map,
                      PointSearcher* searcher)
      : options_(options), keyframes_(*keyframes), map_(map), searcher_(*searcher) {}

  // Verifies a keyframe that a similarity predicts, and adds what it shows to the evidence. Returns the
  // similarity that the keyframe implies; empty if it does not confirm the prediction.
  std::optional<Sim3> Verify(KeyFrameId id, const Sim3& a_from_b, OverlapEvidence* evidence);

 private:
  const KeyFrame& At(KeyFrameId id) const { return map_->keyframes().at(id).keyframe; }
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
  const OverlapKeyFrames& keyframes_;
  Map* const map_;
  PointSearcher& searcher_;
};

}  // namespace docent::engine
