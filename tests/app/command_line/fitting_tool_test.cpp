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

// A flat square of two metres at z = 1 before a wall at z = 2 that has many map points, both parallel to the
// image, so that where a click lands follows from its pixel.
class FittingBeforeAWall : public ::testing::Test {
 protected:
  static constexpr double kScale = 0.3;  // Map units on the wall for a metre of the square.

  FittingBeforeAWall() {
    view_.camera.lens = SimulatedCamera();
    auto map = std::make_shared<engine::MapSnapshot>();
    for (double y = -0.7; y < 0.7; y += 0.02) {
      for (double x = -0.7; x < 0.7; x += 0.02) {
        engine::MapPoint& point = map->points.emplace_back();
        point.id = static_cast<engine::MapPointId>(map->points.size());
        point.point_in_map << x, y, 2, 1;
      }
    }
    auto frame = std::make_shared<ShownFrame>();
    frame->tracked.state = engine::TrackingState::kSixDof;
    frame->tracked.map = std::move(map);
    view_.frame = std::move(frame);
    auto scene = std::make_shared<content::Scene>();
    scene->entities.push_back(Square());
    view_.scene = std::move(scene);
    tool_.Begin("square");
  }

  static content::Entity Square() {
    auto model = std::make_shared<content::Model>();
    content::Primitive primitive;
    for (const glm::vec2& corner : {glm::vec2(-1, -1), glm::vec2(1, -1), glm::vec2(1, 1), glm::vec2(-1, 1)})
      primitive.vertices.emplace_back().position = glm::vec3(corner, 0);
    primitive.indices = {0, 1, 2, 0, 2, 3};
    model->meshes.push_back({"square", {primitive}});
    model->nodes.emplace_back().mesh = 0;
    model->roots.push_back(0);
    model->bounds_min = glm::vec3(-1, -1, 0);
    model->bounds_max = glm::vec3(1, 1, 0);
    auto asset = std::make_shared<content::Asset>();
    asset->model = std::move(model);
    content::Entity entity;
    entity.name = "square";
    entity.kind = content::Entity::Kind::kModel;
    entity.model.asset = std::move(asset);
    entity.model.map_from_model = {engine::Rotation3(), {0, 0, 1}, kSquareScale};
    return entity;
  }
  // Clicks a point of the square, and then the place on the wall of the same point, moved by `offset` metres.
  void Pair(const Eigen::Vector2d& point, const Eigen::Vector2d& offset) {
    const auto pixel = [&](const Eigen::Vector2d& at, double z) {
      return *view_.camera.lens.Project({at.x(), at.y(), z});
    };
    ASSERT_EQ(tool_.Click(view_, pixel(kSquareScale * point, 1)), "");
    ASSERT_EQ(tool_.Click(view_, pixel(kScale * (point + offset), 2)), "");
  }

  static constexpr double kSquareScale = 0.2;
  AuthorView view_;
  ui::EntityShapes shapes_;
  FittingTool tool_{&shapes_};
};

TEST_F(FittingBeforeAWall, GivesTheDistanceByWhichEachPairIsOff) {
  for (const Eigen::Vector2d& corner :
       {Eigen::Vector2d(0.8, 0.8), Eigen::Vector2d(-0.8, 0.8), Eigen::Vector2d(-0.8, -0.8)})
    Pair(corner, {0, 0});
  ui::FitFacts facts = *tool_.Facts(view_.scene.get());
  ASSERT_EQ(facts.residuals.size(), 3u) << facts.problem;
  for (const double residual : facts.residuals) EXPECT_LT(residual, 1e-5);
  // Moved in turn to the left and to the right, the corners fit no similarity better than the one they had:
  // the offsets have no part that is a translation, rotation or change of size.
  tool_.End();
  tool_.Begin("square");
  Pair({0.8, 0.8}, {0.1, 0});
  Pair({-0.8, 0.8}, {-0.1, 0});
  Pair({-0.8, -0.8}, {0.1, 0});
  Pair({0.8, -0.8}, {-0.1, 0});
  facts = *tool_.Facts(view_.scene.get());
  EXPECT_EQ(facts.name, "square");
  EXPECT_EQ(facts.pairs, 4u);
  ASSERT_EQ(facts.residuals.size(), 4u) << facts.problem;
  for (const double residual : facts.residuals) EXPECT_NEAR(residual, 0.1 * kScale, 1e-5);
  EXPECT_EQ(facts.used, std::vector<bool>(4, true));
  EXPECT_EQ(facts.problem, "");
}

TEST_F(FittingBeforeAWall, SaysWhyPairsOnALineHaveNoResiduals) {
  EXPECT_TRUE(tool_.Facts(view_.scene.get())->residuals.empty()) << "no pair yet";
  for (const double along : {-0.8, 0.0, 0.8}) Pair({along, 0.5 * along}, {0, 0});
  const ui::FitFacts facts = *tool_.Facts(view_.scene.get());
  EXPECT_EQ(facts.pairs, 3u);
  EXPECT_TRUE(facts.residuals.empty());
  EXPECT_THAT(facts.problem, HasSubstr("line"));
}

}  // namespace
}  // namespace docent::app
