// SPDX-License-Identifier: Apache-2.0
// The direction of a signpost: how it is stored, moved and changed.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "content/edits.h"
#include "content/history_codec.h"
#include "content/scene_codec.h"
#include "engine/base/random.h"
#include "tests/content/edit_samples.h"
#include "tests/support/error_of.h"

namespace docent::content {
namespace {

using ::testing::HasSubstr;

const Eigen::Vector3d kLeftAndUp = Eigen::Vector3d(-2, -1, 0.25).normalized();

Scene SignpostScene(const std::optional<Eigen::Vector3d>& direction) {
  Scene scene;
  scene.entities = {SignEntity("sign-1"), ModelEntity("helmet")};
  scene.entities[0].signpost.direction = direction;
  return scene;
}

AssetLookup EveryAsset() {
  return [](const std::string& id) { return AssetNamed(id); };
}

const std::optional<Eigen::Vector3d>& DirectionOf(const Scene& scene) {
  return scene.entities.at(0).signpost.direction;
}

TEST(SignpostDirection, IsReadBackToTheSameBits) {
  const Scene scene = SignpostScene(kLeftAndUp);
  const Scene read = DecodeScene(EncodeScene(scene), "the library", EveryAsset());
  EXPECT_EQ(DirectionOf(read), kLeftAndUp);
  EXPECT_EQ(DirectionOf(DecodeScene(EncodeScene(SignpostScene(std::nullopt)), "the library", EveryAsset())),
            std::nullopt);
}

TEST(SignpostDirection, IsNotKnownInScenesOfTheThirdVersion) {
  nlohmann::json old = nlohmann::json::parse(EncodeScene(SignpostScene(std::nullopt)));
  old["docent_scene"] = 3;
  EXPECT_EQ(DirectionOf(DecodeScene(old.dump(), "the library", EveryAsset())), std::nullopt);
  old = nlohmann::json::parse(EncodeScene(SignpostScene(kLeftAndUp)));
  EXPECT_EQ(old["docent_scene"], kSceneVersion);
  old["docent_scene"] = 3;
  EXPECT_THAT(ErrorOf([&] { DecodeScene(old.dump(), "the library", EveryAsset()); }),
              HasSubstr("'direction'"));
}

TEST(SignpostDirection, ThatIsNoUnitVectorIsRefusedByWriterAndReader) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  for (const Eigen::Vector3d& wrong :
       {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(0, 0, 1.5), Eigen::Vector3d(kNan, 0, 1)}) {
    EXPECT_THAT(Validate(SignpostScene(wrong)), HasSubstr("without a valid direction"));
    EXPECT_THROW(EncodeScene(SignpostScene(wrong)), Error);
  }
  const nlohmann::json good = nlohmann::json::parse(EncodeScene(SignpostScene(kLeftAndUp)));
  for (const nlohmann::json& wrong : {nlohmann::json{0, 0, 0}, nlohmann::json{0, 0, 2}, nlohmann::json{0, 1},
                                      nlohmann::json("up"), nlohmann::json(), nlohmann::json{0, 0.9995, 0}}) {
    nlohmann::json changed = good;
    changed["entities"][0]["direction"] = wrong;
    EXPECT_NE(ErrorOf([&] { DecodeScene(changed.dump(), "the library", EveryAsset()); }), "") << wrong;
  }
}

TEST(SignpostDirection, RotatesWithTheMap) {
  Random random(5);
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector3d turn(random.Uniform(-2, 2), random.Uniform(-2, 2), random.Uniform(-2, 2));
    const engine::Sim3 motion{engine::Rotation3::Exp(turn), {1, random.Uniform(-5, 5), 3}, 2.5};
    Entity sign = SignpostScene(kLeftAndUp).entities[0];
    const Eigen::Vector3d ahead = BoardMiddle(sign.signpost) + kLeftAndUp;
    MoveWithAnchor(motion, &sign);
    // A point in front of the board is in front of it afterwards.
    const Eigen::Vector3d moved = motion * ahead - BoardMiddle(sign.signpost);
    EXPECT_LT((moved.normalized() - *sign.signpost.direction).norm(), 1e-12);
    EXPECT_EQ(PoseProblem(sign), "");
  }
}

TEST(SignpostDirection, IsSetByAnEditThatCanBeUndone) {
  Scene scene = SignpostScene(std::nullopt);
  EditHistory history;
  history.Do(DirectionEdit(scene, "sign-1", Eigen::Vector3d(0, 0, 1e5)), &scene);
  EXPECT_EQ(DirectionOf(scene), Eigen::Vector3d(0, 0, 1));
  history.Do(DirectionEdit(scene, "sign-1", std::nullopt), &scene);
  EXPECT_EQ(DirectionOf(scene), std::nullopt);
  EditHistory stored = DecodeHistory(EncodeHistory(history, 1 << 20), "the history", EveryAsset());
  ASSERT_TRUE(stored.Undo(&scene));
  EXPECT_EQ(DirectionOf(scene), Eigen::Vector3d(0, 0, 1));
  ASSERT_TRUE(stored.Undo(&scene));
  EXPECT_EQ(DirectionOf(scene), std::nullopt);
}

TEST(SignpostDirection, IsRefusedForWhatHasNone) {
  const Scene scene = SignpostScene(std::nullopt);
  const auto refusal = [&](const char* name, const Eigen::Vector3d& direction) {
    return ErrorOf([&] { DirectionEdit(scene, name, direction); });
  };
  EXPECT_EQ(refusal("helmet", {0, 0, 1}), "'helmet' is a model, which has no arrow.");
  EXPECT_THAT(refusal("sign-2", {0, 0, 1}), HasSubstr("no 'sign-2'"));
  EXPECT_THAT(refusal("sign-1", {0, 0, 0}), HasSubstr("direction without length"));
  EXPECT_THAT(refusal("sign-1", {std::numeric_limits<double>::infinity(), 0, 0}),
              HasSubstr("direction without length"));
}

TEST(SignpostDirection, IsForgottenWithTheMapThatItLeadsTo) {
  Scene scene = SignpostScene(kLeftAndUp);
  ApplyChange(TargetEdit(scene, "sign-1", "Desk 3 under a new name", 7), &scene);
  EXPECT_EQ(DirectionOf(scene), kLeftAndUp) << "the same map";
  ApplyChange(TargetEdit(scene, "sign-1", "Desk 4", 8), &scene);
  EXPECT_EQ(DirectionOf(scene), std::nullopt);
  scene = SignpostScene(kLeftAndUp);
  ApplyChange(TargetEdit(scene, "sign-1", "", 0), &scene);
  EXPECT_EQ(DirectionOf(scene), std::nullopt);
  Signpost sign = SignEntity("sign-1").signpost;
  sign.direction = kLeftAndUp;
  LeadNowhere(&sign);
  EXPECT_EQ(sign.to_key, 0u);
  EXPECT_EQ(sign.to_map, "");
  EXPECT_EQ(sign.direction, std::nullopt);
}

}  // namespace
}  // namespace docent::content
