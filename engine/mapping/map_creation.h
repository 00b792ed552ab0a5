// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "engine/mapping/panorama_mapper.h"

namespace docent::engine {

// The mapper's task of making the first map: from two views with depth (ptamm §2.3), or from one view that
// gives only infinite points. On the thread that runs the mapper only.
class MapCreation {
 public:
  // The pointers are borrowed.
  MapCreation(const MapperOptions& options, LensEstimation* lens_estimation, MapWorkspace* workspace,
              MapperOutput* output, MapRefinement* refinement, PanoramaMapper* panoramas, LoopCloser* loops)
      : options_(options),
        lens_estimation_(lens_estimation),
        workspace_(workspace),
        output_(output),
        refinement_(refinement),
        panoramas_(panoramas),
        loops_(loops) {}

  // Gives depth to a map of infinite points only; any other map is replaced. If too few points are
  // consistent, the map of infinite points stays as it was, or there is none.
  void CreateFromPair(const InitialPair& pair);
  // The first keyframe of an empty map becomes the reference of a panorama map, at the origin. The map stays
  // empty if the image is too dark or has too little texture.
  void CreateFromPanorama(const KeyFrameCandidate& candidate);

 private:
  struct Views {
    KeyFrameId a = kNoId, b = kNoId;
  };
  // Both keyframes. The first defines the coordinate frame of the map; in a map of infinite points it may be
  // a keyframe already.
  Views AddViews(const InitialPair& pair, double scale);
  KeyFrameId AddFirstView(const InitialPair& pair);
  void AddMatchedPoints(const InitialPair& pair, double scale, const Views& views);

  const MapperOptions& options_;
  LensEstimation* const lens_estimation_;
  MapWorkspace* const workspace_;
  MapperOutput* const output_;
  MapRefinement* const refinement_;
  PanoramaMapper* const panoramas_;
  LoopCloser* const loops_;
};

}  // namespace docent::engine
