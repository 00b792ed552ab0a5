// SPDX-License-Identifier: Apache-2.0
#include "app/sound/sound_director.h"

#include <gtest/gtest.h>

namespace docent::app {
namespace {

content::Entity SoundAt(const std::string& name, const Eigen::Vector3d& position, double range,
                        double seconds) {
  auto asset = std::make_shared<content::Asset>();
  asset->id = name;
  asset->kind = content::AssetKind::kSound;
  asset->seconds = seconds;
  content::Entity entity;
  entity.name = name;
  entity.kind = content::Entity::Kind::kSound;
  entity.sound.asset = asset;
  entity.sound.caption = "caption of " + name;
  entity.sound.translations = {{"de", "Text zu " + name}};
  entity.sound.position = position;
  entity.sound.range = range;
  return entity;
}

// One sound of ten seconds at the origin of map 1 with a range of 2.
struct OneSound {
  content::Scene scene{{SoundAt("roar", Eigen::Vector3d::Zero(), 2, 10)}};
  SoundDirector director{""};
  SoundDirector::Orders At(double seconds, double distance) {
    return director.Update(seconds, 1, scene, Eigen::Vector3d(0, distance, 0));
  }
};

TEST(SoundDirector, StartsASoundWhereItsRangeBegins) {
  OneSound one;
  EXPECT_TRUE(one.At(0, 2.01).start.empty());
  const auto orders = one.At(1, 1.99);
  ASSERT_EQ(orders.start.size(), 1u);
  EXPECT_EQ(orders.start[0].first, SoundDirector::Key(1, "roar"));
  EXPECT_EQ(orders.start[0].second, one.scene.entities[0].sound.asset);
  EXPECT_EQ(orders.caption, "caption of roar");
  EXPECT_TRUE(one.At(2, 0.5).start.empty()) << "it plays already";
}

TEST(SoundDirector, ACameraAtTheBorderDoesNotStartItAgain) {
  OneSound one;
  EXPECT_EQ(one.At(0, 1.99).start.size(), 1u);
  for (int i = 1; i < 20; ++i) {
    const auto orders = one.At(i, i % 2 == 0 ? 1.9 : 2.35);
    EXPECT_TRUE(orders.start.empty() && orders.stop.empty()) << i;
  }
  EXPECT_EQ(one.At(20, 2.41).stop, std::vector<SoundDirector::Key>{SoundDirector::Key(1, "roar")});
  EXPECT_TRUE(one.At(21, 2.3).start.empty());
  EXPECT_EQ(one.At(22, 1.9).start.size(), 1u) << "after it has come back";
}

TEST(SoundDirector, ShowsTheCaptionAsLongAsTheSoundLasts) {
  OneSound one;
  one.At(0, 1);
  EXPECT_EQ(one.At(9.9, 1).caption, "caption of roar");
  EXPECT_EQ(one.At(10, 1).caption, "");
  OneSound brief;
  brief.scene.entities[0] = SoundAt("click", Eigen::Vector3d::Zero(), 2, 0.1);
  brief.At(0, 1);
  EXPECT_EQ(brief.At(2.9, 1).caption, "caption of click") << "long enough to be read";
  EXPECT_EQ(brief.At(3, 1).caption, "");
}

TEST(SoundDirector, ALostCameraChangesNothing) {
  OneSound one;
  one.At(0, 1);
  const auto orders = one.director.Update(1, 0, {}, std::nullopt);
  EXPECT_TRUE(orders.start.empty() && orders.stop.empty());
  EXPECT_EQ(orders.caption, "caption of roar");
  EXPECT_TRUE(one.At(2, 1).start.empty());
}

TEST(SoundDirector, PlaysWhatAVisitorAsksForToItsEndWhereverTheCameraIs) {
  OneSound one;
  EXPECT_TRUE(one.At(0, 9).start.empty());
  one.director.Ask(1, "roar");
  EXPECT_TRUE(one.director.Update(0.5, 0, {}, std::nullopt).start.empty()) << "the camera is lost";
  EXPECT_EQ(one.At(1, 9).start.size(), 1u);
  EXPECT_EQ(one.At(10.9, 9).caption, "caption of roar");
  const auto ended = one.At(11, 9);
  EXPECT_EQ(ended.stop.size(), 1u);
  EXPECT_EQ(ended.caption, "");
  EXPECT_TRUE(one.At(12, 9).start.empty());
}

TEST(SoundDirector, BeginsAnewWhatPlaysWhenAVisitorAsksForIt) {
  OneSound one;
  one.At(0, 1);
  one.director.Ask(1, "roar");
  const auto orders = one.At(5, 1);
  EXPECT_EQ(orders.stop.size(), 1u);
  EXPECT_EQ(orders.start.size(), 1u);
  EXPECT_EQ(one.At(14.9, 1).caption, "caption of roar") << "ten seconds from now";
  EXPECT_EQ(one.At(15, 1).caption, "");
}

TEST(SoundDirector, StopsWhatIsRemovedHiddenOrInAnotherMap) {
  for (const int way : {0, 1, 2}) {
    OneSound one;
    one.At(0, 1);
    if (way == 0) one.scene.entities.clear();
    if (way == 1) one.scene.entities[0].hidden = true;
    const auto orders = one.director.Update(1, way == 2 ? 7 : 1, way == 2 ? content::Scene{} : one.scene,
                                            Eigen::Vector3d::Zero());
    EXPECT_EQ(orders.stop.size(), 1u) << way;
    EXPECT_EQ(orders.caption, "") << way;
  }
}

TEST(SoundDirector, EverythingBeginsAnewForTheNextVisitor) {
  OneSound one;
  const SoundDirector::Key roar(1, "roar");
  EXPECT_EQ(one.At(0, 1).start.size(), 1u);
  EXPECT_TRUE(one.At(20, 1).start.empty()) << "the visitor has heard it";
  one.director.Ask(1, "roar");
  one.director.BeginAnew();
  // The camera is lost, because the device lies on a table.
  const auto lost = one.director.Update(21, 0, {}, std::nullopt);
  EXPECT_EQ(lost.stop, std::vector<SoundDirector::Key>{roar});
  EXPECT_EQ(lost.caption, "");
  EXPECT_TRUE(one.At(22, 3).start.empty()) << "what the visitor before has asked for";
  EXPECT_EQ(one.At(23, 1).start.size(), 1u);
  one.director.BeginAnew();
  const auto again = one.At(24, 1);
  EXPECT_EQ(again.stop, std::vector<SoundDirector::Key>{roar});
  ASSERT_EQ(again.start.size(), 1u) << "for a visitor who begins where the sound is";
  EXPECT_EQ(again.start[0].first, roar);
}

TEST(SoundDirector, CaptionsAreInTheReadersLanguage) {
  content::Scene scene{{SoundAt("roar", Eigen::Vector3d::Zero(), 2, 10), SoundAt("bell", {1, 0, 0}, 2, 10)}};
  SoundDirector director("de-at");
  EXPECT_EQ(director.Update(0, 1, scene, Eigen::Vector3d::Zero()).caption, "Text zu bell\nText zu roar");
}

}  // namespace
}  // namespace docent::app
