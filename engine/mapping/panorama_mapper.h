// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <deque>
#include <utility>
#include <vector>

#include "engine/mapping/keyframe_candidate.h"
#include "engine/mapping/loops/loop_closing.h"
#include "engine/mapping/map_refinement.h"

namespace docent::engine {

// The mapper's tasks on panorama maps (hybrid-slam §5): inserts panorama keyframes, localizes them once there
// are finite points, and triangulates infinite points that localized keyframes see from two centres. It
// remembers which keyframes and pairs wait. On the thread that runs the mapper only.
class PanoramaMapper {
 public:
  // The pointers are borrowed.
  PanoramaMapper(const MapperOptions& options, MapWorkspace* workspace, MapperOutput* output,
                 MapRefinement* refinement, LoopCloser* loops)
      : options_(options), workspace_(workspace), output_(output), refinement_(refinement), loops_(loops) {}

  // Another map: all its panorama keyframes wait to be localized, and no pair waits.
  void Reset();
  // Adds a dependent keyframe to its panorama map; ignored if that is gone.
  void Insert(const KeyFrameCandidate& candidate);
  // A panorama keyframe that was the reference of its map until now waits to be localized.
  void AddUnlocalized(KeyFrameId keyframe) { to_localize_.push_back({keyframe}); }
  // Lets the infinite points of the first keyframe wait to be triangulated with the second.
  void PlanConversion(KeyFrameId reference, KeyFrameId partner) {
    to_convert_.emplace_back(reference, partner);
  }
  // The same for pairs of this localized keyframe with others.
  void PlanConversions(KeyFrameId keyframe);

  // Both try to localize one panorama keyframe: LocalizeNew one that was never tried, LocalizeAgain one of
  // the others. They return false if there is none worth trying.
  bool LocalizeNew();
  bool LocalizeAgain();
  // Triangulates the infinite points of one pair of keyframes; false if no pair waits.
  bool ConvertOne();

 private:
  // A dependent panorama keyframe that is not localized yet, and the number of finite points at the last
  // attempt.
  struct Unlocalized {
    KeyFrameId keyframe = kNoId;
    std::size_t tried_with_points = 0;
    bool appearance_due = false;  // guided search failed, and descriptor matching has not been tried since
  };

  void TryToLocalize(Unlocalized* waiting, std::size_t finite);
  // guess: see LocalizePanoramaKeyFrame.
  bool Localize(KeyFrameId keyframe, const Rigid3* guess);

  const MapperOptions& options_;
  MapWorkspace* const workspace_;
  MapperOutput* const output_;
  MapRefinement* const refinement_;
  LoopCloser* const loops_;
  std::vector<Unlocalized> to_localize_;
  std::deque<std::pair<KeyFrameId, KeyFrameId>> to_convert_;  // (reference, partner)
};

}  // namespace docent::engine
