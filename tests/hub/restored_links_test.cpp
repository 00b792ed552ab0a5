// SPDX-License-Identifier: Apache-2.0
#include "maps/hub/restored_links.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

// What a device and a restored hub still have in common.
namespace docent::maps {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

MapLink LinkAt(std::int64_t revision, const std::string& restoration = "") {
  MapLink link;
  link.key = 3;
  link.id = "m";
  link.revision = revision;
  link.stamp = "stamp";
  link.restoration = restoration;
  return link;
}

HubRestoration RestoredAt(const std::string& id, std::int64_t revision) {
  return {id, {{"m", revision}}, {{"m", revision}}};
}

// The link after a restoration; its revision, and "changed" if it counts as changed here.
std::string Remaining(const std::vector<HubRestoration>& restorations, MapLink link, std::int64_t on_hub,
                      bool may_save = true) {
  std::vector<MapLink> links = {std::move(link)};
  ForgetLostRevisions(restorations, {{"m", on_hub, 1, "Desk", false}}, may_save, &links);
  return std::to_string(links[0].revision) + (links[0].stamp.empty() ? " changed" : "");
}

TEST(RestoredLinks, ALinkToARevisionThatTheHubHasStays) {
  EXPECT_EQ(Remaining({}, LinkAt(5), 5), "5");
  EXPECT_EQ(Remaining({}, LinkAt(5), 8), "5") << "the hub is newer";
  EXPECT_EQ(Remaining({RestoredAt("first", 5)}, LinkAt(5), 5), "5");
  EXPECT_EQ(Remaining({RestoredAt("first", 5)}, LinkAt(4), 7), "4");
  EXPECT_EQ(Remaining({RestoredAt("first", 5)}, LinkAt(6, "first"), 7), "6") << "agreed on after it";
}

TEST(RestoredLinks, AMapThatNobodySavedSinceCountsAsChangedHere) {
  EXPECT_EQ(Remaining({RestoredAt("first", 5)}, LinkAt(6), 5), "5 changed");
  EXPECT_EQ(Remaining({RestoredAt("first", 5)}, LinkAt(6), 5, false), "5 changed");
  EXPECT_EQ(Remaining({}, LinkAt(6), 5), "5 changed") << "restored by other means";
  std::vector<MapLink> links = {LinkAt(6)};
  EXPECT_THAT(ForgetLostRevisions({RestoredAt("first", 5)}, {{"m", 5, 1, "Desk", false}}, true, &links),
              ElementsAre(3u));
}

TEST(RestoredLinks, AMapThatOthersSavedSinceIsComparedAnew) {
  for (const std::int64_t on_hub : {6, 7, 8})
    EXPECT_EQ(Remaining({RestoredAt("first", 5)}, LinkAt(7), on_hub), "0 changed") << on_hub;
  EXPECT_EQ(Remaining({RestoredAt("first", 5)}, LinkAt(7), 6, false), "5") << "a visitor takes the hub's";
}

TEST(RestoredLinks, AMapThatTheBackupLackedIsTakenFromTheHubByAVisitor) {
  const HubRestoration without{"first", {}, {}};
  for (const std::int64_t on_hub : {1, 2, 3}) {
    EXPECT_EQ(Remaining({without}, LinkAt(2), on_hub), "0 changed") << on_hub;
    EXPECT_EQ(Remaining({without}, LinkAt(2), on_hub, false), std::to_string(on_hub + 1));
  }
}

TEST(RestoredLinks, EachLaterRestorationCounts) {
  const std::vector<HubRestoration> both = {RestoredAt("first", 5), RestoredAt("second", 8)};
  EXPECT_EQ(Remaining(both, LinkAt(5), 8), "5");
  EXPECT_EQ(Remaining(both, LinkAt(6), 8), "0 changed") << "lost by the first one";
  EXPECT_EQ(Remaining(both, LinkAt(8, "first"), 8), "8");
  EXPECT_EQ(Remaining(both, LinkAt(9, "first"), 8), "8 changed");
  EXPECT_EQ(Remaining(both, LinkAt(9, "second"), 9), "9");
  EXPECT_EQ(Remaining({RestoredAt("second", 8)}, LinkAt(6, "first"), 8), "0 changed")
      << "the backup was made before the first one";
  EXPECT_EQ(Remaining({RestoredAt("second", 8)}, LinkAt(9, "first"), 8, false), "8 changed")
      << "nobody has saved since, so that the hub's state is an older one";
  EXPECT_EQ(Remaining({RestoredAt("second", 8)}, LinkAt(9, "first"), 9, false), "10")
      << "a visitor takes what others have saved since";
}

TEST(RestoredLinks, ToursFollowTheSameRules) {
  const auto remaining = [](std::int64_t revision, std::int64_t on_hub, bool may_save) {
    std::vector<TourLink> links = {{"m", revision, "content", ""}, {"gone", 1, "content", ""}};
    HubTour tour;
    tour.name = "m";
    tour.revision = on_hub;
    ForgetLostRevisions({RestoredAt("first", 5)}, {tour}, may_save, &links);
    return links;
  };
  ASSERT_EQ(remaining(5, 6, true).size(), 1u) << "a tour that the hub has lost";
  EXPECT_EQ(remaining(5, 6, true)[0].content, "content");
  ASSERT_EQ(remaining(6, 5, true).size(), 1u);
  EXPECT_EQ(remaining(6, 5, true)[0].revision, 5);
  EXPECT_NE(remaining(6, 5, true)[0].content, "content");
  EXPECT_THAT(remaining(6, 6, true), IsEmpty());
  ASSERT_EQ(remaining(6, 6, false).size(), 1u);
  EXPECT_EQ(remaining(6, 6, false)[0].revision, 5);
  EXPECT_EQ(remaining(6, 6, false)[0].content, "content");
}

}  // namespace
}  // namespace docent::maps
