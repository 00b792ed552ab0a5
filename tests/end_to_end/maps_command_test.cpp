// SPDX-License-Identifier: Apache-2.0
// Tests of docent maps, by the real program.
#include <gmock/gmock.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "app/simulator/simulation.h"
#include "maps/library/library.h"
#include "tests/app/support/simulated_map.h"
#include "tests/app/support/temporary_folder.h"
#include "tests/end_to_end/run_docent.h"

namespace docent::app {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

// A library of three maps without keyframes.
class TourCommands : public ::testing::Test {
 protected:
  TourCommands() {
    maps::Library library = maps::Library::Open(path_, maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
    for (const char* name : {"Lions", "Desk 3", "Masks"})
      library.Save({library.NewKey(), name, maps::Policy::kOpen, nullptr, nullptr});
  }
  std::vector<std::string> Tour(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), {"maps", "tour"});
    arguments.insert(arguments.end(), {"--library", path_});
    return arguments;
  }

  const TemporaryFolder folder_;
  const std::string path_ = (folder_ / "museum.docent").string();
};

TEST_F(TourCommands, CreateShowChangeAndRemoveTours) {
  EXPECT_THAT(RunDocent(Tour({"list"})).output, HasSubstr("no tour"));
  const Outcome created = RunDocent(
      Tour({"create", "Best of", "--stops", "Masks", "Desk 3", "--minutes", "20", "--language", "DE"}));
  EXPECT_EQ(created.exit_status, 0) << created.errors;
  EXPECT_EQ(RunDocent(Tour({"list"})).output, "Best of                      2 stops    20 min  de\n");
  const auto shown = nlohmann::json::parse(RunDocent(Tour({"show", "Best of", "--json"})).output);
  EXPECT_EQ(shown.at("stops"), (nlohmann::json{"Masks", "Desk 3"}));
  EXPECT_EQ(shown.at("minutes"), 20);
  EXPECT_EQ(shown.at("language"), "de");

  EXPECT_EQ(RunDocent({"maps", "rename", "Desk 3", "Kiosk", "--library", path_}).exit_status, 0);
  EXPECT_THAT(RunDocent(Tour({"show", "Best of"})).output, HasSubstr("2 Kiosk"));
  EXPECT_EQ(RunDocent(Tour({"edit", "Best of", "--stops", "Lions", "Masks", "Kiosk", "--no-minutes",
                            "--no-language"}))
                .exit_status,
            0);
  const auto list = nlohmann::json::parse(RunDocent(Tour({"list", "--json"})).output).at("tours");
  EXPECT_EQ(list.at(0).at("stops"), (nlohmann::json{"Lions", "Masks", "Kiosk"}));
  EXPECT_TRUE(list.at(0).at("minutes").is_null());
  EXPECT_TRUE(list.at(0).at("language").is_null());

  EXPECT_EQ(RunDocent(Tour({"rename", "Best of", "All"})).exit_status, 0);
  EXPECT_EQ(RunDocent(Tour({"remove", "All"})).exit_status, 0);
  EXPECT_THAT(RunDocent(Tour({"list"})).output, HasSubstr("no tour"));
}

TEST_F(TourCommands, RefuseWhatIsNoTour) {
  ExpectErrorLine(Tour({"create", "All"}), 2, "--stops is required");
  ExpectErrorLine(Tour({"create", "All", "--stops", "Ships"}), 1, "no map named 'Ships'");
  ExpectErrorLine(Tour({"create", "All", "--stops", "Lions", "Masks", "Lions"}), 1, "'Lions' is given twice");
  ExpectErrorLine(Tour({"create", "", "--stops", "Lions"}), 1, "its name does not have 1 to 200 bytes");
  ExpectErrorLine(Tour({"create", "All", "--stops", "Lions", "--minutes", "0"}), 2, "--minutes");
  ExpectErrorLine(Tour({"create", "All", "--stops", "Lions", "--language", "12"}), 2, "--language");
  ExpectErrorLine(Tour({"show", "All"}), 1, "no tour named 'All'");
  EXPECT_EQ(RunDocent(Tour({"create", "All", "--stops", "Lions"})).exit_status, 0);
  ExpectErrorLine(Tour({"create", "All", "--stops", "Masks"}), 1, "already a tour named 'All'");
  ExpectErrorLine(Tour({"edit", "All"}), 2, "Nothing to change");
  ExpectErrorLine(Tour({"edit", "All", "--minutes", "5", "--no-minutes"}), 2, "excludes");
  ExpectErrorLine(Tour({"rename", "Some", "More"}), 1, "no tour named 'Some'");
  ExpectErrorLine({"tour", "--tour", "Some", "--library", path_, "--camera", "sim:cylinder:20", "--headless"},
                  1, "no tour named 'Some'");
}

TEST_F(TourCommands, AskBeforeAStopIsRemoved) {
  EXPECT_EQ(RunDocent(Tour({"create", "All", "--stops", "Lions", "Masks"})).exit_status, 0);
  const Outcome refused = RunDocent({"maps", "remove", "Masks", "--library", path_});
  EXPECT_EQ(refused.exit_status, 1);
  EXPECT_THAT(refused.output, HasSubstr("the tour 'All' stops at 'Masks'"));
  EXPECT_THAT(refused.errors, HasSubstr("1 tour stops at 'Masks', which was not removed; with --force"));
  EXPECT_EQ(RunDocent({"maps", "remove", "Masks", "--force", "--library", path_}).exit_status, 0);
  EXPECT_THAT(RunDocent(Tour({"show", "All"})).output, Not(HasSubstr("Masks")));
  // The last stop leaves a tour without stops, along which nobody can be led.
  EXPECT_EQ(RunDocent({"maps", "remove", "Lions", "--force", "--library", path_}).exit_status, 0);
  ExpectErrorLine({"tour", "--tour", "All", "--library", path_, "--camera", "sim:cylinder:20", "--headless"},
                  1, "has no stops");
}

TEST_F(TourCommands, MentionToursThatAreExportedWithoutAndImportedWithTheirMaps) {
  EXPECT_EQ(RunDocent(Tour({"create", "All", "--stops", "Lions"})).exit_status, 0);
  const std::string other = (folder_ / "other.docent").string();
  EXPECT_THAT(RunDocent({"maps", "export", "Lions", "--library", path_, "--output", other}).output,
              HasSubstr("1 tour that stops there was left out"));
  EXPECT_THAT(RunDocent({"maps", "import", path_, "--library", other}).output, HasSubstr("tour All\n"));
}

TEST(MapsCommand, ExportsImportsJoinsAndRecoversMaps) {
  const TemporaryFolder folder;
  const std::string path = (folder / "museum.docent").string(), other = (folder / "desk.docent").string();
  {
    maps::Library library = maps::Library::Open(path, maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
    library.Save({library.NewKey(), "Desk", maps::Policy::kOpen, nullptr, nullptr});
  }
  EXPECT_EQ(RunDocent({"maps", "export", "Desk", "--library", path, "--output", other}).exit_status, 0);
  EXPECT_THAT(RunDocent({"maps", "import", other, "--library", path}).output, HasSubstr("Desk (2)"));
  EXPECT_EQ(maps::Library::Open(path, maps::Access::kReadOnly).List().size(), 2u);
  EXPECT_THAT(RunDocent({"maps", "optimize", "--library", path}).output,
              HasSubstr("Desk too small to adjust"));
  ExpectErrorLine({"maps", "join", "Desk", "Desk (2)", "--library", path}, 1, "cannot be joined, because");
  ExpectErrorLine({"maps", "join", "Desk", "Desk", "--library", path}, 1, "itself");
  ExpectErrorLine({"maps", "join", "Desk", "Kiosk", "--library", path}, 1, "Kiosk");
  for (const char* name : {"desk.ply", "desk.png", "colmap"}) {
    const std::string output = (folder / name).string();
    EXPECT_EQ(RunDocent({"maps", "export", "Desk", "--library", path, "--output", output}).exit_status, 0);
    EXPECT_TRUE(std::filesystem::exists(output));
    ExpectErrorLine({"maps", "export", "Desk", "--library", path, "--output", output}, 1, "already exists");
  }
  EXPECT_TRUE(std::filesystem::exists(folder / "colmap/points3D.txt"));
  ExpectErrorLine({"maps", "export", "Desk", "--library", path, "--output", (folder / "a.obj").string()}, 2,
                  "unknown file type");
  ExpectErrorLine(
      {"maps", "export", "Desk", "--library", path, "--output", (folder / "a.png").string(), "--mesh"}, 2,
      "a mesh is written");
  const std::string saved = (folder / "saved.docent").string();
  EXPECT_THAT(RunDocent({"maps", "recover", "--library", path, "--output", saved}).output,
              HasSubstr("2 maps recovered completely and 0 partly"));
  ExpectErrorLine({"maps", "recover", "--library", path, "--output", saved}, 1, "exists already");
}

TEST(MapsCommand, DensifiesAMapOnce) {
  const TemporaryFolder folder;
  const std::string path = (folder / "room.docent").string();
  SimulationOptions options;
  options.duration_s = 4;
  const auto simulation = MakeSimulation("room", options);
  {
    maps::Library library = maps::Library::Open(path, maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
    library.Save({library.NewKey(), "Table", maps::Policy::kOpen,
                  SimulatedMap(*simulation, EvenlySpacedFrames(*simulation, 6)), nullptr});
  }
  const Outcome first = RunDocent({"maps", "densify", "--library", path});
  EXPECT_EQ(first.exit_status, 0) << first.errors;
  EXPECT_THAT(first.output, StartsWith("Table has a mesh now: "));
  {
    const maps::Library library = maps::Library::Open(path, maps::Access::kReadOnly);
    EXPECT_THAT(library.Verify(), IsEmpty());
    const auto mesh = library.LoadMesh(library.FindByName("Table").key);
    ASSERT_TRUE(mesh);
    EXPECT_GT(mesh->mesh.triangles.size(), 0u);
    EXPECT_EQ(mesh->keyframes.size(), 6u);
  }
  EXPECT_EQ(RunDocent({"maps", "densify", "--library", path}).output, "Table has a mesh already\n");
}

}  // namespace
}  // namespace docent::app
