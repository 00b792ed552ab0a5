// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <string_view>

// Variants of a text in several languages. Languages are named by the tags of BCP 47 (RFC 5646), in lower
// case: "de", "es-419", "zh-hant". Pure functions; thread-safe.
namespace docent::content {

inline constexpr std::size_t kMaxLanguageBytes = 35;  // Of a tag; RFC 5646, section 4.4.1.
inline constexpr std::size_t kMaxTranslations = 32;   // Of one text.

// The variants of a text by language, beside the first text, whose language is not named.
using Translations = std::map<std::string, std::string>;

// The tag in the form in which it is stored; empty if the text is no tag: a language of two to eight letters,
// and further parts of one to eight letters or digits, joined by hyphens.
std::string LanguageTag(std::string_view text);

// The text for a reader of this language: the variant of its tag, else that of the tag without its last parts
// ("Lookup" of RFC 4647, section 3.4), else `first`. An empty language gives `first`.
const std::string& TextFor(const std::string& language, const std::string& first,
                           const Translations& translations);

// Whether a reader of this language gets one of the variants (TextFor), and not the first text. Nobody misses
// a variant in an empty language: true.
bool HasVariant(const std::string& language, const Translations& translations);

// The language of a POSIX locale: "de-at" of "de_AT.UTF-8"; empty for "C", "POSIX" and what names none.
std::string LanguageOfLocale(std::string_view locale);

}  // namespace docent::content
