// SPDX-License-Identifier: Apache-2.0
// Clicks on a model and on the room, in a view of the simulated museum.
#include "app/command_line/fitting_tool.h"

#include <gmock/gmock.h>

#include "app/demo/exhibit_model.h"
#include "app/session/surface_at_pixel.h"
#include "content/warp.h"
#include "tests/app/support/simulated_session.h"
#include "tests/app/support/temporary_folder.h"

namespace docent::app {
namespace {

using ::testing::HasSubstr;

class FittingByPoints : public ::testing::Test {
 protected:
  static constexpr const char* kName = "exhibit";
  const Eigen::Vector2d base_{320, 290};  // Of the model in the image.

  FittingByPoints() {
    const std::vector<std::uint8_t> glb = MakeExhibitGlb();
    folder_.Write("exhibit.glb", {glb.begin(), glb.end()});
    const auto simulation = simulated_session::Room(2.5);
    session_.emplace(simulated_session::Options(Pace::kLockstep, "Bay"),
                     simulated_session::LensOf(*simulation), nullptr);
    const simulated_session::Seen seen = simulated_session::Feed(
        simulation, Pace::kLockstep, &*session_,
        {{FromSeconds(2), 1, PlaceModel{"exhibit.glb", base_, std::nullopt, 0}}}, folder_.path());
    auto frame = std::make_shared<ShownFrame>();
    frame->tracked = seen.frames.back();
    frame->shown = session_->ShownWith(frame->tracked);
    view_.camera.lens = *simulated_session::LensOf(*simulation).front();
    view_.camera.camera_from_map = frame->tracked.camera_from_map;
    view_.scene = frame->shown.scene;
    view_.frame = std::move(frame);
  }

  const content::Entity& Exhibit() const { return *view_.scene->Find(kName); }
  Eigen::Vector2d PixelOf(const Eigen::Vector3d& in_map) const {
    return *view_.camera.lens.Project(view_.camera.camera_from_map * in_map);
  }
  Eigen::Vector3d Drawn(const Eigen::Vector3d& in_model) const {
    const content::PlacedModel& model = Exhibit().model;
    return model.map_from_model * (model.warp ? (*model.warp)(in_model) : in_model);
  }
  // Pixels where the model is seen, a few pixels apart.
  std::vector<Eigen::Vector2d> PixelsOfModel() {
    std::vector<Eigen::Vector2d> pixels;
    for (double y = base_.y() - 60; y < base_.y() + 30; y += 9) {
      for (double x = base_.x() - 45; x < base_.x() + 45; x += 9) {
        FittingTool probe(&shapes_);
        probe.Begin(kName);
        if (probe.Click(view_, {x, y}).empty()) pixels.emplace_back(x, y);
      }
    }
    return pixels;
  }

  const TemporaryFolder folder_;
  std::optional<Session> session_;
  AuthorView view_;
  ui::EntityShapes shapes_;
  FittingTool tool_{&shapes_};
};

TEST_F(FittingByPoints, PairsThePointOfTheModelWithThePlaceInTheRoom) {
  ASSERT_NE(view_.scene->Find(kName), nullptr);
  ASSERT_TRUE(view_.has_pose());
  const std::vector<Eigen::Vector2d> on_model = PixelsOfModel();
  ASSERT_GE(on_model.size(), 6u);
  tool_.Begin(kName);
  const std::vector<Eigen::Vector2d> places = {{200, 300}, {420, 310}, {330, 360}};
  for (std::size_t i = 0; i < places.size(); ++i) {
    EXPECT_FALSE(tool_.Facts(view_.scene.get())->waits_for_place);
    ASSERT_EQ(tool_.Click(view_, on_model[i * on_model.size() / 3]), "");
    EXPECT_TRUE(tool_.Facts(view_.scene.get())->waits_for_place);
    ASSERT_EQ(tool_.Click(view_, places[i]), "");
  }
  const AlignEntity command = tool_.AlignCommand();
  EXPECT_EQ(command.name, kName);
  ASSERT_EQ(command.pairs.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_LT((PixelOf(Drawn(command.pairs[i].in_model)) - on_model[i * on_model.size() / 3]).norm(), 0.05);
    EXPECT_LT((PixelOf(command.pairs[i].in_map) - places[i]).norm(), 0.05);
    EXPECT_FALSE(command.pairs[i].pixel.has_value()) << "the next frame shows other things at this pixel";
  }
}

TEST_F(FittingByPoints, GivesResidualsOrSaysWhyThereAreNone) {
  const std::vector<Eigen::Vector2d> on_model = PixelsOfModel();
  tool_.Begin(kName);
  const content::Entity& exhibit = Exhibit();
  EXPECT_TRUE(tool_.Facts(view_.scene.get())->residuals.empty());
  for (const std::size_t i : {std::size_t{0}, on_model.size() / 2, on_model.size() - 1}) {
    ASSERT_EQ(tool_.Click(view_, on_model[i]), "");
    ASSERT_EQ(tool_.Click(view_, base_ + Eigen::Vector2d(80, 0) + 1.5 * (on_model[i] - base_)), "");
  }
  const std::optional<ui::FitFacts> facts = tool_.Facts(view_.scene.get());
  ASSERT_TRUE(facts.has_value());
  EXPECT_EQ(facts->pairs, 3u);
  // Three pairs fit a similarity nearly, or are refused with a sentence; in no case without a word.
  EXPECT_EQ(facts->residuals.empty(), !facts->problem.empty());
  EXPECT_EQ(facts->name, exhibit.name);
}

TEST_F(FittingByPoints, FindsTheOriginalPointOfABentModel) {
  std::vector<content::Correspondence> pairs;
  const engine::Sim3 pose = Exhibit().model.map_from_model;
  for (const Eigen::Vector3d& corner :
       {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, 1, 0),
        Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(1, 1, 1)}) {
    pairs.push_back(
        {corner, pose * Eigen::Vector3d(corner + 0.15 * corner.cross(Eigen::Vector3d(0, 1, 0.5)))});
  }
  auto scene = std::make_shared<content::Scene>(*view_.scene);
  content::EditHistory history;
  history.Do(content::BendEdit(*scene, kName, pairs), scene.get());
  view_.scene = scene;
  const std::vector<Eigen::Vector2d> on_model = PixelsOfModel();
  ASSERT_GE(on_model.size(), 5u);
  for (const Eigen::Vector2d& pixel : on_model) {
    tool_.Begin(kName);
    ASSERT_EQ(tool_.Click(view_, pixel), "");
    ASSERT_EQ(tool_.Click(view_, {200, 300}), "");
    EXPECT_LT((PixelOf(Drawn(tool_.AlignCommand().pairs[0].in_model)) - pixel).norm(), 0.05);
  }
}

TEST_F(FittingByPoints, SaysWhatIsNotOnTheModel) {
  tool_.Begin(kName);
  EXPECT_THAT(tool_.Click(view_, {30, 30}), HasSubstr("not on the object"));
  EXPECT_FALSE(tool_.Facts(view_.scene.get())->waits_for_place);
}

TEST_F(FittingByPoints, TakesTheLastPointBackAndEndsWithTheModel) {
  const std::vector<Eigen::Vector2d> on_model = PixelsOfModel();
  tool_.Begin(kName);
  ASSERT_EQ(tool_.Click(view_, on_model.front()), "");
  ASSERT_EQ(tool_.Click(view_, {200, 300}), "");
  ASSERT_EQ(tool_.Click(view_, on_model.back()), "");
  tool_.RemoveLast();
  EXPECT_FALSE(tool_.Facts(view_.scene.get())->waits_for_place);
  EXPECT_EQ(tool_.Facts(view_.scene.get())->pairs, 1u);
  tool_.RemoveLast();
  EXPECT_EQ(tool_.Facts(view_.scene.get())->pairs, 0u);
  tool_.KeepExisting(view_.scene.get());
  EXPECT_TRUE(tool_.is_active());
  const content::Scene empty;
  tool_.KeepExisting(&empty);
  EXPECT_FALSE(tool_.is_active());
  EXPECT_FALSE(tool_.Facts(view_.scene.get()).has_value());
}

}  // namespace
}  // namespace docent::app
