// SPDX-License-Identifier: Apache-2.0
#include "maps/library/map_names.h"

#include "engine/base/utf8.h"
#include "maps/library/library.h"

namespace docent::maps {

std::string FreeName(const std::string& name, const std::set<std::string>& taken) {
  if (!taken.contains(name)) return name;
  for (int number = 2;; ++number) {
    const std::string suffix = " (" + std::to_string(number) + ")";
    if (std::string free = Shortened(name, kMaxMapNameBytes - suffix.size()) + suffix; !taken.contains(free))
      return free;
  }
}

}  // namespace docent::maps
