// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "engine/initialization/hint.h"
#include "engine/mapping/loops/map_joining.h"
#include "engine/mapping/mapper_event.h"
#include "engine/system/camera_rig.h"

// Results of the engine in the words of events, reports and messages.
namespace docent::app {

// "converged after 5 iterations, cost 120 -> 80, sigma 0.500, 3 outliers"
std::string TextOf(const engine::BundleSummary& summary);
// "drift of 1.2 % of the path, ...; keyframe 40 matches keyframe 2: ..."
std::string TextOf(const engine::ClosedLoop& loop);
// The sentence that a person reads, or part of one in lower case; empty for kNone.
std::string TextOf(engine::Hint hint);
// "rigid, baseline 0.25 (sigma 0.001), rotation 12.3 degrees (sigma 0.05)"
std::string TextOf(const engine::RigEstimate& rig);
// The figures in one line.
std::string TextOf(const engine::MapOverlap& overlap);
// A warning in whole sentences.
std::string TextOf(const engine::CalibrationContradiction& contradiction);
// "512.0 px (+-1.2 %)".
std::string FormatFocalLength(const engine::EstimatedLens& lens);
// Why two maps were not joined: one sentence without full stop. `overlap` belongs to the same attempt.
std::string TextOf(engine::JoinRefusal refusal, const engine::MapOverlap& overlap);
// The same for a person who builds maps, without figures.
std::string TextForAuthors(engine::JoinRefusal refusal, const engine::MapOverlap& overlap);

// The two columns of events.csv for an action of the mapper in the map of this name; empty for actions that
// are not reported.
struct EventText {
  std::string event, detail;
};
std::optional<EventText> TextOf(const engine::MapperEvent& event, const std::string& map_name);

}  // namespace docent::app
