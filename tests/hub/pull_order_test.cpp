// SPDX-License-Identifier: Apache-2.0
#include "maps/hub/pull_order.h"

#include <gmock/gmock.h>

#include "tests/hub/hub_samples.h"
#include "tests/hub/private_server.h"

// Which maps a device gets first.
namespace docent::maps {
namespace {

using testing::ElementsAre;

std::vector<HubHead> HeadsOf(const std::vector<std::string>& ids) {
  std::vector<HubHead> heads;
  for (const std::string& id : ids) heads.push_back({id, 1, 1, id, false});
  return heads;
}
std::vector<std::string> IdsOf(const std::vector<HubHead>& heads) {
  std::vector<std::string> ids;
  for (const HubHead& head : heads) ids.push_back(head.id);
  return ids;
}

TEST(PullOrder, FollowsTheWaysFromTheVisitor) {
  const WaysBetweenMaps ways = {{"a", "b"}, {"b", "c"}, {"e", "c"}};
  EXPECT_THAT(IdsOf(NearestFirst(HeadsOf({"a", "x", "b", "c", "e"}), {"c"}, ways)),
              ElementsAre("c", "b", "e", "a", "x"));
  EXPECT_THAT(IdsOf(NearestFirst(HeadsOf({"b", "a"}), {}, ways)), ElementsAre("b", "a"));
}

TEST(PullOrder, ToursThatWereRemovedAreNoWays) {
  EXPECT_THAT(WaysOfTours({{"t", 1, "", 0, {"a", "b", "c"}, false}, {"u", 1, "", 0, {"a", "c"}, true}}),
              ElementsAre(std::pair("a", "b"), std::pair("b", "c")));
}

class HubPullOrder : public WithHubServer {
 protected:
  // Maps in this order, and a tour from the hall over the stairs to the attic.
  void ShareMuseum() {
    Library a = OpenSampleLibrary(folder_ / "a");
    std::uint64_t seed = 1;
    for (const char* name : {"Attic", "Cellar", "Hall", "Stairs"}) AddSampleMap(&a, name, ++seed);
    Tour tour;
    tour.name = "All";
    for (const char* name : {"Hall", "Stairs", "Attic"}) tour.stops.push_back(a.FindByName(name).key);
    a.ChangeTours([&](std::vector<Tour>* tours) { tours->push_back(tour); });
  }
  static std::string FirstWords(const SyncReport& report) {
    std::string words;
    for (const std::string& line : report.lines) words += line.substr(0, line.find(' ')) + " ";
    return words;
  }

  TemporaryFolder folder_;
};

TEST_F(HubPullOrder, ANewDeviceGetsWhereItIsFirst) {
  ShareMuseum();
  Push(SampleSync(Url(), folder_ / "a"));
  SyncOptions options = SampleSync(Url(), folder_ / "b");
  options.near = "Hall";
  EXPECT_THAT(FirstWords(Pull(options)), testing::StartsWith("'Hall' 'Stairs' 'Attic' 'Cellar' "));
}

TEST_F(HubPullOrder, WhatWasInterruptedGoesOnNearTheVisitor) {
  ShareMuseum();
  Push(SampleSync(Url(), folder_ / "a"));
  SyncOptions options = SampleSync(Url(), folder_ / "b");
  options.near = "Stairs";
  options.bytes_per_second = 20'000'000;
  int asked = 0;
  options.is_stopped = [&] { return ++asked > 12; };
  SyncReport first;
  try {
    first = Pull(options);
  } catch (const Error&) {
    asked = 0;  // It was interrupted, as it should be.
  }
  ASSERT_EQ(asked, 0) << "all was received before the interruption";
  options.is_stopped = nullptr;
  options.near = "Cellar";
  const SyncReport rest = Pull(options);
  EXPECT_EQ(rest.problems, 0);
  Library b = OpenSampleLibrary(folder_ / "b");
  EXPECT_EQ(NamesIn(b), "Attic,Cellar,Hall,Stairs");
  EXPECT_THAT(FirstWords(rest), testing::StartsWith("'Cellar' "));
}

TEST_F(HubPullOrder, AnUnknownPlaceIsRefused) {
  ShareMuseum();
  Push(SampleSync(Url(), folder_ / "a"));
  SyncOptions options = SampleSync(Url(), folder_ / "b");
  options.near = "Nowhere";
  EXPECT_THROW(Pull(options), Error);
}

}  // namespace
}  // namespace docent::maps
