// SPDX-License-Identifier: Apache-2.0
// The complete program with cameras of unknown calibration.
#include <gmock/gmock.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "app/files/text_file.h"
#include "maps/library/library.h"
#include "tests/end_to_end/run_docent.h"

namespace docent::app {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::SizeIs;

TEST(UnknownCalibration, EvaluateEstimatesAndReportsIt) {
  const TemporaryFolder folder;
  const std::string output = (folder / "report").string();
  const Outcome outcome = RunDocent({"evaluate", "sim:room,field-of-view=75,duration=4", "--calibration",
                                     "auto", "--output", output, "--pace", "lockstep"});
  ASSERT_EQ(outcome.exit_status, 0) << outcome.errors;
  const auto report = nlohmann::json::parse(ReadAll(output + "/report.json"));
  const auto& lens = report.at("sequences").at(0).at("lens");
  EXPECT_NEAR(lens.at("focal_px").get<double>(), 320 / std::tan(37.5 * M_PI / 180), 0.03 * 417);
  EXPECT_GT(lens.at("focal_sigma_percent").get<double>(), 0);
  EXPECT_THAT(ReadAll(output + "/report.html"), HasSubstr("estimated focal length"));
}

TEST(UnknownCalibration, TheLibraryStoresTheEstimateForALaterTour) {
  const TemporaryFolder folder;
  const std::string library = (folder / "room.docent").string(),
                    camera = "sim:room,field-of-view=75,duration=4";
  folder.Write("script.txt", "0 map new \"Room\"\n");
  const Outcome built =
      RunDocent({"author", "--library", library, "--camera", camera, "--calibration", "auto", "--headless",
                 "--pace", "lockstep", "--script", (folder / "script.txt").string()});
  ASSERT_EQ(built.exit_status, 0) << built.errors;
  const auto lenses = maps::Library::Open(library, maps::Access::kReadOnly).Lenses();
  ASSERT_THAT(lenses, SizeIs(1));
  EXPECT_EQ(lenses[0].camera, "room,field-of-view=75,duration=4");
  EXPECT_LE(lenses[0].focal_sigma, 0.1);
  const double truth = 320 / std::tan(37.5 * M_PI / 180);
  EXPECT_LT(std::abs(std::log(lenses[0].model.intrinsics().fx / truth)), 4 * lenses[0].focal_sigma);
  const auto tour = [&](const std::string& seen, const std::string& name) {
    const std::string output = (folder / name).string();
    const Outcome outcome = RunDocent({"tour", "--library", library, "--camera", seen, "--calibration",
                                       "auto", "--headless", "--pace", "lockstep", "--output", output});
    EXPECT_EQ(outcome.exit_status, 0) << outcome.errors;
    return ReadAll(output + "/events.csv");
  };
  const std::string known = tour(camera, "known");
  EXPECT_THAT(known, HasSubstr("entered Room"));
  EXPECT_THAT(known, Not(HasSubstr("is not in this library")));
  const std::string other = "sim:room,field-of-view=76,duration=1";
  EXPECT_THAT(tour(other, "unknown"), HasSubstr("is not in this library"));
  const Outcome without_output = RunDocent({"tour", "--library", library, "--camera", other, "--calibration",
                                            "auto", "--headless", "--pace", "lockstep"});
  EXPECT_THAT(without_output.errors, HasSubstr("is not in this library")) << "nothing else would say so";
}

}  // namespace
}  // namespace docent::app
