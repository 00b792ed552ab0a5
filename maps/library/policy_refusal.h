// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "maps/storage/policy.h"

namespace docent::maps {

// Throws docent::Error because the policy of a map forbids a change. `what` names what cannot be done: "it
// cannot be renamed".
[[noreturn]] void Refuse(Policy policy, const std::string& what);

}  // namespace docent::maps
