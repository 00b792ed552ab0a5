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

RejectionMessage MessageOf(const engine::RelocalizationResult& result,
                           const RelocalizationMessage::NameOf& name) {
  RejectionMessage message{.reason = result.rejection, .map = name(result.map_key), .competitor = {}};
  if (result.competitor_key != result.map_key) message.competitor = name(result.competitor_key);
  return message;
}

}  // namespace

std::string TextOf(const RejectionMessage& rejection, const VisitorStrings& strings) {
  switch (rejection.reason) {
    case engine::RejectionReason::kNone:
      break;
    case engine::RejectionReason::kFewPoints:
      return strings.not_recognized;
    case engine::RejectionReason::kPoorFit:
    case engine::RejectionReason::kContradicted:
      return Filled(strings, strings.resembles, {rejection.map});
    case engine::RejectionReason::kClustered:
      return Filled(strings, strings.only_a_corner, {rejection.map});
    case engine::RejectionReason::kAmbiguous:
      if (rejection.competitor.empty()) return Filled(strings, strings.either_of_two, {rejection.map});
      return Filled(strings, strings.this_or_that, {rejection.map, rejection.competitor});
    case engine::RejectionReason::kUnconfirmed:
      return Filled(strings, strings.probably, {rejection.map});
  }
  return {};
}

std::string ReasonOf(const RejectionMessage& rejection, int inliers) {
  const std::string& map = rejection.map;
  const std::string count = " (" + std::to_string(inliers) + " inliers)";
  switch (rejection.reason) {
    case engine::RejectionReason::kNone:
      break;
    case engine::RejectionReason::kFewPoints:
      return "too few inliers (" + std::to_string(inliers) + ")";
    case engine::RejectionReason::kPoorFit:
      return "large residual: " + map + count;
    case engine::RejectionReason::kContradicted:
      return "most of the image differs: " + map + count;
    case engine::RejectionReason::kClustered:
      return "inliers in one part of the image only: " + map + count;
    case engine::RejectionReason::kAmbiguous:
      return "ambiguous: " +
             (rejection.competitor.empty() ? "two places in " + map : map + " or " + rejection.competitor) +
             count;
    case engine::RejectionReason::kUnconfirmed:
      return "not confirmed yet: " + map + count;
  }
  return {};
}

bool RelocalizationMessage::Update(Timestamp time, bool has_pose, const engine::RelocalizationResult& result,
                                   const NameOf& name) {
  if (has_pose) {
    reported_ = {};
    rejection_ = {};
    text_.clear();
    return false;
  }
  if (result.rejection != engine::RejectionReason::kNone) rejected_at_ = time;
  if (reported_at_ && time - *reported_at_ < kMinDisplayTime) return false;
  if (result.rejection == engine::RejectionReason::kNone) {
    // No place resembles the image any more, so the message no longer applies.
    if (!rejected_at_ || time - *rejected_at_ >= kMinDisplayTime) {
      reported_ = {};
      rejection_ = {};
      text_.clear();
    }
    return false;
  }
  if (HasSameMessage(result, reported_)) return false;
  reported_ = result;
  reported_at_ = time;
  rejection_ = MessageOf(result, name);
  text_ = TextOf(rejection_, VisitorStringsFor(""));
  return true;
}

}  // namespace docent::app
