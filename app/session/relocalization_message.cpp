// SPDX-License-Identifier: Apache-2.0
#include "app/session/relocalization_message.h"

namespace docent::app {

namespace {

constexpr Timestamp kMinDisplayTime = std::chrono::seconds(1);

bool HasSameMessage(const engine::RelocalizationResult& a, const engine::RelocalizationResult& b) {
  if (a.rejection != b.rejection) return false;
  // With few inliers the best map changes with every image, and the message does not name it.
  return a.rejection == engine::RejectionReason::kFewPoints ||
         (a.map_key == b.map_key && a.competitor_key == b.competitor_key);
}

std::string Describe(const engine::RelocalizationResult& result, const RelocalizationMessage::NameOf& name) {
  const std::string map = name(result.map_key);
  switch (result.rejection) {
    case engine::RejectionReason::kNone:
      break;
    case engine::RejectionReason::kFewPoints:
      return "I don't recognise this place yet. Step back and look around slowly.";
    case engine::RejectionReason::kPoorFit:
      return "This resembles " + map + ", but does not match it. Move a little and look again.";
    case engine::RejectionReason::kClustered:
      return "Only one corner of the image shows " + map + ". Turn so that more of it is visible.";
    case engine::RejectionReason::kAmbiguous:
      if (result.competitor_key == result.map_key)
        return "This could be either of two places in " + map + ". Move so that more is visible.";
      return "This could be " + map + " or " + name(result.competitor_key) +
             ". Move so that more is visible.";
    case engine::RejectionReason::kUnconfirmed:
      return "Probably " + map + "; hold still";
  }
  return {};
}

}  // namespace

bool RelocalizationMessage::Update(Timestamp time, bool has_pose, const engine::RelocalizationResult& result,
                                   const NameOf& name) {
  if (has_pose) {
    reported_ = {};
    text_.clear();
    return false;
  }
  if (result.rejection != engine::RejectionReason::kNone) rejected_at_ = time;
  if (reported_at_ && time - *reported_at_ < kMinDisplayTime) return false;
  if (result.rejection == engine::RejectionReason::kNone) {
    // No place resembles the image any more, so the message no longer applies.
    if (!rejected_at_ || time - *rejected_at_ >= kMinDisplayTime) {
      reported_ = {};
      text_.clear();
    }
    return false;
  }
  if (HasSameMessage(result, reported_)) return false;
  reported_ = result;
  reported_at_ = time;
  text_ = Describe(result, name);
  return true;
}

}  // namespace docent::app
