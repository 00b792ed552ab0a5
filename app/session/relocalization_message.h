// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "engine/base/time.h"
#include "engine/tracking/relocalization_result.h"

namespace docent::app {

// What a person is told of one camera that is lost and not sure where it is. Verdicts change with every
// image; what is told stays for a second at least, so that it can be read and events.csv is not flooded.
// Its owner guards it.
class RelocalizationMessage {
 public:
  // The name of a map by its key.
  using NameOf = std::function<std::string(std::uint64_t)>;

  // Every frame's verdict, by ascending time. True when there is something new to tell: words().
  bool See(Timestamp time, bool has_pose, const engine::RelocalizationResult& verdict, const NameOf& name);
  // Part of a sentence, without its full stop; empty when there is no doubt to tell of.
  const std::string& words() const { return words_; }

 private:
  engine::RelocalizationResult told_;
  std::optional<Timestamp> told_at_, seen_at_;
  std::string words_;
};

}  // namespace docent::app
