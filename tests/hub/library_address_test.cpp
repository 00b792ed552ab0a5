// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>
#include <fstream>
#include <regex>

#include "tests/end_to_end/run_docent.h"
#include "tests/hub/hub_samples.h"
#include "tests/hub/private_server.h"

// --library with the address of a hub, with the real program. A device is a folder for its data.
namespace docent::maps {
namespace {

using app::ExpectErrorLine;
using app::Outcome;
using app::RunDocent;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class HubLibrary : public WithHubServer {
 protected:
  void SetUp() override {
    WithHubServer::SetUp();
    UseDevice("first");
  }
  std::string Path(const std::string& name) const { return (folder_ / name).string(); }
  // What runs from now on runs on this device.
  void UseDevice(const std::string& name) const { setenv("XDG_DATA_HOME", Path(name).c_str(), 1); }
  static Outcome On(const std::string& library, std::vector<std::string> command) {
    command.insert(command.end(), {"--library", library});
    return RunDocent(command);
  }
  static std::string Succeed(const std::string& library, const std::vector<std::string>& command) {
    const Outcome outcome = On(library, command);
    EXPECT_EQ(outcome.exit_status, 0) << testing::PrintToString(command) << outcome.errors;
    return outcome.output;
  }
  // A library with two maps to import.
  std::string Samples() const {
    const std::string file = Path("samples.docent");
    Library library = OpenSampleLibrary(file);
    AddSampleMap(&library, "Desk", 1);
    AddSampleMap(&library, "Shelf", 2);
    return file;
  }

  TemporaryFolder folder_;
};

TEST_F(HubLibrary, ServesEveryCommandAsAFileDoes) {
  const std::string samples = Samples();
  // The commands are given on two devices in turn.
  const std::vector<std::vector<std::string>> commands = {
      {"maps", "import", samples},
      {"maps", "list"},
      {"maps", "list", "--json"},
      {"maps", "show", "Desk", "--json"},
      {"maps", "verify"},
      {"maps", "rename", "Shelf", "Table"},
      {"maps", "policy", "Table", "augment-only"},
      {"content", "add", "--signpost", "To the table", "--to", "Table", "--map", "Desk", "--at", "0", "0",
       "2"},
      {"content", "add", "--label", "A desk", "--map", "Desk", "--at", "0", "1", "2", "--name", "plate"},
      {"content", "edit", "plate", "--map", "Desk", "--text", "An old desk"},
      {"content", "list", "--json"},
      {"content", "remove", "plate", "--map", "Desk"},
      {"content", "list"},
      {"maps", "tour", "create", "Highlights", "--stops", "Table", "Desk"},
      {"maps", "tour", "edit", "Highlights", "--minutes", "20"},
      {"maps", "tour", "rename", "Highlights", "All"},
      {"maps", "tour", "show", "All"},
      {"maps", "remove", "Table"},
      {"maps", "remove", "Table", "--force"},
      {"maps", "tour", "list"},
      {"maps", "list"},
      {"maps", "rename", "Nothing", "Something"},
  };
  const std::regex time(R"(\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ)"), place(R"('[^' ]*\.docent'|[^' ]*\.docent)");
  const auto without_times = [&](const std::string& text) {
    return std::regex_replace(std::regex_replace(text, time, "TIME"), place, "LIBRARY");
  };
  const std::string file = Path("file.docent");
  { OpenSampleLibrary(file); }
  int device = 0;
  for (const std::vector<std::string>& command : commands) {
    const Outcome expected = On(file, command);
    UseDevice(++device % 2 == 0 ? "first" : "second");
    const Outcome outcome = On(Url(), command);
    SCOPED_TRACE(testing::PrintToString(command));
    EXPECT_EQ(outcome.exit_status, expected.exit_status) << outcome.errors;
    EXPECT_EQ(without_times(outcome.output), without_times(expected.output));
    EXPECT_EQ(without_times(outcome.errors), without_times(expected.errors));
  }
}

TEST_F(HubLibrary, IsReadAndChangedWithoutNetworkAndDeliversTheChangeLater) {
  Succeed(Url(), {"maps", "import", Samples()});
  UseDevice("second");
  ASSERT_THAT(Succeed(Url(), {"maps", "list"}), HasSubstr("Desk"));
  EXPECT_EQ(std::filesystem::status(folder_ / "second" / "docent" / "hubs").permissions(),
            std::filesystem::perms::owner_all)
      << "others may not see the images";
  server().Stop();
  const Outcome read = On(Url(), {"maps", "list"});
  const Outcome changed = On(Url(), {"maps", "rename", "Desk", "Table"});
  UseDevice("third");
  const Outcome new_device = On(Url(), {"maps", "list"});
  server().Start();
  EXPECT_EQ(read.exit_status, 0);
  EXPECT_THAT(read.output, HasSubstr("Desk"));
  EXPECT_THAT(read.errors, HasSubstr("this device's copy of its library is used"));
  EXPECT_EQ(changed.exit_status, 0);
  EXPECT_THAT(changed.errors, HasSubstr("the hub gets it with the next change"));
  EXPECT_EQ(new_device.exit_status, 1) << "it has no copy";
  EXPECT_THAT(new_device.errors, HasSubstr("cannot be reached"));

  UseDevice("first");
  Succeed(Url(), {"maps", "rename", "Shelf", "Rack"});
  UseDevice("second");
  EXPECT_THAT(Succeed(Url(), {"maps", "list"}), AllOf(HasSubstr("Table"), HasSubstr("Rack")))
      << "the change that was made without network is not lost";
  Succeed(Url(), {"maps", "policy", "Rack", "augment-only"});
  UseDevice("first");
  EXPECT_THAT(Succeed(Url(), {"maps", "list"}),
              AllOf(HasSubstr("Table"), HasSubstr("augment-only"), Not(HasSubstr("Desk"))));
}

TEST_F(HubLibrary, LetsAVisitorReadAndChangeNothing) {
  Succeed(Url(), {"maps", "import", Samples()});
  const std::string visitor = Url(AddUser("vera", "visitor"));
  EXPECT_THAT(Succeed(visitor, {"maps", "list"}), HasSubstr("Desk"));
  const Outcome refused = On(visitor, {"maps", "rename", "Desk", "Mine"});
  EXPECT_EQ(refused.exit_status, 1);
  EXPECT_THAT(refused.errors, HasSubstr("may not change its library"));
  EXPECT_THAT(Succeed(visitor, {"maps", "list"}), AllOf(HasSubstr("Desk"), Not(HasSubstr("Mine"))));
}

TEST_F(HubLibrary, IsAuthoredOnOneDeviceAndTouredOnAnother) {
  const std::string script = Path("script.txt");
  std::ofstream(script) << "0.1 map new \"Desk\"\n";
  const std::vector<std::string> camera = {"--camera",   "sim:room,fps=10", "--until", "5",
                                           "--headless", "--pace",          "lockstep"};
  std::vector<std::string> author = {"author", "--script", script};
  author.insert(author.end(), camera.begin(), camera.end());
  Succeed(Url(), author);
  UseDevice("second");
  const std::string visitor = Url(AddUser("vera", "visitor"));
  std::vector<std::string> tour = {"tour", "--output", Path("run")};
  tour.insert(tour.end(), camera.begin(), camera.end());
  Succeed(visitor, tour);
  int recognized = 0;
  for (const app::Row& row : app::ReadFrames(folder_ / "run" / "frames.csv"))
    recognized += row.at("map") == "Desk" ? 1 : 0;
  EXPECT_GT(recognized, 10);
}

TEST_F(HubLibrary, IsRecoveredFromADamagedCopy) {
  Succeed(Url(), {"maps", "import", Samples()});
  std::filesystem::path copy;
  for (const auto& entry : std::filesystem::directory_iterator(folder_ / "first" / "docent" / "hubs")) {
    if (entry.path().extension() == ".docent") copy = entry.path();
  }
  ASSERT_FALSE(copy.empty());
  constexpr int kCutBytes = 5000;  // More than a page.
  std::filesystem::resize_file(copy, std::filesystem::file_size(copy) - kCutBytes);
  EXPECT_EQ(On(Url(), {"maps", "verify"}).exit_status, 1);
  EXPECT_THAT(Succeed(Url(), {"maps", "recover", "--output", Path("saved.docent")}), HasSubstr("recovered"));
  EXPECT_FALSE(OpenSampleLibrary(Path("saved.docent")).List().empty());
}

TEST_F(HubLibrary, LosesAMapThatASessionRemoves) {
  Succeed(Url(), {"maps", "import", Samples()});
  const std::string script = Path("script.txt");
  std::ofstream(script) << "0.1 map remove \"Desk\"\n";
  Succeed(Url(), {"author", "--script", script, "--camera", "sim:room,fps=10", "--until", "1", "--headless",
                  "--pace", "lockstep", "--when-lost", "wait"});
  UseDevice("second");
  EXPECT_THAT(Succeed(Url(), {"maps", "list"}), AllOf(HasSubstr("Shelf"), Not(HasSubstr("Desk"))));
}

TEST_F(HubLibrary, NamesOneHubOnly) {
  ExpectErrorLine({"tour", "--library", Url(), "--hub", Url("other"), "--camera", "sim:room"}, 2,
                  "--library names a hub already");
  ExpectErrorLine({"maps", "list", "--library", "postgresql://anna:secret@localhost/x"}, 1,
                  "contains a password");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "first")) << "nothing is made for a wrong address";
}

}  // namespace
}  // namespace docent::maps
