// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "engine/base/time.h"
#include "engine/tracking/relocalization_result.h"

namespace docent::app {

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
  // Text for the screen; empty when there is no rejection to report.
  const std::string& text() const { return text_; }

 private:
  engine::RelocalizationResult reported_;
  std::optional<Timestamp> reported_at_, rejected_at_;
  std::string text_;
};

}  // namespace docent::app
