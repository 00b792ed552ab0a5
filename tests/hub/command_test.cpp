// SPDX-License-Identifier: Apache-2.0
#include <fstream>

#include "maps/hub/administration.h"
#include "tests/end_to_end/run_docent.h"
#include "tests/hub/hub_samples.h"
#include "tests/hub/private_server.h"

// The commands of an operator and of two curators, with the real program.
namespace docent::maps {
namespace {

using app::ExpectErrorLine;
using app::Outcome;
using app::RunDocent;
using testing::HasSubstr;

class HubCommand : public WithHubServer {
 protected:
  std::string Path(const std::string& name) const { return (folder_ / name).string(); }
  std::string Succeed(const std::vector<std::string>& arguments) {
    const Outcome outcome = RunDocent(arguments);
    EXPECT_EQ(outcome.exit_status, 0) << testing::PrintToString(arguments) << outcome.errors;
    return outcome.output;
  }
  // A session that makes a map of this name in the library a.docent.
  std::vector<std::string> Author(const std::string& map, const std::string& hub) const {
    const std::string script = Path(map + ".txt");
    std::ofstream(script) << "0.1 map new \"" << map << "\"\n";
    return {"author",   "--library", Path("a.docent"), "--camera", "sim:room,fps=10", "--until", "5",
            "--script", script,      "--headless",     "--pace",   "lockstep",        "--hub",   hub};
  }
  TemporaryFolder folder_;
};

TEST_F(HubCommand, TakesTwoDevicesFromNothingToOneHub) {
  const std::string url = server().Url("museum");
  EXPECT_THAT(Succeed({"hub", "init", url}), HasSubstr("ready in a new database"));
  EXPECT_THAT(Succeed({"hub", "init", url}), HasSubstr("already exists"));
  Succeed({"hub", "user", "add", "anna", "--role", "curator", "--hub", url});
  Succeed({"hub", "user", "add", "kiosk", "--role", "visitor", "--hub", url});
  EXPECT_THAT(Succeed({"hub", "user", "list", "--hub", url}), HasSubstr("anna"));
  {
    Library library = OpenSampleLibrary(folder_ / "a.docent");
    AddSampleMap(&library, "Desk", 1);
  }
  const std::string anna = server().Url("museum", "anna"), kiosk = server().Url("museum", "kiosk");
  EXPECT_THAT(Succeed({"maps", "push", "--library", Path("a.docent"), "--hub", anna}),
              HasSubstr("was added to the hub"));
  EXPECT_THAT(Succeed({"maps", "pull", "--library", Path("b.docent"), "--hub", kiosk}),
              HasSubstr("'Desk' was added"));
  EXPECT_THAT(Succeed({"maps", "verify", "--library", Path("b.docent")}), HasSubstr("no problems"));
  EXPECT_EQ(DifferenceOf("Desk", Path("a.docent"), Path("b.docent")), "");
  EXPECT_THAT(Succeed({"hub", "status", "--hub", anna}),
              testing::AllOf(HasSubstr("anna, curator"), HasSubstr("Desk")));
  Succeed({"maps", "rename", "Desk", "Table", "--library", Path("a.docent")});
  Succeed({"maps", "push", "--library", Path("a.docent"), "--hub", anna});
  EXPECT_THAT(Succeed({"hub", "revert", "Table", "1", "--hub", anna}), HasSubstr("saved as revision 3"));
  Succeed({"maps", "pull", "Desk", "--library", Path("b.docent"), "--hub", kiosk});
  EXPECT_EQ(NamesIn(OpenSampleLibrary(Path("b.docent"))), "Desk");
  {
    Library library = OpenSampleLibrary(folder_ / "b.docent");
    library.Rename(library.FindByName("Desk").key, "Mine");
  }
  const Outcome refused = RunDocent({"maps", "push", "--library", Path("b.docent"), "--hub", kiosk});
  EXPECT_EQ(refused.exit_status, 1) << "a visitor has saved on the hub";
  EXPECT_THAT(refused.output + refused.errors, HasSubstr("may not do this"));
  Succeed({"hub", "user", "remove", "kiosk", "--hub", url});
  Succeed({"hub", "user", "remove", "anna", "--hub", url});
}

TEST_F(HubCommand, ABackupBecomesTheSameHubElsewhere) {
  const std::string carl = AddUser("carl", "curator");
  {
    Library library = OpenSampleLibrary(folder_ / "a.docent");
    AddSampleMap(&library, "Desk", 1);
  }
  Succeed({"maps", "push", "--library", Path("a.docent"), "--hub", Url(carl)});
  Succeed({"hub", "backup", Path("museum.hub"), "--hub", Url()});
  ExpectErrorLine({"hub", "backup", Path("museum.hub"), "--hub", Url()}, 1, "exists already");
  ExpectErrorLine({"hub", "backup", Path("other.hub"), "--hub", Url(carl)}, 1, "cannot be saved");
  EXPECT_FALSE(std::filesystem::exists(Path("other.hub.part")));
  ExpectErrorLine({"hub", "restore", Path("museum.hub"), "--hub", Url()}, 1, "another database");
  RemoveHubUser(Url(), carl);
  const std::string restored = server().Url("restored-" + Database());
  EXPECT_THAT(Succeed({"hub", "restore", Path("museum.hub"), "--hub", restored}),
              HasSubstr("no user '" + carl + "'"));
  AddHubUser(restored, carl, "curator", std::nullopt);
  Succeed({"maps", "pull", "--library", Path("b.docent"), "--hub", restored});
  EXPECT_EQ(DifferenceOf("Desk", Path("a.docent"), Path("b.docent")), "");
  EXPECT_THAT(Succeed({"maps", "push", "--library", Path("a.docent"), "--hub", restored}), HasSubstr("agree"))
      << "it is not the same hub";
  EXPECT_THAT(ErrorOfHubSql(server().Url("restored-" + Database(), carl), "DELETE FROM docent.maps"),
              HasSubstr("permission denied"));
  EXPECT_THAT(ErrorOfHubSql(restored, "DELETE FROM docent.changes"), HasSubstr("never changed"));
}

TEST_F(HubCommand, ErrorsAreOneSentence) {
  ExpectErrorLine({"hub", "status", "--hub", "postgresql://anna:secret@localhost/x"}, 1,
                  "contains a password");
  ExpectErrorLine({"hub", "status", "--hub", "museum"}, 1, "begins with postgresql://");
  ExpectErrorLine({"hub", "status", "--hub", "postgresql://%2Fnowhere/x"}, 1, "cannot be reached");
  ExpectErrorLine({"hub", "status", "--hub", server().Url("postgres")}, 1, "contains no hub");
  ExpectErrorLine({"hub", "revert", "Nothing", "1", "--hub", Url()}, 1, "no map named 'Nothing'");
  ExpectErrorLine({"hub", "user", "add", "anna", "--role", "king", "--hub", Url()}, 2, "king");
  ExpectErrorLine({"maps", "pull", "Nothing", "--library", Path("c.docent"), "--hub", Url()}, 1,
                  "no map named 'Nothing'");
  ExpectErrorLine({"maps", "push", "--library", Path("missing.docent"), "--hub", Url()}, 1, "does not exist");
  std::ofstream(Path("file")) << "no folder";
  ExpectErrorLine({"hub", "collect", Path("file") + "/visits", "--hub", Url()}, 1, "' cannot be used: ");
}

TEST_F(HubCommand, AnAuthorsMapIsOnTheHubWhenTheSessionEnds) {
  const std::string url = server().Url("live");
  Succeed({"hub", "init", url});
  Succeed(Author("Desk", url));
  Succeed({"maps", "pull", "--library", Path("b.docent"), "--hub", url});
  EXPECT_EQ(NamesIn(OpenSampleLibrary(Path("b.docent"))), "Desk");
  {
    Library library = OpenSampleLibrary(folder_ / "b.docent");
    AddSampleMap(&library, "Theirs", 3);
  }
  Succeed({"maps", "push", "--library", Path("b.docent"), "--hub", url});
  Succeed(Author("Shelf", url));
  EXPECT_THAT(NamesIn(OpenSampleLibrary(Path("a.docent"))), HasSubstr("Theirs"))
      << "a session begins with what others have changed";
}

TEST_F(HubCommand, AnAuthorGoesOnWithoutAHub) {
  const Outcome outcome = RunDocent(Author("Desk", "postgresql://x@%2Fnowhere/docent"));
  EXPECT_EQ(outcome.exit_status, 0) << outcome.errors;
  EXPECT_THAT(outcome.errors, testing::AllOf(HasSubstr("cannot be reached"), HasSubstr("docent maps push")));
  EXPECT_EQ(NamesIn(OpenSampleLibrary(Path("a.docent"))), "Desk");
}

}  // namespace
}  // namespace docent::maps
