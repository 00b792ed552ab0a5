// SPDX-License-Identifier: Apache-2.0
#include "app/session/relocalization_message.h"

namespace docent::app {

namespace {

constexpr Timestamp kReadingTime = std::chrono::seconds(1);

bool SameToSay(const engine::RelocalizationResult& a, const engine::RelocalizationResult& b) {
  if (a.doubt != b.doubt) return false;
  // Where hardly anything is recognised the nearest map is another one in every image, and is not named.
  return a.doubt == engine::RejectionReason::kFewPoints ||
         (a.map_key == b.map_key && a.competitor_key == b.competitor_key);
}

std::string InWords(const engine::RelocalizationResult& verdict, const RelocalizationMessage::NameOf& name) {
  const std::string map = name(verdict.map_key);
  const std::string points = std::to_string(verdict.inliers) + " points";
  switch (verdict.doubt) {
    case engine::RejectionReason::kNone:
      break;
    case engine::RejectionReason::kFewPoints:
      return "too few known points are seen (" + std::to_string(verdict.inliers) + ")";
    case engine::RejectionReason::kPoorFit:
      return "it resembles " + map + ", but does not fit it";
    case engine::RejectionReason::kOneCorner:
      return points + " of " + map + " are seen, but all in one corner of the image";
    case engine::RejectionReason::kLookAlikes:
      if (verdict.competitor_key == verdict.map_key) return "it may be one place in " + map + " or another";
      return "it may be " + map + " or " + name(verdict.competitor_key);
    case engine::RejectionReason::kUnconfirmed:
      return "it looks like " + map + ", to be confirmed";
  }
  return {};
}

}  // namespace

bool RelocalizationMessage::See(Timestamp time, bool has_pose, const engine::RelocalizationResult& verdict,
                                const NameOf& name) {
  if (has_pose) {
    told_ = {};
    words_.clear();
    return false;
  }
  if (verdict.doubt != engine::RejectionReason::kNone) seen_at_ = time;
  if (told_at_ && time - *told_at_ < kReadingTime) return false;
  if (verdict.doubt == engine::RejectionReason::kNone) {
    // Nothing resembles what is seen any more: that is no doubt.
    if (!seen_at_ || time - *seen_at_ >= kReadingTime) {
      told_ = {};
      words_.clear();
    }
    return false;
  }
  if (SameToSay(verdict, told_)) return false;
  told_ = verdict;
  told_at_ = time;
  words_ = InWords(verdict, name);
  return true;
}

}  // namespace docent::app
