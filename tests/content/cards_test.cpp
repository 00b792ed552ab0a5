// SPDX-License-Identifier: Apache-2.0
#include "content/cards.h"
#include "engine/base/utf8.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace docent::content {
namespace {

using ::testing::ElementsAre;

Entity Label(const std::string& name, const std::string& text) {
  Entity entity;
  entity.name = name;
  entity.kind = Entity::Kind::kLabel;
  entity.label.text = text;
  return entity;
}

Entity Of(Entity::Kind kind, const std::string& name) {
  Entity entity;
  entity.name = name;
  entity.kind = kind;
  return entity;
}

TEST(Cards, HaveTheTextsModelAndSoundsOfTheGroup) {
  Scene scene;
  scene.entities = {Of(Entity::Kind::kModel, "vase"), Label("about", "A vase."),
                    Of(Entity::Kind::kSound, "speech"), Label("other", "Something else."),
                    Label("secret", "Hidden.")};
  scene.entities[2].sound.caption = "Listen.";
  scene.entities[1].label.translations["de"] = "Eine Vase.";
  scene.entities[4].hidden = true;
  for (const std::size_t i : {0, 1, 2, 4}) scene.entities[i].group = "vase";
  for (const char* name : {"vase", "about", "speech"}) {
    const Card card = CardOf(scene, *scene.Find(name), "en");
    ASSERT_NE(card.shown, nullptr) << name;
    EXPECT_EQ(card.shown->name, "vase");
    EXPECT_THAT(card.sounds, ElementsAre("speech"));
    EXPECT_EQ(card.text, std::string(name) == "speech" ? "Listen.\n\nA vase." : "A vase.\n\nListen.");
  }
  EXPECT_EQ(CardOf(scene, *scene.Find("about"), "de").text, "Eine Vase.\n\nListen.");
  const Card alone = CardOf(scene, *scene.Find("other"), "en");
  EXPECT_EQ(alone.shown, nullptr);
  EXPECT_EQ(alone.text, "Something else.");
  EXPECT_TRUE(alone.sounds.empty());
}

TEST(Cards, AreThoseOfWhatCanBeReadSeenOrHeard) {
  EXPECT_TRUE(HasCard(Label("a", "Text")));
  EXPECT_FALSE(HasCard(Label("a", "")));
  EXPECT_TRUE(HasCard(Of(Entity::Kind::kModel, "a")));
  EXPECT_TRUE(HasCard(Of(Entity::Kind::kImage, "a")));
  EXPECT_TRUE(HasCard(Of(Entity::Kind::kSound, "a")));
  EXPECT_FALSE(HasCard(Of(Entity::Kind::kTrail, "a")));
  EXPECT_FALSE(HasCard(Of(Entity::Kind::kSignpost, "a"))) << "it has no text";
  Entity hidden = Label("a", "Text");
  hidden.hidden = true;
  EXPECT_FALSE(HasCard(hidden));
}

TEST(Pages, EndWithAParagraphElseASentenceElseAWord) {
  EXPECT_THAT(PagesOf("One two three.\nFour five six. Seven", 19),
              ElementsAre("One two three.", "Four five six.", "Seven"));
  EXPECT_THAT(PagesOf("Lions sleep a lot. They hunt at night.", 22),
              ElementsAre("Lions sleep a lot.", "They hunt at night."));
  EXPECT_THAT(PagesOf("alpha beta gamma delta", 12), ElementsAre("alpha beta", "gamma delta"));
  EXPECT_THAT(PagesOf("abcdefghij", 4), ElementsAre("abcd", "efgh", "ij"));
  EXPECT_THAT(PagesOf("", 4), ElementsAre(""));
  EXPECT_THAT(PagesOf(" \n ", 4), ElementsAre(""));
  EXPECT_THAT(PagesOf("Short.", 400), ElementsAre("Short."));
}

TEST(Pages, CountCharactersAndSplitNone) {
  // Each letter has two bytes.
  EXPECT_THAT(PagesOf("أبتثجحخد", 4), ElementsAre("أبتث", "جحخد"));
  for (const std::string& page : PagesOf(std::string(999, 'x') + "ä" + std::string(999, 'y'), 7))
    EXPECT_TRUE(IsUtf8(page)) << page;
}

TEST(Pages, LoseNoWord) {
  std::string text;
  for (int i = 0; i < 300; ++i) text += "word" + std::to_string(i) + (i % 7 == 0 ? ". " : " ");
  std::string joined;
  for (const std::string& page : PagesOf(text, 90)) {
    EXPECT_LE(page.size(), 90u);
    joined += page + " ";
  }
  EXPECT_EQ(joined, text);
}

}  // namespace
}  // namespace docent::content
