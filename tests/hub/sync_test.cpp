// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <algorithm>
#include <utility>

#include "app/session/library_scene.h"
#include "maps/hub/administration.h"
#include "maps/hub/hub.h"
#include "maps/hub/sync_session.h"
#include "maps/hub/sync_state.h"
#include "tests/hub/hub_samples.h"
#include "tests/hub/private_server.h"

// Two devices, whose libraries are `a` and `b`, share a hub.
namespace docent::maps {
namespace {

using testing::HasSubstr;
using testing::Not;

class HubSync : public WithHubServer {
 protected:
  SyncReport PushFrom(const std::string& name) { return Push(SampleSync(Url(), folder_ / name)); }
  SyncReport PullTo(const std::string& name) { return Pull(SampleSync(Url(), folder_ / name)); }
  Library Open(const std::string& name) { return OpenSampleLibrary(folder_ / name); }

  // A map that both devices have.
  std::uint64_t ShareMap(const std::string& name, Policy policy = Policy::kOpen) {
    {
      Library a = Open("a");
      AddSampleMap(&a, name, 7, policy);
    }
    PushFrom("a");
    PullTo("b");
    return Open("b").FindByName(name).key;
  }

  TemporaryFolder folder_;
};

TEST_F(HubSync, AMapArrivesAsItIs) {
  {
    Library a = Open("a");
    a.ReserveKeys(5);  // So that its keys differ from those of the other library.
    AddSampleMap(&a, "Desk", 1);
    AddSampleMap(&a, "Hall", 2, Policy::kBounded);
  }
  EXPECT_THAT(LinesOf(PushFrom("a")), HasSubstr("'Desk' was added to the hub"));
  EXPECT_THAT(LinesOf(PullTo("b")), HasSubstr("'Hall' was added"));
  EXPECT_EQ(DifferenceOf("Desk", folder_ / "a", folder_ / "b"), "");
  EXPECT_EQ(DifferenceOf("Hall", folder_ / "a", folder_ / "b"), "");
  EXPECT_THAT(Open("b").Verify(), testing::IsEmpty());
  EXPECT_THAT(PushFrom("a").lines, testing::IsEmpty()) << "nothing has changed since";
  EXPECT_THAT(PullTo("b").lines, testing::IsEmpty());
}

TEST_F(HubSync, ASmallMapWithLargeImagesIsReceivedByANewDevice) {
  {
    Library a = Open("a");
    MapRecord record;
    record.key = a.NewKey();
    record.name = "Desk";
    // Both images together are smaller than what SQLite keeps in memory before it writes any of it.
    record.snapshot = MakeSampleMap(1, {.keyframes = 2, .points = 5, .width_px = 1280, .height_px = 960});
    record.scene = std::make_shared<const SceneRecord>(app::RecordFromScene(content::Scene()));
    a.Save(record);
  }
  EXPECT_EQ(PushFrom("a").problems, 0);
  const SyncReport report = PullTo("b");
  EXPECT_EQ(report.problems, 0) << LinesOf(report);
  EXPECT_EQ(DifferenceOf("Desk", folder_ / "a", folder_ / "b"), "");
}

TEST_F(HubSync, OnlyWhatChangedIsTransferred) {
  ShareMap("Desk");
  std::uint64_t key = 0;
  {
    Library a = Open("a");
    key = a.FindByName("Desk").key;
    EditScene(&a, key,
              [](content::Scene* scene) { scene->entities.push_back(SampleSignpost("sign-2", "New")); });
  }
  const SyncReport push = PushFrom("a");
  EXPECT_LT(push.bytes_sent, 2000u) << "images were sent again";
  const SyncReport pull = PullTo("b");
  EXPECT_LT(pull.bytes_received, 2000u);
  const Library b = Open("b");
  EXPECT_EQ(TextsIn(b, b.FindByName("Desk").key), "sign-1=Hello sign-2=New");
}

TEST_F(HubSync, SignpostsLeadToTheSameMapEverywhere) {
  {
    Library a = Open("a");
    a.ReserveKeys(9);
    const std::uint64_t desk = AddSampleMap(&a, "Desk", 1), hall = AddSampleMap(&a, "Hall", 2);
    EditScene(&a, desk, [&](content::Scene* scene) { scene->entities[0].signpost.to_key = hall; });
  }
  PushFrom("a");
  PullTo("b");
  {
    Library b = Open("b");
    const std::uint64_t hall = b.FindByName("Hall").key;
    ASSERT_EQ(b.SignpostsTo(hall).size(), 1u);
    b.Rename(hall, "Great Hall");
  }
  PushFrom("b");
  PullTo("a");
  const Library a = Open("a");
  EXPECT_EQ(a.SignpostsTo(a.FindByName("Great Hall").key).size(), 1u);
}

TEST_F(HubSync, EditsOfTwoCuratorsAreMergedByEntity) {
  const std::uint64_t on_b = ShareMap("Desk");
  {
    Library a = Open("a"), b = Open("b");
    EditScene(&a, a.FindByName("Desk").key,
              [](content::Scene* scene) { scene->entities.push_back(SampleSignpost("from-a", "A")); });
    EditScene(&b, on_b, [](content::Scene* scene) {
      scene->entities[0].signpost.text = "Changed";
      scene->entities.push_back(SampleSignpost("from-b", "B"));
    });
  }
  PushFrom("a");
  const SyncReport merged = PushFrom("b");
  EXPECT_THAT(LinesOf(merged), HasSubstr("were merged as revision 3"));
  EXPECT_EQ(merged.problems, 0);
  PullTo("a");
  const Library a = Open("a"), b = Open("b");
  EXPECT_EQ(TextsIn(a, a.FindByName("Desk").key), "sign-1=Changed from-a=A from-b=B");
  EXPECT_EQ(TextsIn(b, on_b), "sign-1=Changed from-a=A from-b=B");
}

TEST_F(HubSync, OfAnEntityThatTwoCuratorsChangedBothVersionsAreKept) {
  const std::uint64_t on_b = ShareMap("Desk");
  {
    Library a = Open("a"), b = Open("b");
    EditScene(&a, a.FindByName("Desk").key,
              [](content::Scene* scene) { scene->entities[0].signpost.text = "A"; });
    EditScene(&b, on_b, [](content::Scene* scene) { scene->entities[0].signpost.text = "B"; });
  }
  PushFrom("a");
  EXPECT_THAT(LinesOf(PushFrom("b")), HasSubstr("'sign-1' was changed by both"));
  EXPECT_EQ(TextsIn(Open("b"), on_b), "sign-1=A sign-1-2=B");
  EXPECT_THAT(PushFrom("b").lines, testing::IsEmpty());
}

TEST_F(HubSync, APullKeepsChangesThatWereNotPushed) {
  const std::uint64_t on_b = ShareMap("Desk");
  {
    Library a = Open("a"), b = Open("b");
    EditScene(&a, a.FindByName("Desk").key,
              [](content::Scene* scene) { scene->entities.push_back(SampleSignpost("from-a", "A")); });
    EditScene(&b, on_b, [](content::Scene* scene) { scene->entities[0].signpost.text = "B"; });
  }
  PushFrom("a");
  EXPECT_THAT(LinesOf(PullTo("b")), HasSubstr("the changes were merged here"));
  EXPECT_EQ(TextsIn(Open("b"), on_b), "sign-1=B from-a=A");
  EXPECT_THAT(LinesOf(PushFrom("b")), HasSubstr("was saved on the hub as revision 3"));
  PullTo("a");
  EXPECT_EQ(DifferenceOf("Desk", folder_ / "a", folder_ / "b"), "");
}

TEST_F(HubSync, ARenamingIsPushedAlsoAfterAPullThatMerged) {
  const std::uint64_t on_b = ShareMap("Desk");
  AddSampleSignpost(folder_ / "a", "Desk", "from-a", "A");
  Open("b").Rename(on_b, "Table");
  PushFrom("a");
  EXPECT_EQ(PullTo("b").problems, 0);
  EXPECT_EQ(NamesIn(Open("b")), "Table");
  AddSampleSignpost(folder_ / "a", "Desk", "again-from-a", "A");
  PushFrom("a");
  EXPECT_EQ(PullTo("b").problems, 0) << "before the new name was pushed";
  PushFrom("b");
  PullTo("a");
  EXPECT_EQ(NamesIn(Open("a")), "Table");
  EXPECT_EQ(TextsIn(Open("a"), Open("a").FindByName("Table").key), "sign-1=Hello from-a=A again-from-a=A");
  EXPECT_EQ(DifferenceOf("Table", folder_ / "a", folder_ / "b"), "");
  EXPECT_THAT(PushFrom("b").lines, testing::IsEmpty());
}

// As two tours with one library, which the hub tells of a new map at the same time.
TEST_F(HubSync, TwoPullsOfOneLibraryGiveANewMapTheSameKey) {
  ShareMap("Desk");
  const SyncOptions options = SampleSync(Url(), folder_ / "b");
  {
    Library a = Open("a");
    AddSampleMap(&a, "Hall", 2);
  }
  PushFrom("a");
  SyncSession one(options, CreateIfMissing::kNo), other(options, CreateIfMissing::kNo);
  const HubHead* const head = one.HeadNamed("Hall");
  ASSERT_NE(head, nullptr);
  one.AddLinks({head->id});
  other.AddLinks({head->id});
  ASSERT_NE(other.LinkTo(head->id), nullptr);
  EXPECT_EQ(other.LinkTo(head->id)->key, one.LinkTo(head->id)->key);
  EXPECT_EQ(PullTo("b").problems, 0);
  EXPECT_EQ(NamesIn(Open("b")), "Desk,Hall");
}

TEST_F(HubSync, AMapWhoseKeyframesTwoChangedBecomesTwoMaps) {
  const std::uint64_t on_b = ShareMap("Desk");
  {
    Library a = Open("a"), b = Open("b");
    ExtendMap(&a, a.FindByName("Desk").key, {0.1, 0, 0}, 51);
    ExtendMap(&b, on_b, {0.2, 0, 0}, 52);
  }
  PushFrom("a");
  EXPECT_THAT(LinesOf(PushFrom("b")), HasSubstr("both versions are kept"));
  PullTo("b");
  PullTo("a");
  EXPECT_EQ(NamesIn(Open("a")), "Desk,Desk (2)");
  EXPECT_EQ(NamesIn(Open("b")), "Desk,Desk (2)");
  EXPECT_EQ(DifferenceOf("Desk", folder_ / "a", folder_ / "b"), "");
  EXPECT_EQ(DifferenceOf("Desk (2)", folder_ / "a", folder_ / "b"), "");
}

TEST_F(HubSync, KeyframesOfOneAndContentOfTheOtherGoTogether) {
  const std::uint64_t on_b = ShareMap("Desk");
  {
    Library a = Open("a"), b = Open("b");
    ExtendMap(&a, a.FindByName("Desk").key, {0.1, 0, 0}, 51);
    EditScene(&b, on_b, [](content::Scene* scene) { scene->entities[0].signpost.text = "B"; });
  }
  PushFrom("a");
  EXPECT_THAT(LinesOf(PushFrom("b")), HasSubstr("were merged"));
  PullTo("a");
  EXPECT_EQ(DifferenceOf("Desk", folder_ / "a", folder_ / "b"), "");
  EXPECT_EQ(TextsIn(Open("a"), Open("a").FindByName("Desk").key), "sign-1=B");
}

TEST_F(HubSync, TwoMapsOfOneNameStayTwoMaps) {
  {
    Library a = Open("a"), b = Open("b");
    AddSampleMap(&a, "Desk", 1);
    AddSampleMap(&b, "Desk", 2);
  }
  PushFrom("a");
  EXPECT_THAT(LinesOf(PushFrom("b")), HasSubstr("this one is now 'Desk (2)'"));
  PullTo("a");
  EXPECT_EQ(NamesIn(Open("a")), "Desk,Desk (2)");
}

TEST_F(HubSync, AMergingPushGivesAMapAnotherNameHereWhereTheHubsNameIsTaken) {
  const std::uint64_t on_b = ShareMap("Desk");
  {
    Library a = Open("a"), b = Open("b");
    a.Rename(a.FindByName("Desk").key, "Hall");
    AddSampleMap(&b, "Hall", 8);
  }
  AddSampleSignpost(folder_ / "b", "Desk", "from-b", "B");
  PushFrom("a");
  const SyncReport report = PushFrom("b");
  EXPECT_EQ(report.problems, 0) << LinesOf(report);
  EXPECT_EQ(TextsIn(Open("b"), on_b), "sign-1=Hello from-b=B");
  EXPECT_THAT(PushFrom("b").lines, testing::IsEmpty());
  PullTo("a");
  EXPECT_EQ(TextsIn(Open("a"), Open("a").FindByName("Hall").key), "sign-1=Hello from-b=B");
  EXPECT_EQ(Open("a").List().size(), 2u);
}

TEST_F(HubSync, ACopyOfALibraryIsNotADuplicate) {
  ShareMap("Desk");
  std::filesystem::copy_file(folder_ / "a", folder_ / "copy");
  EXPECT_THAT(LinesOf(PushFrom("copy")), HasSubstr("the same map as on the hub"));
  EXPECT_THAT(PullTo("copy").lines, testing::IsEmpty());
  EXPECT_EQ(NamesIn(Open("copy")), "Desk");
}

TEST_F(HubSync, AnEqualMapTakesTheHubsPolicyWhenTheRecordOfTheExchangeIsLost) {
  ShareMap("Desk");
  PullTo("c");
  {
    Library a = Open("a");
    a.SetPolicy(a.FindByName("Desk").key, Policy::kReadOnly);
  }
  PushFrom("a");
  for (const char* device : {"b", "c"}) std::filesystem::remove(SyncStatePath(folder_ / device));
  EXPECT_EQ(PullTo("b").problems, 0);
  EXPECT_EQ(PushFrom("c").problems, 0);
  EXPECT_EQ(Hub(Url()).Heads().at(0).revision, 2) << "nothing is to be saved there";
  for (const char* device : {"b", "c"}) {
    EXPECT_EQ(NamesIn(Open(device)), "Desk") << device;
    EXPECT_EQ(Open(device).FindByName("Desk").policy, Policy::kReadOnly) << device;
    EXPECT_THAT(PushFrom(device).lines, testing::IsEmpty()) << device;
    EXPECT_THAT(PullTo(device).lines, testing::IsEmpty()) << device;
  }
}

TEST_F(HubSync, AMapIsRemovedOnBothSidesOnlyIfThatIsAskedFor) {
  ShareMap("Desk");
  {
    Library a = Open("a");
    a.Remove(a.FindByName("Desk").key);
  }
  EXPECT_THAT(LinesOf(PushFrom("a")), HasSubstr("with --removed"));
  SyncOptions options = SampleSync(Url(), folder_ / "a");
  options.remove = true;
  EXPECT_THAT(LinesOf(Push(options)), HasSubstr("was removed from the hub"));
  EXPECT_THAT(LinesOf(PullTo("b")), HasSubstr("and so here"));
  EXPECT_EQ(NamesIn(Open("b")), "");
}

TEST_F(HubSync, AMapThatIsRemovedDuringAPushIsRemovedByTheNext) {
  ShareMap("Desk");
  {
    Library a = Open("a");
    AddSampleMap(&a, "Shelf", 9);
  }
  SyncOptions options = SampleSync(Url(), folder_ / "a");
  options.remove = true;
  bool is_removed = false;
  options.is_stopped = [&] {
    // The other map is being sent.
    if (!std::exchange(is_removed, true)) {
      Library a = Open("a");
      a.Remove(a.FindByName("Desk").key);
    }
    return false;
  };
  EXPECT_EQ(Push(options).problems, 0);
  ASSERT_TRUE(is_removed);
  const std::vector<HubHead> heads = Hub(Url()).Heads();
  EXPECT_TRUE(std::none_of(heads.begin(), heads.end(), [](const HubHead& head) { return head.removed; }));
  EXPECT_THAT(LinesOf(Push(options)), HasSubstr("'Desk' was removed from the hub"));
}

TEST_F(HubSync, AMapGetsTheNameOfOneThatIsRemovedByTheSamePush) {
  ShareMap("Desk");
  {
    Library a = Open("a");
    AddSampleMap(&a, "Shelf", 9);
  }
  PushFrom("a");
  PullTo("b");
  {
    Library a = Open("a");
    a.Remove(a.FindByName("Desk").key);
    AddSampleMap(&a, "Desk", 8);  // Built anew.
  }
  SyncOptions options = SampleSync(Url(), folder_ / "a");
  options.remove = true;
  SyncReport report = Push(options);
  EXPECT_EQ(report.problems, 0) << LinesOf(report);
  PullTo("b");
  EXPECT_EQ(NamesIn(Open("a")), "Desk,Shelf");
  EXPECT_EQ(NamesIn(Open("b")), "Desk,Shelf");
  EXPECT_EQ(DifferenceOf("Desk", folder_ / "a", folder_ / "b"), "");
  {
    Library a = Open("a");
    a.Remove(a.FindByName("Desk").key);
    ExtendMap(&a, a.FindByName("Shelf").key, {0.1, 0, 0}, 51);
    a.Rename(a.FindByName("Shelf").key, "Desk");
  }
  report = Push(options);
  EXPECT_EQ(report.problems, 0) << LinesOf(report);
  EXPECT_THAT(Push(options).lines, testing::IsEmpty());
  PullTo("b");
  EXPECT_EQ(NamesIn(Open("a")), "Desk");
  EXPECT_EQ(DifferenceOf("Desk", folder_ / "a", folder_ / "b"), "");
}

TEST_F(HubSync, AMapThatWasJoinedStaysOnTheHubUntilTheJoinedMapIsSaved) {
  {
    Library a = Open("a");
    const std::uint64_t desk = AddSampleMap(&a, "Desk", 1, Policy::kBounded);
    const std::uint64_t shelf = AddSampleMap(&a, "Shelf", 2);
    a.ChangeTours([&](std::vector<Tour>* tours) { tours->push_back({"All", {desk, shelf}, "", 20}); });
  }
  PushFrom("a");
  {
    Library a = Open("a");
    const StoredMap desk = a.Load(a.FindByName("Desk").key);
    const auto joined = std::make_shared<engine::MapSnapshot>(*desk.snapshot);
    AddSampleKeyFrame(51, {9, 0, 0}, joined.get());
    ++joined->revision;
    ASSERT_TRUE(desk.info.bounds);
    Bounds bounds = *desk.info.bounds;
    bounds.max.x() += 10;
    ASSERT_TRUE(a.Join(
        {desk.info, a.FindByName("Shelf"), joined, std::make_shared<const SceneRecord>(desk.scene), bounds}));
  }
  SyncOptions options = SampleSync(Url(), folder_ / "a");
  options.remove = true;
  const SyncReport refused = Push(options);
  EXPECT_GT(refused.problems, 0);
  EXPECT_THAT(LinesOf(refused), HasSubstr("'Shelf' was removed here and stays on the hub"));
  for (const HubHead& head : Hub(Url()).Heads()) EXPECT_FALSE(head.removed) << head.name;
  EXPECT_EQ(Hub(Url()).Tours().at(0).stops.size(), 2u);
  {
    Library a = Open("a");
    a.SetPolicy(a.FindByName("Desk").key, Policy::kOpen);
  }
  EXPECT_EQ(Push(options).problems, 0) << "an administrator may do that";
  PullTo("b");
  EXPECT_EQ(NamesIn(Open("b")), "Desk");
  EXPECT_EQ(Open("b").Tours().at(0).stops.size(), 1u);
}

TEST_F(HubSync, ARevertedMapIsBroughtBackEverywhere) {
  const std::uint64_t on_b = ShareMap("Desk");
  {
    Library a = Open("a");
    EditScene(&a, a.FindByName("Desk").key, [](content::Scene* scene) { scene->entities.clear(); });
  }
  PushFrom("a");
  PullTo("b");
  EXPECT_EQ(TextsIn(Open("b"), on_b), "");
  EXPECT_EQ(RevertHubMap(Url(), "Desk", 1), 3);
  PullTo("b");
  EXPECT_EQ(TextsIn(Open("b"), on_b), "sign-1=Hello");
}

TEST_F(HubSync, ToursStopAtTheSameMaps) {
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

TEST_F(HubSync, ATourStaysOneTourWhenAMapOfItIsRemovedOnTheHub) {
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

TEST_F(HubSync, ATourWhoseLanguageIsInCapitalsOnTheHubIsPulled) {
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

TEST_F(HubSync, ATourThatIsDamagedHereStaysOnTheHub) {
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

TEST_F(HubSync, AnInterruptedPullGoesOnWhereItWas) {
  {
    Library a = Open("a");
    AddSampleMap(&a, "Desk", 1);
  }
  PushFrom("a");
  SyncOptions options = SampleSync(Url(), folder_ / "b");
  int asked = 0;
  options.is_stopped = [&] { return ++asked > 6; };
  EXPECT_THAT(ErrorOf([&] { Pull(options); }), HasSubstr("Interrupted"));
  EXPECT_EQ(NamesIn(Open("b")), "") << "a map was seen half";
  const SyncReport rest = PullTo("b");
  const SyncReport whole = PullTo("c");
  EXPECT_LT(rest.bytes_received, whole.bytes_received);
  EXPECT_EQ(DifferenceOf("Desk", folder_ / "a", folder_ / "b"), "");
}

TEST_F(HubSync, WhatIsSavedDuringAPushIsPushedNext) {
  {
    Library a = Open("a");
    AddSampleMap(&a, "Desk", 1);
  }
  SyncOptions options = SampleSync(Url(), folder_ / "a");
  int asked = 0;
  options.is_stopped = [&] {
    // The map was read, and is being sent.
    if (++asked == 2) AddSampleSignpost(folder_ / "a", "Desk", "sign-2", "Late");
    return false;
  };
  EXPECT_EQ(Push(options).problems, 0);
  ASSERT_GT(asked, 2);
  EXPECT_THAT(LinesOf(PushFrom("a")), HasSubstr("was saved on the hub as revision 2"));
  PullTo("b");
  EXPECT_EQ(TextsIn(Open("b"), Open("b").FindByName("Desk").key), "sign-1=Hello sign-2=Late");
  EXPECT_THAT(PushFrom("a").lines, testing::IsEmpty());
}

TEST_F(HubSync, TheRateIsKept) {
  {
    Library a = Open("a");
    AddSampleMap(&a, "Desk", 1);
  }
  SyncOptions options = SampleSync(Url(), folder_ / "a");
  options.bytes_per_second = 50'000;
  const auto start = std::chrono::steady_clock::now();
  const SyncReport report = Push(options);
  const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
  ASSERT_GT(report.bytes_sent, 10'000);
  EXPECT_GT(taken.count(), 0.95 * static_cast<double>(report.bytes_sent) / 50'000);
}

TEST_F(HubSync, RandomEditsOfThreeDevicesConverge) {
  ShareMap("Desk");
  PullTo("c");
  std::uint32_t random = 12345;
  const auto next = [&](std::uint32_t below) {
    return (random = random * 1664525 + 1013904223) / 65536 % below;
  };
  for (int round = 0; round < 12; ++round) {
    const std::string name(1, static_cast<char>('a' + next(3)));
    {
      Library library = Open(name);
      EditScene(&library, library.FindByName("Desk").key, [&](content::Scene* scene) {
        const std::string entity = "sign-" + std::to_string(next(6));
        const auto found = std::find_if(scene->entities.begin(), scene->entities.end(),
                                        [&](const content::Entity& e) { return e.name == entity; });
        if (found == scene->entities.end()) {
          scene->entities.push_back(SampleSignpost(entity, std::to_string(round)));
        } else if (next(4) == 0) {
          scene->entities.erase(found);
        } else {
          found->signpost.text = std::to_string(round);
        }
      });
    }
    if (next(2) == 0) {
      EXPECT_EQ(PushFrom(name).problems, 0);
    }
    if (next(3) == 0) {
      EXPECT_EQ(PullTo(name).problems, 0);
    }
  }
  for (const char* name : {"a", "b", "c"}) EXPECT_EQ(PushFrom(name).problems, 0);
  for (const char* name : {"a", "b", "c"}) PullTo(name);
  EXPECT_EQ(DifferenceOf("Desk", folder_ / "a", folder_ / "b"), "");
  EXPECT_EQ(DifferenceOf("Desk", folder_ / "a", folder_ / "c"), "");
  EXPECT_EQ(NamesIn(Open("a")), "Desk");
}

TEST_F(HubSync, ALibraryBelongsToOneHub) {
  ShareMap("Desk");
  const std::string other = server().Url("other_hub");
  InitHub(other);
  EXPECT_THAT(ErrorOf([&] { Push(SampleSync(other, folder_ / "a")); }), HasSubstr("another hub"));
}

}  // namespace
}  // namespace docent::maps
