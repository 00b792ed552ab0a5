// SPDX-License-Identifier: Apache-2.0
#include "content/cards.h"

#include <algorithm>
#include <string_view>

namespace docent::content {

namespace {

constexpr std::string_view kBlank = " \t\r\n";

void AddText(const Entity& entity, const std::string& language, std::string* text) {
  const std::string& own = ShownText(entity, language);
  if (own.empty()) return;
  *text += (text->empty() ? "" : "\n\n") + own;
}

void AddTo(const Entity& entity, const std::string& language, Card* card) {
  if (HasModel(entity) && card->shown == nullptr) card->shown = &entity;
  if (entity.kind == Entity::Kind::kSound) card->sounds.push_back(entity.name);
  AddText(entity, language, &card->text);
}

// The byte at which the text has this many characters; its size if it has fewer.
std::size_t BytesOf(std::string_view text, std::size_t characters) {
  std::size_t at = 0;
  for (std::size_t count = 0; at < text.size(); ++at) {
    const bool begins = (static_cast<unsigned char>(text[at]) & 0xC0u) != 0x80u;
    if (begins && count++ == characters) break;
  }
  return at;
}

// Where a part that can have `most` bytes ends best: after a paragraph, a sentence or a word of its second
// half, in this order; else after `most` bytes.
std::size_t BestEnd(std::string_view text, std::size_t most) {
  if (most >= text.size()) return text.size();
  const std::string_view part = text.substr(0, most);
  const auto after = [&](std::string_view mark) {
    const std::size_t at = part.rfind(mark);
    return at == std::string_view::npos ? 0 : at + mark.size();
  };
  const std::size_t paragraph = after("\n");
  if (2 * paragraph >= most) return paragraph;
  std::size_t sentence = 0;
  // Of the languages that the program speaks; the last two are Arabic and Chinese.
  for (const char* mark : {". ", "! ", "? ", "؟ ", "。"}) sentence = std::max(sentence, after(mark));
  if (2 * sentence >= most) return sentence;
  const std::size_t word = after(" ");
  return 2 * word >= most ? word : most;
}

}  // namespace

bool HasCard(const Entity& entity) {
  if (entity.hidden) return false;
  switch (entity.kind) {
    case Entity::Kind::kModel:
    case Entity::Kind::kImage:
    case Entity::Kind::kSound:
      return true;
    case Entity::Kind::kSignpost:
      return !entity.signpost.text.empty();
    case Entity::Kind::kLabel:
      return !entity.label.text.empty();
    case Entity::Kind::kTrail:
    case Entity::Kind::kOccluder:
      break;
  }
  return false;
}

Card CardOf(const Scene& scene, const Entity& entity, const std::string& language) {
  Card card;
  AddTo(entity, language, &card);
  if (entity.group.empty()) return card;
  for (const Entity& other : scene.entities) {
    if (&other != &entity && other.group == entity.group && !other.hidden) AddTo(other, language, &card);
  }
  return card;
}

std::vector<std::string> PagesOf(const std::string& text, std::size_t max_characters) {
  std::vector<std::string> pages;
  std::string_view rest = text;
  while (true) {
    const std::size_t begin = std::min(rest.find_first_not_of(kBlank), rest.size());
    rest.remove_prefix(begin);
    if (rest.empty()) break;
    const std::size_t end = BestEnd(rest, BytesOf(rest, max_characters));
    std::string_view page = rest.substr(0, end);
    page = page.substr(0, page.find_last_not_of(kBlank) + 1);
    pages.emplace_back(page);
    rest.remove_prefix(end);
  }
  if (pages.empty()) pages.emplace_back();
  return pages;
}

}  // namespace docent::content
