// SPDX-License-Identifier: Apache-2.0
// Carries out every command on content in a session in which the camera has a pose.
#include <gmock/gmock.h>

#include <algorithm>
#include <functional>

#include "app/demo/exhibit_model.h"
#include "app/script/format_command.h"
#include "app/session/entrance_view.h"
#include "content/placement.h"
#include "content/scene_codec.h"
#include "content/warp.h"
#include "engine/map/upright_axes.h"
#include "tests/app/support/simulated_session.h"
#include "tests/app/support/temporary_folder.h"

namespace docent::app {
namespace {

using namespace simulated_session;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const Eigen::Vector2d kPixel(320, 290);

// A session in lockstep that builds the map "Bay" in a library, up to a frame in which content can be placed.
class ContentInASession : public ::testing::Test {
 protected:
  ContentInASession() {
    const std::vector<std::uint8_t> glb = MakeExhibitGlb();
    folder_.Write("exhibit.glb", {glb.begin(), glb.end()});
  }

  // Runs the session, calls `act` once with a frame that has a pose, and saves everything.
  void Run(const std::function<void()>& act) {
    const auto simulation = Room(2.5);
    session_.emplace(Options(Pace::kLockstep, "Bay"), LensOf(*simulation), &library_);
    CalibratedCamera camera = CameraOf(simulation);
    FrameLoopOptions loop;
    loop.pace = Pace::kLockstep;
    RunFrames(
        &camera, &*session_, loop,
        [&](const engine::TrackedFrame& frame) {
          if (acted_ || !engine::HasPose(frame.state) || !frame.map || frame.frame.time < FromSeconds(2))
            return;
          frame_ = frame;
          acted_ = true;
          act();
        },
        {});
    session_->Finish();
    EXPECT_TRUE(acted_);
    EXPECT_THAT(library_.Verify(), IsEmpty());
  }

  std::string Do(const Command& command) {
    return ErrorOf([&] { session_->Execute(command, frame_, folder_.path()); });
  }
  const content::Scene& Scene() {
    scene_ = session_->ShownWith(frame_).scene;
    return *scene_;
  }
  const content::Entity& Named(const std::string& name) {
    const content::Entity* const found = Scene().Find(name);
    if (found == nullptr) throw Error("no " + name);
    return *found;
  }

  const TemporaryFolder folder_;
  maps::Library library_ =
      maps::Library::Open(folder_ / "l.docent", maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
  std::optional<Session> session_;
  engine::TrackedFrame frame_;
  std::shared_ptr<const content::Scene> scene_;
  bool acted_ = false;
};

TEST_F(ContentInASession, AModelStandsWithItsBaseOnTheSurfaceAndFacesTheViewer) {
  Run([&] {
    ASSERT_EQ(Do(PlaceModel{"exhibit.glb", kPixel}), "");
    const content::Entity& model = Named("exhibit");
    const Eigen::Vector3d base = content::BaseInMap(model);
    const Eigen::Vector3d viewer = frame_.camera_from_map.OriginInSource();
    const auto seen = LensOf(*Room(0.1))[0]->Project(frame_.camera_from_map * base);
    ASSERT_TRUE(seen.has_value());
    EXPECT_LT((*seen - kPixel).norm(), 0.01) << "the base is where the pixel shows the surface";
    const content::Model& shape = *model.model.asset->model;
    const glm::vec3 extent = shape.bounds_max - shape.bounds_min;
    EXPECT_NEAR(
        static_cast<double>(std::max({extent.x, extent.y, extent.z})) * model.model.map_from_model.scale,
        0.2 * (viewer - base).norm(), 1e-6);
    const engine::Rotation3& rotation = model.model.map_from_model.rotation;
    const Eigen::Vector3d up = engine::UpInMap(*frame_.map);
    EXPECT_LT((rotation * Eigen::Vector3d::UnitY() - up).norm(), 1e-9);
    const Eigen::Vector3d level = (viewer - base) - up * up.dot(viewer - base);
    EXPECT_GT((rotation * Eigen::Vector3d::UnitZ()).dot(level.normalized()), 1 - 1e-9);
    ASSERT_EQ(Do(PlaceModel{"exhibit.glb", kPixel, 0.125, 90}), "");
    EXPECT_EQ(Named("exhibit-2").model.map_from_model.scale, 0.125);
    EXPECT_NEAR((Named("exhibit-2").model.map_from_model.rotation * Eigen::Vector3d::UnitZ()).dot(level), 0,
                1e-9);
    // Moving to a pixel puts the base there as well.
    const Eigen::Vector2d other(280, 300);
    ASSERT_EQ(Do(MoveEntity{"exhibit", {0, 0, 0}, other}), "");
    EXPECT_LT(
        (*LensOf(*Room(0.1))[0]->Project(frame_.camera_from_map * content::BaseInMap(Named("exhibit"))) -
         other)
            .norm(),
        0.01);
  });
}

// As with a view that was frozen before the map was adjusted.
TEST_F(ContentInASession, APixelOfAnOldFrameIsThePlaceThatItsPointsHaveMovedTo) {
  Run([&] {
    ASSERT_EQ(Do(PlaceSignpost{"now", kPixel, ""}), "");
    const Eigen::Vector3d now = Named("sign-1").signpost.anchor;
    const double distance = (frame_.camera_from_map * now).norm();
    const engine::Sim3 now_from_before{engine::Rotation3::Exp({0.02, -0.03, 0.01}), {0.2, -0.1, 0.3}, 1.1};
    auto before = std::make_shared<engine::MapSnapshot>(*frame_.map);
    for (engine::MapPoint& point : before->points) {
      if (!point.infinite()) point.point_in_map.head<3>() = now_from_before.inverse() * point.position();
    }
    const Eigen::Vector3d eye = now_from_before.inverse() * frame_.camera_from_map.OriginInSource();
    const engine::Rotation3 rotation = frame_.camera_from_map.rotation * now_from_before.rotation;
    frame_.camera_from_map = {rotation, -(rotation * eye)};
    frame_.map = std::move(before);
    ASSERT_EQ(Do(PlaceSignpost{"before", kPixel, ""}), "");
    EXPECT_LT((Named("sign-2").signpost.anchor - now).norm(), 0.002 * distance);
  });
}

TEST_F(ContentInASession, TheEntranceOfAMapIsAViewThatTheAuthorChose) {
  Run([&] {
    EXPECT_EQ(EntranceOf(*frame_.map, Scene().settings)->id, frame_.map->keyframes.front().id);
    const engine::KeyFrame& last = frame_.map->keyframes.back();
    frame_.camera_from_map = last.camera_from_map;
    ASSERT_EQ(Do(SetMapEntrance{}), "");
    EXPECT_EQ(Scene().settings.entrance, last.id);
    EXPECT_EQ(EntranceOf(*frame_.map, Scene().settings)->id, last.id);
    EXPECT_NE(Do(SetMapEntrance{}), "") << "nothing would change";
    ASSERT_EQ(Do(Undo{}), "");
    EXPECT_EQ(Scene().settings.entrance, std::nullopt);
    ASSERT_EQ(Do(Redo{}), "");
    ASSERT_EQ(Do(SetMapEntrance{false}), "");
    EXPECT_EQ(Scene().settings, content::MapSettings());
    // A keyframe that is no longer in the map.
    content::MapSettings settings;
    settings.entrance = frame_.map->next_keyframe + 5;
    EXPECT_EQ(EntranceOf(*frame_.map, settings)->id, frame_.map->keyframes.front().id);
    EXPECT_EQ(EntranceOf(engine::MapSnapshot(), settings), nullptr);
    EXPECT_EQ(MostSimilarKeyFrame(engine::MapSnapshot(), {}), std::nullopt);
    frame_.state = engine::TrackingState::kLost;
    EXPECT_NE(Do(SetMapEntrance{}), "") << "without a pose there is no view";
  });
}

TEST_F(ContentInASession, AMeasuredMapGivesModelsTheirTrueSize) {
  Run([&] {
    const Eigen::Vector2d other(280, 300);
    ASSERT_EQ(Do(SetMapScale{kPixel, other, 0.5}), "");
    const double metres_per_unit = Scene().settings.metres_per_unit;
    // Signposts at the two pixels stand on the surfaces that were measured.
    ASSERT_EQ(Do(PlaceSignpost{"one", kPixel, ""}), "");
    ASSERT_EQ(Do(PlaceSignpost{"other", other, ""}), "");
    EXPECT_NEAR((Named("sign-1").signpost.anchor - Named("sign-2").signpost.anchor).norm() * metres_per_unit,
                0.5, 1e-9);
    ASSERT_EQ(Do(PlaceModel{"exhibit.glb", kPixel}), "");
    EXPECT_NEAR(Named("exhibit").model.map_from_model.scale, 1 / metres_per_unit, 1e-9);
    ASSERT_EQ(Do(SetMapScale{}), "");
    EXPECT_EQ(Scene().settings, content::MapSettings());
    EXPECT_NE(Do(SetMapScale{kPixel, kPixel, 0.5}), "") << "a length between one point and itself";
    EXPECT_NE(Do(SetMapUp{}), "") << "nothing would change";
  });
}

TEST_F(ContentInASession, EveryCommandChangesTheContentAndIsUndone) {
  Run([&] {
    ASSERT_EQ(Do(PlaceModel{"exhibit.glb", kPixel}), "");
    ASSERT_EQ(Do(PlaceSignpost{"here", kPixel, ""}), "");
    const engine::Sim3 pose{engine::Rotation3::Exp({0.1, 0.2, 0.3}), {0.5, 0.25, 2}, 0.5};
    using enum content::EntityFlag;
    const std::vector<std::pair<Command, std::function<void()>>> commands = {
        {TransformEntities{{{"exhibit", pose}}},
         [&] { EXPECT_EQ(Named("exhibit").model.map_from_model.translation, pose.translation); }},
        {TransformEntities{{{"sign-1", pose}}}, [&] { EXPECT_EQ(Named("sign-1").signpost.height, 0.5); }},
        {TransformEntities{{{"exhibit", pose}, {"sign-1", pose}}},
         [&] {
           EXPECT_EQ(Named("exhibit").model.map_from_model.scale, 0.5);
           EXPECT_EQ(Named("sign-1").signpost.height, 0.5);
         }},
        {RemoveEntities{{"exhibit", "sign-1"}}, [&] { EXPECT_THAT(Scene().entities, IsEmpty()); }},
        {DuplicateEntities{{"exhibit", "sign-1"}},
         [&] {
           EXPECT_NE(Scene().Find("exhibit-2"), nullptr);
           EXPECT_NE(Scene().Find("sign-2"), nullptr);
         }},
        {RenameEntity{"exhibit", "obelisk"}, [&] { EXPECT_NE(Scene().Find("obelisk"), nullptr); }},
        {SetEntityText{"sign-1", "there"}, [&] { EXPECT_EQ(Named("sign-1").signpost.text, "there"); }},
        {SetEntityFlag{{"exhibit", "sign-1"}, kHidden, true},
         [&] { EXPECT_TRUE(Named("exhibit").hidden && Named("sign-1").hidden); }},
        {SetEntityFlag{{"exhibit"}, kLocked, true}, [&] { EXPECT_TRUE(Named("exhibit").locked); }},
        {GroupEntities{{"exhibit", "sign-1"}, "pair"}, [&] { EXPECT_EQ(Named("sign-1").group, "pair"); }},
        {AlignEntity{"exhibit",
                     {{{0, 0, 0}, {0, 0, 0}, kPixel},
                      {{0, 0, 0}, {0, 0, 0}, kPixel},
                      {{1, 0, 0}, {5, 0, 0}, std::nullopt},
                      {{0, 1, 0}, {0, 5, 0}, std::nullopt}}},
         [&] {
           // Coordinates and pixels may be mixed: the first two are one point of the surface.
           EXPECT_GT(Named("exhibit").model.map_from_model.scale, 1);
         }},
        {BendEntity{"exhibit",
                    {{{0, 0, 0}, {0, 0, 0}, kPixel},
                     {{1, 0, 0}, {5, 0, 0}, std::nullopt},
                     {{0, 1, 0}, {0, 5, 0}, std::nullopt},
                     {{0, 0, 1}, {0, 0, 5}, std::nullopt}}},
         [&] {
           const content::PlacedModel& model = Named("exhibit").model;
           const Eigen::Vector3d drawn = model.map_from_model * (*model.warp)({1, 0, 0});
           EXPECT_LT((drawn - Eigen::Vector3d(5, 0, 0)).norm(), 1e-9);
           const auto seen = LensOf(*Room(0.1))[0]->Project(
               frame_.camera_from_map * (model.map_from_model * (*model.warp)({0, 0, 0})));
           EXPECT_LT((*seen - kPixel).norm(), 1e-6);
         }},
        {SetSignpostDirection{"sign-1", Eigen::Vector3d(0, 0, -7)},
         [&] { EXPECT_EQ(*Named("sign-1").signpost.direction, Eigen::Vector3d(0, 0, -1)); }},
        {SetSignpostDirection{"sign-1", std::nullopt, true},
         [&] {
           // What is far in this direction is in the middle of the image.
           const auto seen = LensOf(*Room(0.1))[0]->Project(frame_.camera_from_map.rotation *
                                                            *Named("sign-1").signpost.direction);
           const auto middle = LensOf(*Room(0.1))[0]->Project({0, 0, 1});
           EXPECT_LT((*seen - *middle).norm(), 1e-6);
         }},
        {PasteEntities{{"exhibit", "sign-1"}, "Bay", Eigen::Vector2d(280, 300)},
         [&] {
           // In the same map nothing is turned or scaled, and the middle of the two is at the pixel.
           const content::Entity &first = Named("exhibit"), &copy = Named("exhibit-2");
           EXPECT_EQ(copy.model.map_from_model.scale, first.model.map_from_model.scale);
           const Eigen::Vector3d offset = content::PlaceOf(copy) - content::PlaceOf(first);
           const Eigen::Vector3d sign_offset =
               content::PlaceOf(Named("sign-2")) - content::PlaceOf(Named("sign-1"));
           EXPECT_LT((offset - sign_offset).norm(), 1e-12);
           EXPECT_GT(offset.norm(), 0.01);
           const Eigen::Vector3d middle =
               0.5 * (content::BaseInMap(copy) + content::BaseInMap(Named("sign-2")));
           const auto seen = LensOf(*Room(0.1))[0]->Project(frame_.camera_from_map * middle);
           EXPECT_LT((*seen - Eigen::Vector2d(280, 300)).norm(), 0.01);
         }},
        {PasteEntities{{"sign-1"}, "Bay", std::nullopt}, [&] {
           const auto seen =
               LensOf(*Room(0.1))[0]->Project(frame_.camera_from_map * content::PlaceOf(Named("sign-2")));
           EXPECT_LT((*seen - Eigen::Vector2d(319.5, 239.5)).norm(), 1);
         }}};
    for (const auto& [command, check] : commands) {
      const std::string before = content::EncodeScene(Scene());
      ASSERT_EQ(Do(command), "") << FormatCommand(command);
      check();
      const std::string after = content::EncodeScene(Scene());
      EXPECT_NE(after, before) << FormatCommand(command);
      ASSERT_EQ(Do(Undo{}), "");
      EXPECT_EQ(content::EncodeScene(Scene()), before) << FormatCommand(command);
      ASSERT_EQ(Do(Redo{}), "");
      EXPECT_EQ(content::EncodeScene(Scene()), after) << FormatCommand(command);
      ASSERT_EQ(Do(Undo{}), "");
    }
  });
}

TEST_F(ContentInASession, NothingIsPlacedAtCoordinatesWhileTheCameraIsLost) {
  Run([&] {
    const MapPoint a{{0, 0, 1}}, b{{0, 0.5, 2}}, c{{0, 0.5, 3}};
    ASSERT_EQ(Do(PlaceTrail{{a, b}}), "");
    const std::string before = content::EncodeScene(Scene());
    const engine::TrackedFrame posed = frame_;
    frame_.state = engine::TrackingState::kLost;
    frame_.map.reset();
    EXPECT_THAT(Do(PlaceTrail{{a, b}}), HasSubstr("nothing can be placed while the camera is lost"));
    EXPECT_THAT(Do(PlaceOccluder{content::Occluder::Shape::kBox, std::nullopt, {a}}),
                HasSubstr("nothing can be placed while the camera is lost"));
    // A point is added where it is told, wherever the camera is.
    EXPECT_EQ(Do(ExtendTrail{"trail-1", c}), "");
    frame_ = posed;
    EXPECT_EQ(Named("trail-1").trail.points.size(), 3);
    ASSERT_EQ(Do(Undo{}), "");
    EXPECT_EQ(content::EncodeScene(Scene()), before);
  });
}

TEST_F(ContentInASession, AnAlignedModelHasThePoseThatItsPointsDetermine) {
  Run([&] {
    ASSERT_EQ(Do(PlaceModel{"exhibit.glb", kPixel}), "");
    ASSERT_EQ(Do(PlaceSignpost{"here", kPixel, ""}), "");
    const engine::Sim3 truth{engine::Rotation3::Exp({0.4, -0.2, 1}), {0.5, -0.25, 2}, 0.5};
    AlignEntity command{"exhibit", {}};
    for (const Eigen::Vector3d& point :
         {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, 1, 0),
          Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(1, 1, 1)})
      command.pairs.push_back({point, truth * point, std::nullopt});
    command.pairs[3].in_map += Eigen::Vector3d(1, 1, 0);  // a slip of the hand
    session_->TakeEvents();
    ASSERT_EQ(Do(command), "");
    const engine::Sim3& pose = Named("exhibit").model.map_from_model;
    EXPECT_LT((pose.translation - truth.translation).norm(), 1e-9);
    EXPECT_LT((pose.rotation.inverse() * truth.rotation).Angle(), 1e-9);
    EXPECT_NEAR(pose.scale, 0.5, 1e-9);
    std::string event;
    for (const Event& each : session_->TakeEvents()) {
      if (each.event == "align") event = each.detail;
    }
    EXPECT_THAT(event, testing::EndsWith("map units; without point 4"));
    const std::string before = content::EncodeScene(Scene());
    for (PointPair& pair : command.pairs) pair.in_map = {1, 2, 3};
    EXPECT_THAT(Do(command), HasSubstr("coincide"));
    EXPECT_THAT(Do(AlignEntity{"sign-1", command.pairs}), HasSubstr("is a signpost"));
    EXPECT_THAT(Do(UnbendEntity{"exhibit"}), HasSubstr("is not bent"));
    EXPECT_EQ(content::EncodeScene(Scene()), before);
  });
}

TEST_F(ContentInASession, ALockedEntityIsChangedOnlyAfterItWasUnlocked) {
  Run([&] {
    ASSERT_EQ(Do(PlaceModel{"exhibit.glb", kPixel}), "");
    ASSERT_EQ(Do(SetEntityFlag{{"exhibit"}, content::EntityFlag::kLocked, true}), "");
    const std::string before = content::EncodeScene(Scene());
    for (const Command& command :
         {Command(MoveEntity{"exhibit", {1, 0, 0}, {}}), Command(MoveEntity{"exhibit", {0, 0, 0}, kPixel}),
          Command(RotateEntity{"exhibit", 10}), Command(ScaleEntity{"exhibit", 2}),
          Command(TransformEntities{{{"exhibit", {}}}}), Command(RemoveEntities{{"exhibit"}}),
          Command(RenameEntity{"exhibit", "x"}), Command(GroupEntities{{"exhibit"}, "x"}),
          Command(SetEntityFlag{{"exhibit"}, content::EntityFlag::kHidden, true})}) {
      EXPECT_EQ(Do(command), "'exhibit' is locked; unlock it to change it.") << FormatCommand(command);
    }
    EXPECT_EQ(content::EncodeScene(Scene()), before);
    ASSERT_EQ(Do(SetEntityFlag{{"exhibit"}, content::EntityFlag::kLocked, false}), "");
    EXPECT_EQ(Do(RemoveEntities{{"exhibit"}}), "");
  });
}

// Adds a second map with a signpost to the first one, as if an earlier session had made it.
void AddHall(maps::Library* library, const engine::MapSnapshot& like) {
  content::Scene scene;
  content::Entity sign;
  sign.name = "sign-1";
  sign.signpost.text = "to the bay";
  sign.signpost.anchor = {1, 2, 3};
  sign.signpost.height = 0.5;
  sign.signpost.to_map = "Bay";
  scene.entities.push_back(sign);
  maps::MapRecord record;
  record.key = library->NewKey();
  record.name = "Hall";
  auto snapshot = std::make_shared<engine::MapSnapshot>(like);
  for (engine::KeyFrame& keyframe : snapshot->keyframes) keyframe.mean_depth *= 2;
  record.snapshot = snapshot;
  record.scene = std::make_shared<maps::SceneRecord>(RecordFromScene(scene));
  library->Save(record);
}

TEST_F(ContentInASession, MapsAreRenamedAndRemovedWithTheSignpostsThatLeadToThem) {
  Run([&] { ASSERT_EQ(Do(PlaceSignpost{"here", kPixel, ""}), ""); });
  AddHall(&library_, *session_->Maps().at(0).snapshot);
  acted_ = false;
  session_.reset();
  const std::uint64_t bay = library_.FindByName("Bay").key, hall = library_.FindByName("Hall").key;
  const auto simulation = Room(2.5);
  session_.emplace(Options(Pace::kLockstep, ""), LensOf(*simulation), &library_);
  frame_ = {};
  const auto sign_in = [&](std::uint64_t key) {
    for (const Session::MapState& map : session_->Maps()) {
      if (map.key == key) return map.scene->entities.at(0).signpost;
    }
    throw Error("no map");
  };
  EXPECT_EQ(sign_in(hall).to_map, "Bay");
  EXPECT_THAT(Do(RenameMap{"Attic", "x"}), HasSubstr("no map 'Attic'"));
  EXPECT_THAT(Do(RenameMap{"Bay", "Hall"}), HasSubstr("already a map 'Hall'"));
  EXPECT_THAT(Do(RenameMap{"Bay", "Bay"}), HasSubstr("this name already"));
  ASSERT_EQ(Do(RenameMap{"Bay", "Cove"}), "");
  EXPECT_EQ(library_.FindByName("Cove").key, bay);
  EXPECT_EQ(sign_in(hall).to_map, "Cove");
  EXPECT_EQ(sign_in(hall).to_key, bay);
  EXPECT_THAT(Do(JoinMap{"Hall"}), HasSubstr("no current map"));
  ASSERT_EQ(Do(SetPolicy{"Cove", maps::Policy::kReadOnly}), "");
  EXPECT_THAT(Do(RenameMap{"Cove", "Bay"}), HasSubstr("limited to: None; it cannot be renamed"));
  EXPECT_THAT(Do(RemoveMap{"Cove"}), HasSubstr("limited to: None; it cannot be removed"));
  ASSERT_EQ(Do(SetPolicy{"Cove", maps::Policy::kOpen}), "");
  ASSERT_EQ(Do(RemoveMap{"Cove"}), "");
  EXPECT_THAT(Do(UseMap{"Cove"}), HasSubstr("no map 'Cove'"));
  EXPECT_EQ(sign_in(hall).to_map, "");
  EXPECT_EQ(sign_in(hall).to_key, 0u);
  session_->Finish();
  ASSERT_EQ(library_.List().size(), 1u);
  EXPECT_EQ(library_.List()[0].name, "Hall");
  EXPECT_THAT(library_.LoadScene(hall).text, HasSubstr("\"to_map\":\"\"")) << "saved at the end";
  EXPECT_THAT(library_.Verify(), IsEmpty());
}

TEST_F(ContentInASession, ChangesWithALostCameraAreInTheContentOfItsMap) {
  Run([&] {
    ASSERT_EQ(Do(PlaceSignpost{"here", kPixel, ""}), "");
    engine::TrackedFrame lost = frame_;
    lost.state = engine::TrackingState::kLost;
    lost.map_key = 0;
    lost.map.reset();
    session_->Execute(RenameEntity{"sign-1", "Cove"}, lost);
    EXPECT_EQ(session_->ShownWith(lost).scene, nullptr);
    ASSERT_NE(session_->SceneOf(frame_.map_key), nullptr);
    EXPECT_NE(session_->SceneOf(frame_.map_key)->Find("Cove"), nullptr);
    EXPECT_EQ(session_->SceneOf(0), nullptr);
  });
}

TEST_F(ContentInASession, TheBoundaryOfABoundedMapIsShown) {
  Run([&] {
    EXPECT_FALSE(session_->ShownWith(frame_).bounds.has_value());
    ASSERT_EQ(Do(SetPolicy{"Bay", maps::Policy::kBounded}), "");
    const std::optional<maps::Bounds> bounds = session_->ShownWith(frame_).bounds;
    ASSERT_TRUE(bounds.has_value());
    const Eigen::Vector3d camera = frame_.camera_from_map.OriginInSource();
    const Eigen::Vector3d margin = 0.2 * (bounds->max - bounds->min);
    EXPECT_TRUE(((camera - bounds->min + margin).array() >= 0).all());
    EXPECT_TRUE(((bounds->max + margin - camera).array() >= 0).all());
    ASSERT_EQ(Do(SetPolicy{"Bay", maps::Policy::kOpen}), "");
    EXPECT_FALSE(session_->ShownWith(frame_).bounds.has_value());
  });
}

TEST_F(ContentInASession, ContentIsPastedFromAnotherMapAndSignpostsLeadToOtherMapsOnly) {
  Run([&] { ASSERT_EQ(Do(PlaceSignpost{"here", kPixel, ""}), ""); });
  AddHall(&library_, *session_->Maps().at(0).snapshot);
  acted_ = false;
  session_.reset();
  SessionOptions options = Options(Pace::kLockstep, "");
  options.memory.read_at_start_bytes = 0;  // so that maps are in memory only when they are needed
  const auto simulation = Room(1.5);
  session_.emplace(options, LensOf(*simulation), &library_);
  CalibratedCamera camera = CameraOf(simulation);
  FrameLoopOptions loop;
  loop.pace = Pace::kLockstep;
  RunFrames(&camera, &*session_, loop,
            [&](const engine::TrackedFrame& frame) {
              // The two maps look alike, so the camera is told in which one it is.
              if (frame.frame.index == 0) session_->Execute(UseMap{"Bay"}, frame);
              if (acted_ || !engine::HasPose(frame.state)) return;
              frame_ = frame;
              acted_ = true;
              const std::string here = session_->ShownWith(frame).map_name, there = "Hall";
              ASSERT_EQ(here, "Bay");
              EXPECT_THAT(Do(JoinMap{"Attic"}), HasSubstr("no map 'Attic'"));
              EXPECT_THAT(Do(JoinMap{here}), HasSubstr("'Bay' is the current map already"));
              ASSERT_EQ(Do(SetPolicy{there, maps::Policy::kReadOnly}), "");
              EXPECT_THAT(Do(JoinMap{there}), HasSubstr("'Hall' are limited to: None; it cannot be joined"));
              ASSERT_EQ(Do(SetPolicy{there, maps::Policy::kOpen}), "");
              const double ratio = 0.5;  // of the distances that the first keyframes see
              EXPECT_THAT(Do(PlaceSignpost{"x", kPixel, here}), HasSubstr("cannot lead to its own map"));
              EXPECT_THAT(Do(PlaceSignpost{"x", kPixel, "Attic"}), HasSubstr("no map 'Attic'"));
              EXPECT_THAT(Do(SetSignpostTarget{"sign-1", here}), HasSubstr("cannot lead to its own map"));
              ASSERT_EQ(Do(SetSignpostTarget{"sign-1", there}), "");
              EXPECT_EQ(Named("sign-1").signpost.to_map, there);
              EXPECT_EQ(Named("sign-1").signpost.to_key, library_.FindByName(there).key);
              ASSERT_EQ(Do(SetSignpostDirection{"sign-1", std::nullopt, true}), "");
              EXPECT_TRUE(Named("sign-1").signpost.direction);
              ASSERT_EQ(Do(SetSignpostTarget{"sign-1", ""}), "");
              EXPECT_EQ(Named("sign-1").signpost.to_key, 0u);
              EXPECT_FALSE(Named("sign-1").signpost.direction) << "it led to that map";
              EXPECT_THAT(Do(PasteEntities{{"fox"}, there, kPixel}), HasSubstr("no 'fox'"));
              EXPECT_THAT(Do(PasteEntities{{"sign-1"}, "Attic", kPixel}), HasSubstr("no map 'Attic'"));
              ASSERT_EQ(Do(PasteEntities{{"sign-1"}, there, kPixel}), "");
              double there_height = 0;
              for (const Session::MapState& map : session_->Maps()) {
                if (map.name == there) there_height = map.scene->entities.at(0).signpost.height;
              }
              EXPECT_GT(there_height, 0) << "the map was loaded";
              const content::Signpost& pasted = Named("sign-2").signpost;
              EXPECT_NEAR(pasted.height, ratio * there_height, 1e-12);
              EXPECT_LT((pasted.up - engine::UpInMap(*frame_.map)).norm(), 0.2);
              const auto seen = LensOf(*simulation)[0]->Project(frame_.camera_from_map * pasted.anchor);
              EXPECT_LT((*seen - kPixel).norm(), 0.01);
            },
            {});
  EXPECT_TRUE(acted_);
  session_->Finish();
  EXPECT_THAT(library_.Verify(), IsEmpty());
}

}  // namespace
}  // namespace docent::app
