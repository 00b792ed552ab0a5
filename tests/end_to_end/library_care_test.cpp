// SPDX-License-Identifier: Apache-2.0
// Tests of the real program on what happens to a library between sessions: undoing, renaming, removing and
// recovering.
#include <gtest/gtest.h>

#include "app/demo/exhibit_model.h"
#include "tests/end_to_end/run_docent.h"

namespace docent::app {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

// A library that the program authored: a map with a model and a signpost.
class LibraryCare : public ::testing::Test {
 protected:
  LibraryCare() {
    const std::vector<std::uint8_t> glb = MakeExhibitGlb();
    folder_.Write("exhibit.glb", {glb.begin(), glb.end()});
    Author(
        "0 map new Desk\n3 place exhibit.glb at pixel 320 290 scale 0.3\n3.2 signpost here at pixel 400 "
        "280\n");
  }
  void Author(const std::string& script) {
    folder_.Write("script.txt", script);
    const Outcome outcome =
        RunDocent({"author", "--library", library_, "--camera", "sim:museum:2", "--until", "4", "--headless",
                   "--pace", "lockstep", "--script", (folder_ / "script.txt").string()});
    ASSERT_EQ(outcome.exit_status, 0) << outcome.errors;
  }
  std::string Content(const std::string& library) const {
    return RunDocent({"content", "list", "--library", library}).output;
  }
  Outcome Maps(const std::string& action, std::vector<std::string> more) const {
    more.insert(more.begin(), {"maps", action, "--library", library_});
    return RunDocent(more);
  }

  const TemporaryFolder folder_;
  const std::string library_ = (folder_ / "l.docent").string();
};

TEST_F(LibraryCare, UndoGoesOnInTheNextSession) {
  EXPECT_THAT(Content(library_), AllOf(HasSubstr("exhibit"), HasSubstr("sign-1")));
  Author("0 map use Desk\n1 undo\n");
  EXPECT_THAT(Content(library_), AllOf(HasSubstr("exhibit"), Not(HasSubstr("sign-1"))));
  Author("0 map use Desk\n1 undo\n");
  EXPECT_THAT(Content(library_), Not(HasSubstr("exhibit")));
  Author("0 map use Desk\n1 redo\n1.2 redo\n");
  EXPECT_THAT(Content(library_), AllOf(HasSubstr("exhibit"), HasSubstr("sign-1")));
  EXPECT_THAT(Maps("verify", {}).output, HasSubstr("no problems found"));
}

TEST_F(LibraryCare, SignpostsFollowTheirMapUntilItIsRemoved) {
  const std::string copy = (folder_ / "copy.docent").string();
  ASSERT_EQ(Maps("export", {"Desk", "--output", copy}).exit_status, 0);
  ASSERT_EQ(Maps("import", {copy}).exit_status, 0);
  ASSERT_EQ(RunDocent({"content", "add", "--signpost", "over there", "--to", "Desk (2)", "--map", "Desk",
                       "--at", "0", "0", "2", "--library", library_})
                .exit_status,
            0);
  ASSERT_EQ(Maps("rename", {"Desk (2)", "Kiosk"}).exit_status, 0);
  EXPECT_THAT(RunDocent({"content", "list", "--json", "--library", library_}).output,
              HasSubstr("\"to_map\": \"Kiosk\""));
  const Outcome refused = Maps("remove", {"Kiosk"});
  EXPECT_NE(refused.exit_status, 0);
  EXPECT_THAT(refused.output, HasSubstr("the signpost 'sign-2' leads to 'Kiosk'"));
  EXPECT_THAT(refused.errors, HasSubstr("--force"));
  EXPECT_EQ(Maps("remove", {"Kiosk", "--force"}).exit_status, 0);
  EXPECT_THAT(RunDocent({"content", "list", "--json", "--library", library_}).output,
              Not(HasSubstr("Kiosk")));
  EXPECT_THAT(Maps("verify", {}).output, HasSubstr("no problems found"));
}

TEST_F(LibraryCare, RecoversFromThreeQuartersOfAFile) {
  const std::string saved = (folder_ / "saved.docent").string();
  std::filesystem::resize_file(library_, std::filesystem::file_size(library_) * 3 / 4);
  EXPECT_NE(Maps("verify", {}).exit_status, 0);
  const Outcome recovered = Maps("recover", {"--output", saved});
  EXPECT_EQ(recovered.exit_status, 0) << recovered.errors;
  EXPECT_THAT(recovered.output, HasSubstr("recovered completely and"));
  EXPECT_EQ(RunDocent({"maps", "verify", "--library", saved}).exit_status, 0);
  EXPECT_THAT(Content(saved), HasSubstr("sign-1"));
}

}  // namespace
}  // namespace docent::app
