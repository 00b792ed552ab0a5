// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "content/edits.h"

// The words of a script line, and the edits that can be parsed from words alone.
namespace docent::content {

// Splits a line at blanks. Words that contain blanks, '#' or quotes are enclosed in double quotes, in which
// \" is a quote, \\ a backslash and \n a line break. '#' outside quotes begins a comment. Throws Error if a
// quote is not closed.
std::vector<std::string> SplitWords(std::string_view line);

// Formats a word so that SplitWords reads it back: without quotes if possible. QuoteText always adds quotes.
std::string QuoteWord(std::string_view word);
std::string QuoteText(std::string_view text);

// Returns the shortest decimal text that reads back as the same number.
std::string NumberText(double number);
// Parses the whole word as a number; otherwise throws Error with `what` in the message.
double ParseNumber(std::string_view word, std::string_view what);

// Parses an edit (move, rotate, scale or remove; see edits.h for the arguments). Returns nullptr when the
// first word is none of these. Throws Error for invalid arguments.
std::unique_ptr<Edit> ParseEdit(std::span<const std::string> words);

}  // namespace docent::content
