// SPDX-License-Identifier: Apache-2.0
#include "app/session/doubts.h"

namespace docent::app {

namespace {

constexpr Timestamp kReadingTime = std::chrono::seconds(1);

bool SameToSay(const engine::Verdict& a, const engine::Verdict& b) {
  if (a.doubt != b.doubt) return false;
  // Where hardly anything is recognised the nearest map is another one in every picture, and is not named.
  return a.doubt == engine::Doubt::kFewPoints || (a.map_key == b.map_key && a.rival_key == b.rival_key);
}

std::string InWords(const engine::Verdict& verdict, const Doubts::NameOf& name) {
  const std::string map = name(verdict.map_key);
  const std::string points = std::to_string(verdict.inliers) + " points";
  switch (verdict.doubt) {
    case engine::Doubt::kNone:
      break;
    case engine::Doubt::kFewPoints:
      return "too few known points are seen (" + std::to_string(verdict.inliers) + ")";
    case engine::Doubt::kPoorFit:
      return "it resembles " + map + ", but does not fit it";
    case engine::Doubt::kOneCorner:
      return points + " of " + map + " are seen, but all in one corner of the picture";
    case engine::Doubt::kLookAlikes:
      if (verdict.rival_key == verdict.map_key) return "it may be one place in " + map + " or another";
      return "it may be " + map + " or " + name(verdict.rival_key);
    case engine::Doubt::kUnconfirmed:
      return "it looks like " + map + ", to be confirmed";
  }
  return {};
}

}  // namespace

bool Doubts::See(Timestamp time, bool has_pose, const engine::Verdict& verdict, const NameOf& name) {
  if (has_pose) {
    told_ = {};
    words_.clear();
    return false;
  }
  if (verdict.doubt != engine::Doubt::kNone) seen_at_ = time;
  if (told_at_ && time - *told_at_ < kReadingTime) return false;
  if (verdict.doubt == engine::Doubt::kNone) {
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
