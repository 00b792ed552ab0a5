// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "content/scene.h"

// What a visitor can learn about an entity: a card with texts, a model or an image, and sounds. An entity's
// card also has what belongs to the other entities of its group. Pure functions; any thread.
namespace docent::content {

// Whether a visitor can open a card of the entity: of everything that is not hidden, except trails and
// signposts and labels without text.
bool HasCard(const Entity& entity);

// The contents of a card. All pointers are into the scene.
struct Card {
  const Entity* shown = nullptr;    // A model or an image; null for none.
  std::string text;                 // In the reader's language; paragraphs are apart by an empty line.
  std::vector<std::string> sounds;  // The names of the entities whose sounds belong to it.
};

// The card of an entity of this scene: the texts and sounds of its group, the entity's own first, and the
// first model or image. `language` is that of the reader (TextFor).
Card CardOf(const Scene& scene, const Entity& entity, const std::string& language);

// A text in parts of at most this many characters (code points; positive), which end with a paragraph, else
// with a sentence, else with a word where there is one in the second half of a part. Without text, one empty
// part.
std::vector<std::string> PagesOf(const std::string& text, std::size_t max_characters);

}  // namespace docent::content
