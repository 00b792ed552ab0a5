// SPDX-License-Identifier: Apache-2.0
// Leads a visitor through a simulated museum with the real program, and compares where they are sent with
// where the bays of the museum are.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "app/files/text_file.h"
#include "engine/geometry/sim3.h"
#include "tests/end_to_end/five_stops.h"
#include "tests/end_to_end/mapped_museum.h"
#include "tests/end_to_end/run_docent.h"

namespace docent::app {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class FiveStops : public ::testing::Test {
 protected:
  // Visits the museum and writes its files to folder() / "tour".
  void Visit() {
    const MappedMuseum& mapped = stops_.mapped();
    const TrueMuseum& museum = mapped.museum();
    const double from = stops_.from_s(), until = stops_.until_s();
    const auto at = [&](const std::string& label, double share) {
      return FormatNumber(museum.Begin(label) + share * (museum.End(label) - museum.Begin(label)) - from);
    };
    const std::string back = at("visit0", 0.8) + " tour back\n";
    const std::string card = at("visit4", 0.4) + " tour open sign-1\n" + at("visit4", 0.6) + " tour close\n";
    mapped.folder().Write("visit.txt", back + back + back + card + at("visit4", 0.8) + " tour skip\n");
    mapped.Succeed({"tour", "--library", mapped.library(), "--camera", "sim:" + mapped.spec(), "--from",
                    FormatNumber(from), "--until", FormatNumber(until), "--pace", "lockstep", "--headless",
                    "--tour", stops_.name(), "--narrate", "--script",
                    (mapped.folder() / "visit.txt").string(), "--output", Tour().string()});
  }
  std::filesystem::path Tour() const { return stops_.mapped().folder() / "tour"; }

  FiveStopsMuseum stops_;
};

TEST_F(FiveStops, AreReachedWithADetourALossAndASkippedStopAlongTrueDirections) {
  Visit();
  EXPECT_THAT(EventsOf("tour", Tour() / "events.csv"),
              ::testing::ElementsAreArray(FiveStopsMuseum::ToldOfTour()));

  // Across the hall, Bay 1 looks like the others, but has no map.
  const TrueMuseum& museum = stops_.mapped().museum();
  double lost_s = 0, last_s = museum.Begin("visit3");
  std::set<std::string> only_turned;  // The times of the images of which only the rotation is known.
  for (const Row& row : ReadFrames(Tour() / "frames.csv")) {
    if (row.at("state") == "panorama") only_turned.insert(row.at("timestamp"));
    const double seconds = ToSeconds(*ParseSeconds(row.at("timestamp")));
    if (row.at("map").empty() || seconds < last_s) continue;
    lost_s = std::max(lost_s, seconds - std::exchange(last_s, seconds));
  }
  EXPECT_GE(lost_s, 1);

  EXPECT_THAT(EventsOf("card", Tour() / "events.csv"), ElementsAre("'sign-1' opened"));
  // What was spoken, for a visitor who cannot see it.
  const std::vector<std::string> spoken = EventsOf("narration", Tour() / "events.csv");
  auto named = spoken.begin();
  for (const char* place : {"Bay 4", "Bay 5", "Bay 3", "Bay 0", "Bay 4"}) {
    named = std::find(named, spoken.end(), place);
    EXPECT_TRUE(named != spoken.end()) << place << " in " << testing::PrintToString(spoken);
  }
  EXPECT_THAT(spoken, Contains("Stop 1 of 5. Next: Bay 5"));
  EXPECT_THAT(spoken, Contains("To Bay 5")) << "a signpost is read";
  EXPECT_THAT(spoken, Contains(HasSubstr(": To Bay 5"))) << "the side of the way on is said";
  EXPECT_THAT(spoken, Contains(HasSubstr("The tour ends here."))) << testing::PrintToString(spoken);

  // Where the visitor was sent from where, and how.
  std::map<std::string, int> ways;
  double worst_deg = 0;
  for (const Row& row : ReadFrames(Tour() / "guidance.csv")) {
    // A visitor who walks while only the rotation is known is taken to stand where they were.
    if (only_turned.contains(row.at("timestamp"))) continue;
    ++ways[row.at("map") + " to " + row.at("to") + " by " + row.at("towards")];
    const double error_deg = stops_.ErrorOf_deg(row, museum);
    EXPECT_LT(error_deg, 15) << testing::PrintToString(row);
    worst_deg = std::max(worst_deg, error_deg);
  }
  RecordProperty("worst_direction_error_deg", FormatNumber(worst_deg, 3));
  SCOPED_TRACE(testing::PrintToString(ways));
  for (const char* way :
       {"Bay 4 to Bay 5 by direction", "Bay 5 to Bay 3 by direction", "Bay 3 to Bay 0 by direction"})
    EXPECT_GE(ways[way], 5) << way;
}

// Two maps of one bay, and one of another.
TEST(FoundDirection, LeadsToWhereAMapOfTheSamePlaceBegins) {
  MappedMuseum mapped("museum:2,fps=15");
  const TrueMuseum& museum = mapped.museum();
  const double half = 0.55 * museum.End("build0"), far = museum.Begin("build1");
  mapped.Author("0 map new \"Left\"\n" + FormatNumber(half) + " map stop\n" + FormatNumber(half + 0.1) +
                    " map new \"Right\"\n" + FormatNumber(museum.End("build0")) + " map stop\n" +
                    FormatNumber(far) + " map new \"Far\"\n",
                museum.End("build1"));
  const std::vector<Row> frames = ReadFrames(mapped.folder() / "author/frames.csv");
  const engine::Sim3 world_from_left = WorldFromMap(museum, frames, "Left");
  const auto first_right =
      std::find_if(frames.begin(), frames.end(), [](const Row& row) { return row.at("map") == "Right"; });
  ASSERT_TRUE(first_right != frames.end());
  const auto sign_to = [&](const char* to) {
    std::vector<std::string> arguments = {"content",  "add",   "--signpost", to,          "--to",
                                          to,         "--map", "Left",       "--library", mapped.library(),
                                          "--height", "0.01",  "--at"};
    AppendNumbers(world_from_left.inverse() * museum.FrontOf(0), &arguments);
    return mapped.Succeed(arguments);
  };
  EXPECT_EQ(sign_to("Right"), "sign-1\n");
  EXPECT_EQ(sign_to("Far"), "sign-2\n");
  mapped.Succeed(
      {"content", "edit", "sign-1", "--find-direction", "--map", "Left", "--library", mapped.library()});
  const auto signs = nlohmann::json::parse(
      mapped.Succeed({"content", "list", "--json", "--map", "Left", "--library", mapped.library()}));
  const auto& found = signs.at("content").at(0).at("direction");
  ASSERT_TRUE(found.is_array()) << signs;
  const Eigen::Vector3d direction(found.at(0), found.at(1), found.at(2));
  const Eigen::Vector3d truth =
      museum.CameraAt(*ParseSeconds(first_right->at("timestamp"))).translation - museum.FrontOf(0);
  EXPECT_LT(AngleApart_deg(world_from_left.rotation * direction, truth), 15);
  EXPECT_TRUE(signs.at("content").at(1).at("direction").is_null());
  ExpectErrorLine(
      {"content", "edit", "sign-2", "--find-direction", "--map", "Left", "--library", mapped.library()}, 1,
      "where 'Far' begins is not known from here");
}

}  // namespace
}  // namespace docent::app
