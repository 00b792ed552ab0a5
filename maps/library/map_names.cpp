// SPDX-License-Identifier: Apache-2.0
#include "maps/library/map_names.h"

#include <algorithm>

#include "maps/library/library.h"

namespace docent::maps {

std::string FreeName(const std::string& name, const std::set<std::string>& taken) {
  if (!taken.contains(name)) return name;
  for (int number = 2;; ++number) {
    const std::string suffix = " (" + std::to_string(number) + ")";
    // Cuts only between whole UTF-8 characters: bytes 10xxxxxx continue the one before.
    std::size_t length = std::min(name.size(), kMaxMapNameBytes - suffix.size());
    while (length < name.size() && length > 0 && (static_cast<unsigned char>(name[length]) & 0xC0) == 0x80)
      --length;
    if (std::string free = name.substr(0, length) + suffix; !taken.contains(free)) return free;
  }
}

}  // namespace docent::maps
