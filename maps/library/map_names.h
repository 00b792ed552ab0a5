// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <set>
#include <string>

namespace docent::maps {

// The name itself or, if it is taken, the first free one of "NAME (2)", "NAME (3)" and so on. A long name is
// shortened between two characters. Pure.
std::string FreeName(const std::string& name, const std::set<std::string>& taken);

}  // namespace docent::maps
