// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "engine/mapping/panorama_mapper.h"

namespace docent::engine {

// The mapper's task of inserting an offered keyframe into its map (ptamm §2.3): applies the trackers' reports
// on points, follows corrections of the map, searches the map's points in the keyframe, and creates new ones
// with earlier keyframes. On the thread that runs the mapper only.
class KeyFrameInsertion {
 public:
  // The pointers are borrowed.
  KeyFrameInsertion(const MapperOptions& options, const LensEstimation* lens_estimation,
                    MapWorkspace* workspace, MapperOutput* output, MapRefinement* refinement,
                    PanoramaMapper* panoramas, LoopCloser* loops)
      : options_(options),
        lens_estimation_(lens_estimation),
        workspace_(workspace),
        output_(output),
        refinement_(refinement),
        panoramas_(panoramas),
        loops_(loops) {}

  // The map must have keyframes.
  void Insert(const KeyFrameCandidate& candidate, std::span<const PointReport> reports);

 private:
  // Counts the reports, and removes points that harm tracking.
  void ApplyReports(std::span<const PointReport> reports);
  // The candidate with the corrections applied that the map received since the pose was estimated.
  KeyFrameCandidate WithCorrections(KeyFrameCandidate candidate) const;
  // The pose of a candidate in the present map, from its matches; that of the candidate if they do not
  // determine it.
  Rigid3 PoseInPresentMap(const KeyFrameCandidate& candidate);
  void InsertSixDof(const KeyFrameCandidate& candidate);
  // The keyframes in which the corners of this one are searched.
  std::vector<KeyFrameId> Neighbours(KeyFrameId keyframe);

  const MapperOptions& options_;
  const LensEstimation* const lens_estimation_;
  MapWorkspace* const workspace_;
  MapperOutput* const output_;
  MapRefinement* const refinement_;
  PanoramaMapper* const panoramas_;
  LoopCloser* const loops_;
};

}  // namespace docent::engine
