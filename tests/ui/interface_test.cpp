// SPDX-License-Identifier: Apache-2.0
// The parts of the author's interface that draw nothing: layout, colours, messages, selection.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "ui/authoring_panel.h"
#include "ui/entity_shapes.h"
#include "ui/inset.h"
#include "ui/letterbox.h"
#include "ui/message_board.h"
#include "ui/selection.h"
#include "ui/theme.h"
#include "ui/window_layout.h"

namespace docent::ui {
namespace {

using ::testing::ElementsAre;

TEST(WindowLayout, FitsEverySizeAndNeverCoversTheSecondCamera) {
  for (const auto& [width, height] :
       {std::pair(640, 400), {800, 600}, {1280, 800}, {1920, 1080}, {3840, 2160}}) {
    for (const double scale : {0.75, 1.0, 1.5, 2.0, 3.0, 4.0}) {
      for (const bool open : {false, true}) {
        SCOPED_TRACE(testing::Message()
                     << width << "x" << height << " at " << scale << (open ? "" : " closed"));
        const WindowLayout layout = LayOutWindow(width, height, scale, open);
        EXPECT_EQ(layout.panel.right(), width);
        EXPECT_EQ(layout.image.x, 0);
        EXPECT_LE(layout.image.right(), layout.panel.x) << "they do not overlap";
        EXPECT_EQ(layout.panel.height, height);
        EXPECT_GE(layout.image.width, 0.5 * width);
        EXPECT_LE(layout.scale, std::max(0.75, scale));
        EXPECT_LE(layout.scale, std::max(0.75, std::min(width / 640.0, height / 400.0)));
        EXPECT_GE(layout.panel.width, (open ? 240 : 20) * std::min(layout.scale, 1.0));
        // The second camera's image lies inside the first one's, and that inside its area.
        const Letterbox box = FitImage(640, 480, layout.image);
        const Inset inset = PlaceInset(640, 480, 640, 480);
        const Eigen::Vector2d high =
            box.WindowFromImage({inset.x + inset.width - 0.5, inset.y + inset.height - 0.5});
        EXPECT_LE(high.x(), layout.panel.x);
        EXPECT_FALSE(layout.panel.Contains(high - Eigen::Vector2d(1, 1)));
      }
    }
  }
}

TEST(WindowLayout, KeepsTheWantedScaleWhereThereIsRoom) {
  EXPECT_EQ(LayOutWindow(3840, 2160, 2, true).scale, 2);
  EXPECT_EQ(LayOutWindow(640, 400, 1, true).scale, 1);
  EXPECT_EQ(LayOutWindow(640, 400, 3, true).scale, 1) << "a small window";
  EXPECT_EQ(LayOutWindow(100, 100, 1, true).scale, 0.75) << "still readable";
}

TEST(WindowLayout, PutsTheSmallMapBesideTheSecondCameraAndTheSentences) {
  for (const auto& [width, height] : {std::pair(300.0, 225.0), {640.0, 480.0}, {1920.0, 1440.0}}) {
    SCOPED_TRACE(width);
    const Area image{20, 10, width, height};
    const Area alone = PlaceSmallMap(image, {}, 1);
    EXPECT_LE(alone.right(), image.right());
    EXPECT_GE(alone.y, image.y);
    EXPECT_LE(alone.bottom(), image.y + 0.7 * height);
    const Area inset{20 + 0.7 * width, 12, 0.28 * width, 0.21 * height};
    const Area below = PlaceSmallMap(image, inset, 1);
    if (below.height == 0) continue;
    EXPECT_GE(below.y, inset.bottom());
    EXPECT_LE(below.bottom(), image.y + 0.7 * height);
  }
  EXPECT_EQ(PlaceSmallMap({0, 0, 100, 75}, {}, 1).height, 0) << "too small to be read";
}

TEST(MapSection, FindsMapsWhateverTheCase) {
  EXPECT_TRUE(MatchesFilter("Elephants", ""));
  EXPECT_TRUE(MatchesFilter("Elephants", "PHANT"));
  EXPECT_TRUE(MatchesFilter("Hall of Bones", "hall"));
  EXPECT_FALSE(MatchesFilter("Hall", "Halls"));
  EXPECT_FALSE(MatchesFilter("", "a"));
}

TEST(Letterbox, IsTheSameInAPartOfTheWindow) {
  const Letterbox box = FitImage(640, 480, Area{100, 50, 320, 300});
  EXPECT_EQ(box.x, 100);
  EXPECT_EQ(box.y, 50 + 30);
  EXPECT_EQ(box.scale, 0.5);
  const Eigen::Vector2d pixel(12.5, 47);
  EXPECT_LT((box.ImageFromWindow(box.WindowFromImage(pixel)) - pixel).norm(), 1e-12);
}

TEST(Theme, HasReadableTextsEverywhere) {
  EXPECT_GE(theme::TextPairs().size(), 10u);
  for (const theme::TextOnGround& pair : theme::TextPairs()) {
    EXPECT_EQ(pair.text.alpha, 1) << pair.where;
    EXPECT_EQ(pair.ground.alpha, 1) << pair.where;
    EXPECT_GE(theme::ContrastRatio(pair.text, pair.ground), pair.least_contrast) << pair.where;
  }
}

TEST(Theme, ComputesTheContrastOfTheStandard) {
  EXPECT_NEAR(theme::ContrastRatio({0, 0, 0, 1}, {1, 1, 1, 1}), 21, 1e-4);
  EXPECT_NEAR(theme::ContrastRatio({1, 1, 1, 1}, {1, 1, 1, 1}), 1, 1e-9);
  // #767676 is the lightest grey that passes on white.
  const float passes = 0x76 / 255.0f, fails = 0x77 / 255.0f;
  EXPECT_GE(theme::ContrastRatio({passes, passes, passes, 1}, {1, 1, 1, 1}), 4.5);
  EXPECT_LT(theme::ContrastRatio({fails, fails, fails, 1}, {1, 1, 1, 1}), 4.5);
}

TEST(MessageBoard, KeepsErrorsUntilTheyAreDismissed) {
  MessageBoard board;
  board.AddError("No surface.");
  board.AddError("The disk is full.");
  board.AddError("No surface.");
  board.AddError("");
  board.Expire(1e9);
  ASSERT_EQ(board.messages().size(), 2u);
  EXPECT_EQ(board.messages()[0].text, "No surface.");
  EXPECT_EQ(board.messages()[0].count, 2);
  board.Dismiss(board.messages()[0].id);
  ASSERT_EQ(board.messages().size(), 1u);
  EXPECT_EQ(board.messages()[0].text, "The disk is full.");
  for (int i = 0; i < 200; ++i) board.AddError("Error " + std::to_string(i));
  EXPECT_EQ(board.messages().size(), 50u);
  EXPECT_EQ(board.messages().back().text, "Error 199");
  board.DismissAll();
  EXPECT_TRUE(board.messages().empty());
}

TEST(MessageBoard, LetsWhatWasDoneGoAndOffersUndoForTheLastOnly) {
  MessageBoard board;
  board.AddError("No surface.");
  board.AddDone("Placed fox.", true, 10);
  board.AddDone("Moved fox.", true, 12);
  ASSERT_EQ(board.messages().size(), 2u);
  EXPECT_EQ(board.messages()[1].text, "Moved fox.");
  EXPECT_TRUE(board.messages()[1].offers_undo);
  board.Expire(19.9);
  EXPECT_EQ(board.messages().size(), 2u);
  board.Expire(20);
  ASSERT_EQ(board.messages().size(), 1u);
  EXPECT_EQ(board.messages()[0].kind, Message::Kind::kError);
  board.AddDone("Saved.", false, 30);
  board.Expire(34.9);
  EXPECT_EQ(board.messages().size(), 2u);
  board.Expire(35);
  EXPECT_EQ(board.messages().size(), 1u);
}

TEST(Selection, AddsTakesAwayAndForgetsWhatIsGone) {
  Selection selection;
  selection.Select("fox", false);
  selection.Select("sign-1", true);
  EXPECT_THAT(selection.names(), ElementsAre("fox", "sign-1"));
  selection.Select("fox", true);
  EXPECT_THAT(selection.names(), ElementsAre("sign-1"));
  selection.Select("owl", false);
  EXPECT_THAT(selection.names(), ElementsAre("owl"));
  selection.Rename("owl", "eagle");
  selection.Select("fox", true);
  content::Scene scene;
  scene.entities.resize(1);
  scene.entities[0].name = "eagle";
  selection.KeepExisting(&scene);
  EXPECT_THAT(selection.names(), ElementsAre("eagle"));
  selection.KeepExisting(nullptr);
  EXPECT_TRUE(selection.empty());
}

TEST(AuthoringPanel, SaysWhenTheLastSaveWas) {
  EXPECT_EQ(SavedText({}), "Nothing saved yet");
  EXPECT_EQ(SavedText(1.2), "Saved just now");
  EXPECT_EQ(SavedText(12.7), "Saved 12 s ago");
  EXPECT_EQ(SavedText(181), "Saved 3 min ago");
}

TEST(AuthoringPanel, SuggestsAnUnusedName) {
  EXPECT_EQ(FreeMapName({}), "Map 1");
  std::vector<MapFacts> maps(3);
  maps[0].name = "Map 1";
  maps[1].name = "Hall";
  maps[2].name = "Map 3";
  EXPECT_EQ(FreeMapName(maps), "Map 2");
}

TEST(EntityShapes, HaveTheBaseOfTheBoxWhereTheEntityStands) {
  content::Entity sign;
  sign.kind = content::Entity::Kind::kSignpost;
  sign.signpost.text = "Elephants";
  sign.signpost.anchor = {1, 2, 3};
  sign.signpost.height = 0.5;
  EntityShapes shapes;
  const auto box = shapes.BoxOf(sign, {0, 0, 0});
  ASSERT_TRUE(box);
  EXPECT_LT((box->Base() - sign.signpost.anchor).norm(), 1e-6);
  // The board is one unit high and stands on a pole: it reaches above its height, against the map's y.
  EXPECT_LT(box->Top().y(), 2 - 0.5);
  EXPECT_NEAR(box->Top().x(), 1, 1e-6);
  engine::Sim3 pose = TransformOf(sign, {0, 0, 0});
  EXPECT_EQ(pose.scale, 0.5);
  pose.translation = {4, 5, 6};
  pose.scale = 2;
  content::SetPose(pose, &sign);
  EXPECT_EQ(sign.signpost.anchor, Eigen::Vector3d(4, 5, 6));
  EXPECT_EQ(sign.signpost.height, 2);
}

}  // namespace
}  // namespace docent::ui
