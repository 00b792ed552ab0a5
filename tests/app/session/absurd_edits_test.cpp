// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "app/demo/exhibit_model.h"
#include "app/session/library_scene.h"
#include "app/session/session.h"
#include "content/scene_codec.h"
#include "engine/base/error.h"
#include "engine/base/random.h"
#include "maps/exchange/exchange.h"
#include "tests/app/support/simulated_session.h"
#include "tests/app/support/temporary_folder.h"

namespace docent::app {
namespace {

using namespace simulated_session;

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

// Commands with numbers, names and texts that no person would choose.
class AbsurdCommands {
 public:
  explicit AbsurdCommands(std::uint64_t seed) : random_(seed) {}

  Command Next() {
    switch (random_.Below(37)) {
      case 0:
        return NewMap{Name()};
      case 1:
        return random_.Below(8) == 0 ? Command(StopMap{}) : Command(UseMap{MapName()});
      case 2:
        return SetPolicy{MapName(), static_cast<maps::Policy>(random_.Below(3))};
      case 3:
        return RenameMap{MapName(), random_.Below(3) == 0 ? MapName() : Name()};
      case 4:
        if (random_.Below(10) == 0) return RemoveMap{MapName()};
        return random_.Below(5) == 0 ? Command(JoinMap{MapName()}) : Command(Save{});
      case 5:
      case 6:
      case 7:
        return PlaceModel{"exhibit.glb", Pixel(), Perhaps<double>([&] { return Number(); }), Number()};
      case 8:
      case 9:
        return PlaceSignpost{Text(), Pixel(), random_.Below(2) == 0 ? MapName() : Name()};
      case 10: {
        MoveEntity move{Name(), Vector(), {}};
        if (random_.Below(2) == 0) move.to_pixel = Pixel();
        return move;
      }
      case 11:
        return RotateEntity{Name(), Number()};
      case 12:
        return ScaleEntity{Name(), Number()};
      case 13: {
        TransformEntities transform;
        for (const std::string& name : Names())
          transform.poses.push_back({name, {engine::Rotation3::Exp(Vector()), Vector(), Number()}});
        return transform;
      }
      case 14:
        return RemoveEntities{Names()};
      case 15:
        return DuplicateEntities{Names()};
      case 16:
        return RenameEntity{Name(), Name()};
      case 17:
        return SetEntityText{Name(), Text(),
                             random_.Below(2) == 0   ? ""
                             : random_.Below(2) == 0 ? "de"
                                                     : Name()};
      case 26:
      case 27:
        return PlaceLabel{Text(), Pixel(), Perhaps<Eigen::Vector3d>([&] { return Vector(); })};
      case 28: {
        PlaceTrail trail;
        for (std::size_t n = random_.Below(4); n > 0; --n) trail.points.push_back(Place());
        trail.width = Perhaps<double>([&] { return Number(); });
        return trail;
      }
      case 29:
        return ExtendTrail{Name(), Place()};
      case 30:
        return ShortenTrail{Name()};
      case 34: {
        PlaceOccluder occluder;
        occluder.shape = static_cast<content::Occluder::Shape>(random_.Below(4));
        for (std::size_t n = random_.Below(6); n > 0; --n) occluder.points.push_back(Place());
        occluder.size = Perhaps<Eigen::Vector3d>([&] { return Vector(); });
        occluder.yaw_deg = random_.Below(3) == 0 ? Number() : 0;
        occluder.upright = random_.Below(2) == 0;
        return occluder;
      }
      case 35:
        return ResizeOccluder{Name(), Vector()};
      case 31:
        return SetLabelOffset{Name(), Vector()};
      case 18:
        return SetSignpostTarget{Name(), MapName()};
      case 19:
        return SetEntityFlag{
            Names(), random_.Below(3) == 0 ? content::EntityFlag::kLocked : content::EntityFlag::kHidden,
            random_.Below(2) == 0};
      case 20:
        return GroupEntities{Names(), Text()};
      case 21:
        return PasteEntities{Names(), MapName(), Perhaps<Eigen::Vector2d>([&] { return Pixel(); })};
      case 22:
      case 23:
        return Undo{};
      case 24:
        return Redo{};
      case 25:
        if (random_.Below(4) == 0) return SetMapEntrance{random_.Below(2) == 0};
        return SetMapUp{Perhaps<Eigen::Vector2d>([&] { return Pixel(); })};
      case 33:
        return SetSignpostDirection{Name(), Perhaps<Eigen::Vector3d>([&] { return Vector(); }),
                                    random_.Below(2) == 0};
      case 32:
        return SetMapScale{Pixel(), Pixel(), Number()};
      default:
        return Save{};
    }
  }

 private:
  template <typename Value, typename Make>
  std::optional<Value> Perhaps(const Make& make) {
    return random_.Below(2) == 0 ? std::optional<Value>(make()) : std::nullopt;
  }
  double Number() {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    const std::array numbers = {0.0,          -0.0,     1.0,   -1.0,   1e300, -1e300,    1e-300,
                                5e-324,       1e6,      -1e6,  1e9,    1e-9,  kInfinity, -kInfinity,
                                std::nan(""), 999999.9, 1e154, 1e-160, 1e38,  123.456,   0.5};
    return random_.Below(2) == 0 ? random_.Uniform(-2, 2) : numbers[random_.Below(numbers.size())];
  }
  Eigen::Vector3d Vector() { return {Number(), Number(), Number()}; }
  MapPoint Place() {
    return {Vector(), Perhaps<Eigen::Vector2d>([&] { return Pixel(); })};
  }
  // Mostly where the map has a surface.
  Eigen::Vector2d Pixel() {
    if (random_.Below(6) == 0) return {Number(), Number()};
    return {random_.Uniform(200, 440), random_.Uniform(200, 380)};
  }
  std::string Text() {
    const std::array<std::string, 12> texts = {"",
                                               "here",
                                               std::string(10'000, 'x'),
                                               std::string(10'001, 'x'),
                                               std::string(3'000'000, 'y'),
                                               "\xFF\xFE not UTF-8 \xC3",
                                               std::string("a\0b", 3),
                                               "line\nline\r\t\x01\x1F\x7F",
                                               "\"quoted\" \\ # {\"docent_scene\": 3}",
                                               "\xED\xA0\x80",
                                               "\xF4\x8F\xBF\xBF \xE2\x80\xAE",
                                               "Gr\xC3\xBC\xC3\x9F"};
    return texts[random_.Below(texts.size())];
  }
  std::string Name() {
    const std::array<std::string, 11> names = {"occluder-1", "label-1",   "trail-1",    "exhibit",
                                               "exhibit-2",  "exhibit-3", "sign-1",     "sign-2",
                                               "sign-3",     "here",      "exhibit-2-2"};
    return random_.Below(6) == 0 ? Text() : names[random_.Below(names.size())];
  }
  std::vector<std::string> Names() {
    std::vector<std::string> names;
    for (std::uint32_t i = random_.Below(4); i > 0; --i) names.push_back(Name());
    return names;
  }
  std::string MapName() {
    const std::array<std::string, 4> names = {"Desk", "Desk (2)", "here", "Door"};
    return random_.Below(8) == 0 ? Text() : names[random_.Below(names.size())];
  }

  Random random_;
};

// A library of two maps, and a frame in the first of them at which commands are executed.
class AbsurdEdits : public ::testing::Test {
 protected:
  AbsurdEdits() {
    const std::vector<std::uint8_t> glb = MakeExhibitGlb();
    folder_.Write("exhibit.glb", {glb.begin(), glb.end()});
    {
      maps::Library library = OpenLibrary(base_, maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
      Session session(Options(Pace::kLockstep, "Desk"), LensOf(*simulation_), &library);
      for (const engine::TrackedFrame& frame : Feed(simulation_, Pace::kLockstep, &session).frames) {
        if (engine::HasPose(frame.state)) frame_ = frame;
      }
    }
    const maps::Library library = OpenLibrary(base_, maps::Access::kReadOnly);
    maps::ExportMap(library, library.FindByName("Desk").key, folder_ / "copy.docent");
    maps::ImportMaps(OpenLibrary(folder_ / "copy.docent", maps::Access::kReadOnly), base_);
  }
  // Executes some commands in a session with the library; returns the number of those that were accepted.
  int RunScript(std::uint64_t seed) {
    AbsurdCommands commands(seed);
    maps::Library library = OpenLibrary(file_, maps::Access::kReadWrite);
    Session session(Options(Pace::kLockstep, ""), LensOf(*simulation_), &library);
    engine::TrackedFrame frame = frame_;
    int accepted = 0;
    constexpr int kCommands = 25;
    for (int i = 0; i < kCommands; ++i) {
      const Command command = commands.Next();
      for (const Session::MapState& map : session.Maps()) {
        if (map.key == frame_.map_key && map.snapshot) frame.map = map.snapshot;
      }
      try {
        session.Execute(command, frame, folder_.path());
        ++accepted;
      } catch (const Error& error) {
        EXPECT_STRNE(error.what(), "");
      }
    }
    session.Finish();
    for (const Session::MapState& map : session.Maps()) {
      if (!map.discarded && map.snapshot) scenes_[map.key] = content::EncodeScene(*map.scene);
      if (map.discarded) scenes_.erase(map.key);
    }
    // No warning is about the library.
    for (const Event& event : session.TakeEvents()) EXPECT_THAT(event.detail, Not(HasSubstr(file_.string())));
    return accepted;
  }
  void ExpectReadable() {
    const maps::Library library = OpenLibrary(file_, maps::Access::kReadOnly);
    EXPECT_THAT(library.Verify(), IsEmpty());
    const std::vector<maps::MapInfo> infos = library.List();
    EXPECT_EQ(infos.size(), scenes_.size());
    for (const maps::MapInfo& info : infos) {
      AssetCache assets;
      const maps::SceneRecord record = library.LoadScene(info.key);
      const content::Scene scene = SceneFromRecord(record, "scene", &assets);
      EXPECT_EQ(content::EncodeScene(scene), scenes_[info.key]);
      if (const auto history = library.LoadHistory(info.key)) HistoryFromRecord(*history, "history", &assets);
    }
  }

  const TemporaryFolder folder_;
  const std::filesystem::path base_ = folder_ / "base.docent", file_ = folder_ / "edited.docent";
  const std::shared_ptr<const Simulation> simulation_ = Room(3);
  engine::TrackedFrame frame_;
  std::map<std::uint64_t, std::string> scenes_;  // As they were in the last session, by map.
};

// DOCENT_EDIT_SCRIPTS is the number of scripts.
TEST_F(AbsurdEdits, NeverMakeALibraryUnreadable) {
  ASSERT_TRUE(engine::HasPose(frame_.state));
  const char* const wanted = std::getenv("DOCENT_EDIT_SCRIPTS");
  const int scripts = wanted ? std::atoi(wanted) : 80;
  constexpr int kScriptsPerLibrary = 8;
  int accepted = 0;
  for (int i = 0; i < scripts; ++i) {
    if (i % kScriptsPerLibrary == 0) {
      std::filesystem::copy_file(base_, file_, std::filesystem::copy_options::overwrite_existing);
      scenes_.clear();
    }
    ASSERT_NO_THROW(accepted += RunScript(static_cast<std::uint64_t>(i) + 1)) << "script " << i;
    ASSERT_NO_THROW(ExpectReadable()) << "script " << i;
    ASSERT_FALSE(HasFailure()) << "script " << i;
  }
  EXPECT_GT(accepted, scripts * 5) << "too few commands change something";
  RecordProperty("accepted", accepted);
}

}  // namespace
}  // namespace docent::app
