// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "content/edits.h"

// The words of a script line, and the edits that need nothing but their words.
namespace docent::content {

// Splits a line at blanks. Words with blanks, '#' or quotes stand in double quotes, in which \" is a quote,
// \\ a backslash and \n a line break; '#' outside quotes begins a comment. Throws Error for a quote that is
// not closed.
std::vector<std::string> SplitWords(std::string_view line);

// A word as SplitWords reads it back: bare where possible, else in quotes. QuoteText always quotes.
std::string QuoteWord(std::string_view word);
std::string QuoteText(std::string_view text);

// Shortest decimal that reads back to the same number.
std::string NumberText(double number);
// The number that the whole word says; throws Error naming `what` otherwise.
double ParseNumber(std::string_view word, std::string_view what);

// The edit that `words` say (move, rotate, scale, remove; arguments in edits.h), or nullptr when the first
// word is none of these. Throws Error for wrong arguments.
std::unique_ptr<Edit> ParseEdit(std::span<const std::string> words);

}  // namespace docent::content
