// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/mapper.h"

namespace docent::engine {

bool Mapper::WorkOnLoops() {
  switch (loops_.Step(&map_)) {
    case LoopCloser::Progress::kNothing:
      return false;
    case LoopCloser::Progress::kWorked:
      break;
    case LoopCloser::Progress::kMoved: {
      searcher_.Clear();
      Publish();
      const ClosedLoop& loop = loops_.last();
      AddEvent(map_.FindKeyFrame(loop.keyframe)->keyframe.time, MapperEvent::LoopClosed{loop});
      const std::lock_guard lock(mutex_);
      ++times_.loops_closed;
      break;
    }
    case LoopCloser::Progress::kFused:
      global_interrupted_ = loop_to_adjust_ = true;
      Publish();
      break;
  }
  return true;
}

KeyFrameCandidate Mapper::WithCorrections(KeyFrameCandidate candidate) const {
  candidate.camera = lens_estimation_.CurrentModel(candidate.camera);
  if (candidate.map_revision == 0) return candidate;
  for (const auto& correction : map_.corrections()) {
    if (correction->revision <= candidate.map_revision) continue;
    const auto moved = correction->after_from_before.find(candidate.reference_keyframe);
    if (moved != correction->after_from_before.end())
      candidate.camera_from_map = CorrectedPose(candidate.camera_from_map, moved->second);
  }
  return candidate;
}

}  // namespace docent::engine
