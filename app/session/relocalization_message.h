// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "app/session/visitor_strings.h"
#include "engine/base/time.h"
#include "engine/tracking/relocalization_result.h"

namespace docent::app {

// Why no hypothesis of a lost camera's place is accepted, with the names of the maps that it concerns.
struct RejectionMessage {
  engine::RejectionReason reason = engine::RejectionReason::kNone;
  std::string map;         // The map that the image resembles most.
  std::string competitor;  // A map that it resembles as much; empty if that is another place in the same map.
};

// The sentence about it that a user reads; empty if there is no reason.
std::string TextOf(const RejectionMessage& rejection, const VisitorStrings& strings);

// The same for events.csv, in the engine's terms: "ambiguous: Elephants or Whales (31 inliers)".
std::string ReasonOf(const RejectionMessage& rejection, int inliers);

// The message for a user while a camera is lost and no hypothesis is accepted. The rejection reason changes
// with every image; a message stays for at least a second, so that it can be read and events.csv does not
// fill with repetitions. Its owner guards it.
class RelocalizationMessage {
 public:
  // The name of a map by its key.
  using NameOf = std::function<std::string(std::uint64_t)>;

  // To be called with the result of every frame, by ascending time. Returns true when text() is a new
  // message.
  bool Update(Timestamp time, bool has_pose, const engine::RelocalizationResult& result, const NameOf& name);
  // What is to be reported; its reason is kNone when there is no rejection to report.
  const RejectionMessage& rejection() const { return rejection_; }
  // The same in English; empty when there is no rejection to report.
  const std::string& text() const { return text_; }

 private:
  engine::RelocalizationResult reported_;
  std::optional<Timestamp> reported_at_, rejected_at_;
  RejectionMessage rejection_;
  std::string text_;
};

}  // namespace docent::app
