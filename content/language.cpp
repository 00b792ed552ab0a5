// SPDX-License-Identifier: Apache-2.0
#include "content/language.h"

#include <algorithm>

namespace docent::content {
namespace {

constexpr std::size_t kMaxPartBytes = 8;  // RFC 5646, section 2.1.

bool IsLetter(char c) {
  return c >= 'a' && c <= 'z';
}

}  // namespace

std::string LanguageTag(std::string_view text) {
  if (text.empty() || text.size() > kMaxLanguageBytes) return "";
  std::string tag(text);
  std::size_t part = 0;  // Length of the part so far.
  bool is_first = true;
  for (char& c : tag) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    if (c == '-') {
      if (part == 0 || (is_first && part < 2)) return "";
      part = 0;
      is_first = false;
      continue;
    }
    const bool is_digit = c >= '0' && c <= '9' && !is_first;
    if ((!IsLetter(c) && !is_digit) || ++part > kMaxPartBytes) return "";
  }
  return part == 0 || (is_first && part < 2) ? "" : tag;
}

namespace {

// The variant for a reader of this language; null if there is none.
const std::string* FindVariant(const std::string& language, const Translations& translations) {
  for (std::string range = language; !range.empty();) {
    if (const auto found = translations.find(range); found != translations.end()) return &found->second;
    std::size_t end = range.rfind('-');
    if (end == std::string::npos) break;
    // A single letter or digit only introduces the part after it.
    if (end >= 2 && range[end - 2] == '-') end -= 2;
    range.resize(end);
  }
  return nullptr;
}

}  // namespace

const std::string& TextFor(const std::string& language, const std::string& first,
                           const Translations& translations) {
  const std::string* const variant = FindVariant(language, translations);
  return variant != nullptr ? *variant : first;
}

bool HasVariant(const std::string& language, const Translations& translations) {
  return language.empty() || FindVariant(language, translations) != nullptr;
}

std::string LanguageOfLocale(std::string_view locale) {
  std::string name(locale.substr(0, locale.find_first_of(".@")));
  if (name == "C" || name == "POSIX") return "";
  std::replace(name.begin(), name.end(), '_', '-');
  return LanguageTag(name);
}

}  // namespace docent::content
