// SPDX-License-Identifier: Apache-2.0
#include "content/edit_script.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "engine/base/error.h"

namespace docent::content {
namespace {

bool IsBlank(char letter) {
  return letter == ' ' || letter == '\t' || letter == '\r' || letter == '\n';
}

// Reads a quoted word whose opening quote is at *at, and moves *at past the closing quote.
std::string ReadQuoted(std::string_view line, std::size_t* at) {
  std::string word;
  for (std::size_t i = *at + 1; i < line.size(); ++i) {
    if (line[i] == '"') {
      *at = i + 1;
      return word;
    }
    if (line[i] == '\\' && i + 1 < line.size()) {
      ++i;
      word += line[i] == 'n' ? '\n' : line[i];
    } else {
      word += line[i];
    }
  }
  throw Error("A quotation mark is not closed.");
}

void CheckCount(std::span<const std::string> words, std::size_t count, const char* form) {
  if (words.size() != count) throw Error("'" + words[0] + "' must be written as: " + form + ".");
}

}  // namespace

std::vector<std::string> SplitWords(std::string_view line) {
  std::vector<std::string> words;
  std::size_t at = 0;
  while (at < line.size()) {
    if (IsBlank(line[at])) {
      ++at;
    } else if (line[at] == '#') {
      break;
    } else if (line[at] == '"') {
      words.push_back(ReadQuoted(line, &at));
    } else {
      std::size_t end = at;
      while (end < line.size() && !IsBlank(line[end]) && line[end] != '#' && line[end] != '"') ++end;
      words.emplace_back(line.substr(at, end - at));
      at = end;
    }
  }
  return words;
}

std::string QuoteText(std::string_view text) {
  std::string quoted = "\"";
  for (const char letter : text) {
    if (letter == '"' || letter == '\\') quoted += '\\';
    if (letter == '\n') {
      quoted += "\\n";
    } else {
      quoted += letter;
    }
  }
  return quoted + '"';
}

std::string QuoteWord(std::string_view word) {
  const bool plain = !word.empty() && std::none_of(word.begin(), word.end(), [](char letter) {
    return IsBlank(letter) || letter == '#' || letter == '"' || letter == '\\';
  });
  return plain ? std::string(word) : QuoteText(word);
}

std::string NumberText(double number) {
  char text[32];
  const auto end = std::to_chars(std::begin(text), std::end(text), number);
  return std::string(std::begin(text), end.ptr);
}

double ParseNumber(std::string_view word, std::string_view what) {
  double number = 0;
  const auto end = std::from_chars(word.data(), word.data() + word.size(), number);
  if (end.ec != std::errc() || end.ptr != word.data() + word.size() || !std::isfinite(number)) {
    throw Error(std::string(what) + " '" + std::string(word.substr(0, 40)) + "' is not a number.");
  }
  return number;
}

std::unique_ptr<Edit> ParseEdit(std::span<const std::string> words) {
  if (words.empty()) return nullptr;
  if (words[0] == "move") {
    CheckCount(words, 5, "move NAME X Y Z");
    return MoveEdit(words[1],
                    {ParseNumber(words[2], "X"), ParseNumber(words[3], "Y"), ParseNumber(words[4], "Z")});
  }
  if (words[0] == "rotate") {
    CheckCount(words, 3, "rotate NAME DEG");
    return RotateEdit(words[1], ParseNumber(words[2], "The angle"));
  }
  if (words[0] == "scale") {
    CheckCount(words, 3, "scale NAME FACTOR");
    return ScaleEdit(words[1], ParseNumber(words[2], "The factor"));
  }
  if (words[0] == "remove") {
    CheckCount(words, 2, "remove NAME");
    return RemoveEdit(words[1]);
  }
  return nullptr;
}

}  // namespace docent::content
