// SPDX-License-Identifier: Apache-2.0
// Clicks and keys at two boxes before the camera.
#include "app/command_line/pointer_tool.h"

#include <gmock/gmock.h>

#include "tests/ui/asked_for.h"

namespace docent::app {
namespace {

using ::testing::ElementsAre;

class PointerAtBoxes : public ::testing::Test {
 protected:
  // Carries out what is selected, and keeps the last poses that were asked for.
  struct Actions : ui::AskedFor {
    explicit Actions(ui::Selection* selected) : selection(selected) {}
    void Select(const std::string& name, bool add) override { selection->Select(name, add); }
    void Transform(const std::vector<ui::NewPose>& asked) override { poses = asked; }
    ui::Selection* const selection;
    std::vector<ui::NewPose> poses;
  };

  PointerAtBoxes() {
    auto frame = std::make_shared<ShownFrame>();
    frame->tracked.state = engine::TrackingState::kSixDof;
    frame->tracked.map_key = 1;
    frame->tracked.map = std::make_shared<engine::MapSnapshot>();
    view_.frame = std::move(frame);
    view_.camera.lens =
        engine::CameraModel(engine::LensModel::kRadialTangential, {640, 480, 500, 500, 320, 240}, {});
    view_.image = {0, 0, 640, 480};
    view_.box = ui::FitImage(640, 480, view_.image);
    ShowScene();
  }
  // Anew, as after a change.
  void ShowScene() {
    content::Scene scene;
    scene.settings.up = Eigen::Vector3d(0, -1, 0);
    for (const auto& [name, x] : {std::pair("left", -1.0), std::pair("right", 1.0)}) {
      content::Entity box;
      box.name = name;
      box.kind = content::Entity::Kind::kOccluder;
      box.occluder.map_from_shape.translation = {x, -0.5, 5};
      scene.entities.push_back(box);
    }
    view_.scene = std::make_shared<const content::Scene>(std::move(scene));
  }

  const Eigen::Vector2d left_{220, 205};  // A point of that box; its ray meets the level plane of the box.
  AuthorView view_;
  ui::Selection selection_;
  ui::EntityShapes shapes_;
  Actions actions_{&selection_};
  PointerTool tool_{&selection_, &shapes_, &actions_};
};

TEST_F(PointerAtBoxes, AClickOnOneOfSeveralSelectsItAlone) {
  selection_.Set({"left", "right"});
  tool_.Press(view_, left_, false);
  EXPECT_THAT(selection_.names(), ElementsAre("left", "right")) << "they may be dragged together";
  tool_.Release();
  EXPECT_THAT(selection_.names(), ElementsAre("left"));
}

TEST_F(PointerAtBoxes, SeveralAreDraggedTogetherAndStaySelected) {
  selection_.Set({"left", "right"});
  tool_.Press(view_, left_, false);
  tool_.Move(view_, left_ + Eigen::Vector2d(20, 0), false);
  tool_.Release();
  EXPECT_EQ(actions_.poses.size(), 2u);
  EXPECT_THAT(selection_.names(), ElementsAre("left", "right"));
}

TEST_F(PointerAtBoxes, AClickSelectsTheLabelThatIsDrawnThere) {
  content::Scene scene = *view_.scene;
  for (const char* name : {"first", "second", "far"}) {
    content::Entity label;
    label.name = name;
    label.kind = content::Entity::Kind::kLabel;
    label.label.text = "Lion";
    label.label.anchor = {0, -0.5, 5};
    label.label.text_height = 0.2;
    scene.entities.push_back(label);
  }
  view_.scene = std::make_shared<const content::Scene>(scene);
  // The boards of the first two are moved apart.
  const auto rows = [](double top, double bottom) {
    return Eigen::AlignedBox2d(Eigen::Vector2d(300, top), Eigen::Vector2d(340, bottom));
  };
  const std::vector<ui::LabelArea> labels = {
      {"far", rows(182, 198)}, {"first", rows(100, 120)}, {"second", rows(118, 138)}};
  view_.labels = &labels;
  const auto press = [&](double y) {
    selection_.Clear();
    tool_.Press(view_, {320, y}, false);
    tool_.Release();
    return selection_.names();
  };
  EXPECT_THAT(press(110), ElementsAre("first"));
  EXPECT_THAT(press(130), ElementsAre("second"));
  EXPECT_THAT(press(119.5), ElementsAre("second")) << "it is drawn over the first one";
  EXPECT_THAT(press(190), ElementsAre("far"));
  EXPECT_THAT(press(175), ElementsAre()) << "where boards would be that are not drawn there";
  scene.entities.back().hidden = true;
  view_.scene = std::make_shared<const content::Scene>(scene);
  EXPECT_THAT(press(190), ElementsAre());
}

TEST_F(PointerAtBoxes, StepsAddUpUntilTheSceneShowsThem) {
  selection_.Set({"left"});
  const double step = 0.01 * Eigen::Vector3d(-1, -0.5, 5).norm();
  for (const int steps : {1, 2}) {
    tool_.Nudge(view_, 1, 0);
    ASSERT_EQ(actions_.poses.size(), 1u);
    EXPECT_NEAR(actions_.poses[0].map_from_entity.translation.x(), -1 + steps * step, 1e-9);
  }
  tool_.ForgetSteps();
  tool_.Nudge(view_, 1, 0);
  EXPECT_NEAR(actions_.poses[0].map_from_entity.translation.x(), -1 + step, 1e-9);
  ShowScene();
  tool_.Nudge(view_, 1, 0);
  EXPECT_NEAR(actions_.poses[0].map_from_entity.translation.x(), -1 + step, 1e-9);
}

TEST_F(PointerAtBoxes, StepsLeaveOutWhatIsLocked) {
  content::Scene scene = *view_.scene;
  scene.entities[1].locked = true;
  view_.scene = std::make_shared<const content::Scene>(std::move(scene));
  selection_.Set({"left", "right"});
  tool_.Nudge(view_, 1, 0);
  ASSERT_EQ(actions_.poses.size(), 1u);
  EXPECT_EQ(actions_.poses[0].name, "left");
  selection_.Set({"right"});
  tool_.Nudge(view_, 1, 0);
  ASSERT_EQ(actions_.poses.size(), 1u);
  EXPECT_EQ(actions_.poses[0].name, "right") << "the refusal says that it is locked";
}

}  // namespace
}  // namespace docent::app
