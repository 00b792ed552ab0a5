// SPDX-License-Identifier: Apache-2.0
#include "app/session/visitor_strings.h"

namespace docent::app::visitor_strings {

std::string Filled(std::string_view text, std::initializer_list<std::string> values) {
  constexpr std::string_view kBraces = "{}";
  std::string filled;
  for (const std::string& value : values) {
    const std::size_t braces = text.find(kBraces);
    if (braces == std::string_view::npos) break;
    filled += text.substr(0, braces);
    filled += value;
    text.remove_prefix(braces + kBraces.size());
  }
  return filled += text;
}

}  // namespace docent::app::visitor_strings
