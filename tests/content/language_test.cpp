// SPDX-License-Identifier: Apache-2.0
#include "content/language.h"

#include <gtest/gtest.h>

#include <set>
#include <string>
#include <vector>

#include "content/scene.h"

namespace docent::content {
namespace {

TEST(Language, TagsAreStoredInLowerCase) {
  for (const char* tag : {"de", "es-419", "zh-hant-tw", "gsw", "de-1996", "x-y"}) {
    if (std::string(tag) != "x-y") {
      EXPECT_EQ(LanguageTag(tag), tag);
    } else {
      EXPECT_EQ(LanguageTag(tag), "") << "a private tag names no language";
    }
  }
  EXPECT_EQ(LanguageTag("De-AT"), "de-at");
}

TEST(Language, WhatIsNoTagIsRefused) {
  for (const char* text : {"", "d", "d-at", "de-", "-de", "de--at", "de_AT", "deutschland", "12", "d2",
                           "de at", "dé", "de-abcdefghi", "de-aaaaaaaa-bbbbbbbb-cccccccc-dddddddd"})
    EXPECT_EQ(LanguageTag(text), "") << text;
}

TEST(Language, AReaderGetsTheTextOfTheTagOrOfItsBeginning) {
  const std::string first = "lion";
  const Translations translations = {{"de", "Löwe"}, {"zh-hant", "獅"}, {"es", "león"}};
  const auto shown = [&](const char* language) { return TextFor(language, first, translations); };
  EXPECT_EQ(shown("de"), "Löwe");
  EXPECT_EQ(shown("de-at"), "Löwe");
  EXPECT_EQ(shown("zh-hant-tw"), "獅");
  EXPECT_EQ(shown("es-x-island"), "león");
  EXPECT_EQ(shown("zh"), "lion") << "a longer tag is no variant of a shorter one";
  EXPECT_EQ(shown("fr"), "lion");
  EXPECT_EQ(shown(""), "lion");
}

TEST(Language, ATextIsMissingInALanguageThatAnotherTextHas) {
  Scene scene;
  for (const Translations& translations :
       {Translations{{"de", "Löwe"}, {"es-419", "león"}}, Translations{{"es", "tigre"}}, Translations{}}) {
    Entity& label = scene.entities.emplace_back();
    label.name = "label-" + std::to_string(scene.entities.size());
    label.kind = Entity::Kind::kLabel;
    label.label.text = "text";
    *TranslationsOf(&label) = translations;
  }
  scene.entities.emplace_back().kind = Entity::Kind::kModel;
  Entity& silent = scene.entities.emplace_back();
  silent.kind = Entity::Kind::kSound;
  const std::set<std::string> languages = LanguagesOf(scene);
  EXPECT_EQ(languages, (std::set<std::string>{"de", "es", "es-419"}));
  using Names = std::vector<std::string>;
  const auto missing = [&](std::size_t i) { return MissingLanguages(scene.entities[i], languages); };
  EXPECT_EQ(missing(0), Names{"es"});
  EXPECT_EQ(missing(1), Names{"de"}) << "a reader of es-419 gets the variant in es";
  EXPECT_EQ(missing(2), (Names{"de", "es", "es-419"}));
  EXPECT_EQ(missing(3), Names{}) << "a model has no text";
  EXPECT_EQ(missing(4), Names{}) << "a sound without a caption is not read";
}

TEST(Language, ALocaleNamesItsLanguage) {
  EXPECT_EQ(LanguageOfLocale("de_AT.UTF-8"), "de-at");
  EXPECT_EQ(LanguageOfLocale("ca_ES@valencia"), "ca-es");
  EXPECT_EQ(LanguageOfLocale("ar"), "ar");
  for (const char* none : {"", "C", "POSIX", "C.UTF-8", "en US"})
    EXPECT_EQ(LanguageOfLocale(none), "") << none;
}

}  // namespace
}  // namespace docent::content
