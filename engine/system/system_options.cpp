// SPDX-License-Identifier: Apache-2.0
#include "engine/system/system_options.h"

#include "engine/base/option_check.h"

namespace docent::engine {

std::optional<std::string> SystemOptions::Validate() const {
  return OptionCheck()
      .NotNegative(lost_time_before_new_map, "loss before a new map")
      .Contained(provisional.Validate())
      .Contained(tracker.Validate())
      .Contained(mapper.Validate())
      .fault();
}

}  // namespace docent::engine
