// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <cstdint>
#include <string>
#include <vector>

#include "maps/hub/hub.h"
#include "tests/hub/hub_samples.h"
#include "tests/hub/private_server.h"
#include "tests/hub/two_devices.h"

// The tours of two devices that share a hub.
namespace docent::maps {
namespace {

using testing::HasSubstr;
using testing::Not;

class HubTours : public WithTwoDevices {};

TEST_F(HubTours, ToursStopAtTheSameMaps) {
  {
    Library a = Open("a");
    a.ReserveKeys(3);
    const std::uint64_t desk = AddSampleMap(&a, "Desk", 1), hall = AddSampleMap(&a, "Hall", 2);
    a.ChangeTours([&](std::vector<Tour>* tours) { tours->push_back({"Short", {hall, desk}, "de", 20}); });
  }
  PushFrom("a");
  PullTo("b");
  {
    Library b = Open("b");
    ASSERT_EQ(b.Tours().size(), 1u);
    const Tour tour = b.Tours()[0];
    EXPECT_EQ(tour.stops, (std::vector{b.FindByName("Hall").key, b.FindByName("Desk").key}));
    EXPECT_EQ(tour.minutes, 20);
    b.ChangeTours([](std::vector<Tour>* tours) { tours->front().minutes = 30; });
  }
  PushFrom("b");
  PullTo("a");
  EXPECT_EQ(Open("a").Tours()[0].minutes, 30);
  EXPECT_THAT(PushFrom("a").lines, testing::IsEmpty());
}

TEST_F(HubTours, ATourStaysOneTourWhenAMapOfItIsRemovedOnTheHub) {
  {
    Library a = Open("a");
    a.ReserveKeys(3);
    const std::uint64_t desk = AddSampleMap(&a, "Desk", 1), hall = AddSampleMap(&a, "Hall", 2);
    AddSampleMap(&a, "Shelf", 3);
    a.ChangeTours([&](std::vector<Tour>* tours) { tours->push_back({"Short", {hall, desk}, "de", 20}); });
  }
  PushFrom("a");
  for (const char* device : {"b", "c"}) PullTo(device);
  {
    Library a = Open("a");
    const std::uint64_t shelf = a.FindByName("Shelf").key, desk = a.FindByName("Desk").key;
    a.ChangeTours([&](std::vector<Tour>* tours) { tours->front().stops = {shelf, desk}; });
    a.Remove(a.FindByName("Hall").key);
  }
  SyncOptions options = SampleSync(Url(), folder_ / "a");
  options.remove = true;
  EXPECT_EQ(Push(options).problems, 0);
  {
    Library c = Open("c");
    c.Remove(c.FindByName("Hall").key);
  }
  EXPECT_THAT(LinesOf(PushFrom("c")), Not(HasSubstr("was changed both here and on the hub")));
  for (const char* device : {"b", "c"}) {
    EXPECT_EQ(PullTo(device).problems, 0);
    const Library library = Open(device);
    ASSERT_EQ(library.Tours().size(), 1u) << device;
    EXPECT_EQ(library.Tours()[0].stops,
              (std::vector{library.FindByName("Shelf").key, library.FindByName("Desk").key}));
    EXPECT_THAT(PushFrom(device).lines, testing::IsEmpty()) << device;
  }
}

TEST_F(HubTours, ATourWhoseLanguageIsInCapitalsOnTheHubIsPulled) {
  {
    Library a = Open("a");
    const std::uint64_t desk = AddSampleMap(&a, "Desk", 1);
    a.ChangeTours([&](std::vector<Tour>* tours) { tours->push_back({"Short", {desk}, "", 20}); });
  }
  PushFrom("a");
  RunHubSql(Url(), "UPDATE docent.tours SET language = 'DE'");  // As another client may have saved it.
  EXPECT_EQ(PullTo("b").problems, 0);
  const std::vector<Tour> tours = Open("b").Tours();
  ASSERT_EQ(tours.size(), 1u);
  EXPECT_EQ(tours[0].language, "de");
  EXPECT_THAT(PushFrom("b").lines, testing::IsEmpty());
}

TEST_F(HubTours, ATourWhoseLanguageIsTooLongForALibraryKeepsNoOtherTourAway) {
  {
    Library a = Open("a");
    const std::uint64_t desk = AddSampleMap(&a, "Desk", 1);
    a.ChangeTours([&](std::vector<Tour>* tours) {
      for (const char* name : {"Long", "Short"}) tours->push_back({name, {desk}, "", 20});
    });
  }
  PushFrom("a");
  // As another client may have saved it.
  RunHubSql(
      Url(),
      "UPDATE docent.tours SET language = 'en-x-aaaaaaaa-bbbbbbbb-cccccccc-dddddddd' WHERE name = 'Long'");
  const SyncReport report = PullTo("b");
  EXPECT_EQ(report.problems, 1);
  EXPECT_THAT(LinesOf(report), HasSubstr("The tour 'Long' was not updated: its language has more than 35"));
  const std::vector<Tour> tours = Open("b").Tours();
  ASSERT_EQ(tours.size(), 1u);
  EXPECT_EQ(tours[0].name, "Short");
  EXPECT_EQ(PushFrom("b").problems, 0);
}

TEST_F(HubTours, ATourThatIsDamagedHereStaysOnTheHub) {
  {
    Library a = Open("a");
    const std::uint64_t desk = AddSampleMap(&a, "Desk", 1);
    a.ChangeTours([&](std::vector<Tour>* tours) { tours->push_back({"Short", {desk}, "", 20}); });
  }
  PushFrom("a");
  RunSql(folder_ / "a", "UPDATE tours SET checksum = checksum + 1");
  SyncOptions options = SampleSync(Url(), folder_ / "a");
  options.remove = true;
  EXPECT_GT(Push(options).problems, 0);
  const std::vector<HubTour> tours = Hub(Url()).Tours();
  ASSERT_EQ(tours.size(), 1u);
  EXPECT_FALSE(tours[0].removed);
}

}  // namespace
}  // namespace docent::maps
