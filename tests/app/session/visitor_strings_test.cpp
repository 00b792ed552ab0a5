// SPDX-License-Identifier: Apache-2.0
#include "app/session/visitor_strings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstddef>

#include "app/session/route_text.h"
#include "app/session/visit_state.h"
#include "app/session/visitor_guide.h"
#include "ui/text.h"
#include "ui/visitor_layout.h"

namespace docent::app {
namespace {

using ::testing::ElementsAre;

constexpr const char* kVisitorLanguages[] = {"en", "de", "es", "ar"};

// The sentences of a language in their order. All members after the two first are sentences.
std::vector<std::string> SentencesOf(const VisitorStrings& strings) {
  constexpr std::size_t kSentences =
      (sizeof(VisitorStrings) - offsetof(VisitorStrings, welcome)) / sizeof(const char*);
  const auto* const first = reinterpret_cast<const char* const*>(
      reinterpret_cast<const std::byte*>(&strings) + offsetof(VisitorStrings, welcome));
  std::vector<std::string> sentences;
  for (std::size_t i = 0; i < kSentences; ++i) sentences.emplace_back(first[i] != nullptr ? first[i] : "");
  return sentences;
}

int CountBraces(const std::string& text) {
  int count = 0;
  for (std::size_t at = text.find("{}"); at != std::string::npos; at = text.find("{}", at + 2)) ++count;
  return count;
}

bool HasLetter(const std::string& text, unsigned char first_byte_from, unsigned char first_byte_to) {
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte >= first_byte_from && byte <= first_byte_to) return true;
  }
  return false;
}

TEST(VisitorStrings, AreWholeInEveryLanguage) {
  const std::vector<std::string> english = SentencesOf(VisitorStringsFor("en"));
  ASSERT_GT(english.size(), 30u);
  for (const char* language : kVisitorLanguages) {
    const VisitorStrings& strings = VisitorStringsFor(language);
    EXPECT_STREQ(strings.language, language);
    const std::vector<std::string> sentences = SentencesOf(strings);
    for (std::size_t i = 0; i < english.size(); ++i) {
      EXPECT_FALSE(sentences[i].empty()) << language << " has no \"" << english[i] << '"';
      EXPECT_EQ(CountBraces(sentences[i]), CountBraces(english[i])) << sentences[i];
      // Only a pattern of numbers and names may be the same in two languages.
      if (std::string(language) == "en" || english[i] == "{}. {}") continue;
      EXPECT_NE(sentences[i], english[i]);
      // In UTF-8, Arabic letters begin with the bytes 0xd8 to 0xdb.
      EXPECT_EQ(HasLetter(sentences[i], 0xd8, 0xdb), strings.is_right_to_left) << sentences[i];
    }
  }
}

TEST(VisitorStrings, AreThoseOfTheNearestLanguage) {
  EXPECT_STREQ(VisitorStringsFor("de-at").language, "de");
  EXPECT_STREQ(VisitorStringsFor("es-419").language, "es");
  EXPECT_STREQ(VisitorStringsFor("ar-eg").language, "ar");
  EXPECT_STREQ(VisitorStringsFor("fr").language, "en");
  EXPECT_STREQ(VisitorStringsFor("").language, "en");
}

TEST(VisitorStrings, KeepTheDirectionOfNamesInATextFromRightToLeft) {
  const VisitorStrings& arabic = VisitorStringsFor("ar");
  EXPECT_TRUE(arabic.is_right_to_left);
  EXPECT_EQ(Filled(arabic, "{} \u0645\u0646 {}", {"1", "Lions (2)"}),
            "\u200f\u2068"
            "1\u2069 \u0645\u0646 \u2068Lions (2)\u2069");
  EXPECT_EQ(Filled(VisitorStringsFor("en"), "{} of {}", {"1", "Lions (2)"}), "1 of Lions (2)");
  EXPECT_EQ(ui::ReadableText(Filled(arabic, "{}", {"Lions"})), "\u200f\u2068Lions\u2069") << "marks are kept";
}

TEST(VisitorStrings, LeadAVisitorInTheirLanguage) {
  Route route;
  route.stops = {{1, "Löwen"}, {2, "Masken"}};
  route.minutes = 10;
  RouteState state(route);
  const VisitorStrings& german = VisitorStringsFor("de");
  EXPECT_EQ(RouteLine(state, german), "2 Stationen, etwa 10 Minuten. Zuerst: Löwen");
  state.Enter(1, 0);
  EXPECT_EQ(RouteLine(state, german), "Station 1 von 2. Als Nächstes: Masken");
  EXPECT_THAT(RouteList(state, german), ElementsAre("1. Löwen (gesehen)", "2. Masken (als Nächstes)"));

  VisitState visit({"Löwen", "Masken"}, german);
  EXPECT_EQ(visit.Update(0, "", "").sentence, german.welcome);
  VisitState arabic({"Löwen"}, VisitorStringsFor("ar"));
  EXPECT_TRUE(arabic.Update(0, "", "").is_right_to_left);
}

TEST(VisitorHint, SaysWhyAPlaceIsNotRecognized) {
  const VisitorStrings& english = VisitorStringsFor("en");
  RejectionMessage rejection{
      .reason = engine::RejectionReason::kAmbiguous, .map = "Lions", .competitor = "Masks"};
  EXPECT_EQ(VisitorHint(rejection, engine::Hint::kMoveMoreSlowly, english),
            "This could be Lions or Masks. Move so that more is visible.");
  rejection.competitor.clear();
  EXPECT_EQ(VisitorHint(rejection, engine::Hint::kNone, VisitorStringsFor("de")),
            "Das könnte jede von zwei Stellen in Lions sein. Bewegen Sie sich, bis mehr zu sehen ist.");
}

TEST(VisitorHint, LeavesOutWhatIsForAnAuthor) {
  const VisitorStrings& english = VisitorStringsFor("en");
  EXPECT_EQ(VisitorHint({}, engine::Hint::kMoveMoreSlowly, english), "Move more slowly.");
  EXPECT_EQ(VisitorHint({}, engine::Hint::kChooseMap, english), "");
  EXPECT_EQ(VisitorHint({}, engine::Hint::kMoveSideways, english), "");
  EXPECT_EQ(VisitorHint({}, engine::Hint::kNone, english), "");
}

TEST(VisitorStrings, OfMenusFitIntoTheirRows) {
  // A small tablet, and a large one upright, with their pixels per millimetre.
  struct Display {
    int width_px, height_px;
    double pixels_per_mm;
  };
  for (const Display& display :
       {Display{800, 480, 5.2}, Display{1200, 1920, 8.9}, Display{1200, 1920, 3.8}}) {
    const double unit = ui::VisitorUnit_px(display.width_px, display.height_px, display.pixels_per_mm);
    ui::VisitorDisplay visitor;
    visitor.menu = {"Close"};
    const ui::HeadsUpStyle style{unit, 0, ui::kTouchTarget_mm * display.pixels_per_mm};
    const double row_px =
        ui::LayOutMenu(visitor, display.width_px, display.height_px, style).choices.front().width;
    for (const char* language : kVisitorLanguages) {
      const VisitorStrings& strings = VisitorStringsFor(language);
      for (const char* choice : {strings.menu_skip, strings.menu_back, strings.menu_stops, strings.menu_anew,
                                 strings.menu_close, strings.choose_continue, strings.choose_restart}) {
        ui::TextStyle text;
        text.size_px = 20 * unit;
        text.max_width_px = 5000;
        EXPECT_LE(ui::DrawText(choice, text).cols, row_px - 20 * unit) << choice << ", " << display.width_px;
      }
    }
  }
}

}  // namespace
}  // namespace docent::app
