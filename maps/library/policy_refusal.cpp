// SPDX-License-Identifier: Apache-2.0
#include "maps/library/policy_refusal.h"

#include "engine/base/error.h"

namespace docent::maps {

void Refuse(Policy policy, const std::string& what) {
  throw Error(std::string("its policy is ") + ToString(policy) + ", so " + what +
              "; change its policy first");
}

}  // namespace docent::maps
