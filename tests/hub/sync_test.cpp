// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <algorithm>

#include "app/session/library_scene.h"
#include "maps/hub/administration.h"
#include "maps/hub/hub.h"
#include "maps/hub/sync_session.h"
#include "maps/hub/sync_state.h"
#include "tests/hub/hub_samples.h"
#include "tests/hub/private_server.h"
#include "tests/hub/two_devices.h"

// Two devices, whose libraries are `a` and `b`, share a hub.
namespace docent::maps {
namespace {

using testing::HasSubstr;

class HubSync : public WithTwoDevices {};

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
