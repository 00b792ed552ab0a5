// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "maps/hub/hub.h"
#include "tests/hub/hub_samples.h"
#include "tests/hub/private_server.h"
#include "tests/hub/two_devices.h"

// Maps that are removed on one device, or replaced by others, and then on the hub.
namespace docent::maps {
namespace {

using testing::HasSubstr;

class HubRemoval : public WithTwoDevices {};

TEST_F(HubRemoval, AMapIsRemovedOnBothSidesOnlyIfThatIsAskedFor) {
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

TEST_F(HubRemoval, AMapThatIsRemovedDuringAPushIsRemovedByTheNext) {
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

TEST_F(HubRemoval, AMapGetsTheNameOfOneThatIsRemovedByTheSamePush) {
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

// Lets the hub refuse each further revision of a map that does not fulfil the condition.
void DemandOfRevisions(const std::string& url, const std::string& condition) {
  RunHubSql(url, "ALTER TABLE docent.revisions ADD CONSTRAINT demanded CHECK (" + condition + ") NOT VALID");
}
void DemandNothing(const std::string& url) {
  RunHubSql(url, "ALTER TABLE docent.revisions DROP CONSTRAINT demanded");
}

TEST_F(HubRemoval, AMapStaysOnTheHubWhenTheNewOneOfItsNameIsRefused) {
  ShareMap("Desk");
  {
    Library a = Open("a");
    a.Remove(a.FindByName("Desk").key);
    AddSampleMap(&a, "Desk", 8);
  }
  DemandOfRevisions(Url(), "revision > 1");  // As the one that removes the map on the hub.
  SyncOptions options = SampleSync(Url(), folder_ / "a");
  options.remove = true;
  const SyncReport refused = Push(options);
  EXPECT_GT(refused.problems, 0);
  EXPECT_THAT(LinesOf(refused), HasSubstr("'Desk' was not saved on the hub"));
  const std::vector<HubHead> heads = Hub(Url()).Heads();
  ASSERT_EQ(heads.size(), 1u);
  EXPECT_FALSE(heads[0].removed);
  DemandNothing(Url());
  const SyncReport report = Push(options);
  EXPECT_EQ(report.problems, 0) << LinesOf(report);
  PullTo("b");
  EXPECT_EQ(NamesIn(Open("b")), "Desk");
  EXPECT_EQ(DifferenceOf("Desk", folder_ / "a", folder_ / "b"), "");
}

TEST_F(HubRemoval, AMapStaysOnTheHubWhenAnotherOneDoesNotGetItsName) {
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
    ExtendMap(&a, a.FindByName("Shelf").key, {0.1, 0, 0}, 51);
    a.Rename(a.FindByName("Shelf").key, "Desk");
  }
  // The second revision of each is its new structure or its removal, the third one the new name.
  DemandOfRevisions(Url(), "revision < 3");
  SyncOptions options = SampleSync(Url(), folder_ / "a");
  options.remove = true;
  EXPECT_GT(Push(options).problems, 0);
  for (const HubHead& head : Hub(Url()).Heads()) EXPECT_FALSE(head.removed) << head.name;
  DemandNothing(Url());
  const SyncReport report = Push(options);
  EXPECT_EQ(report.problems, 0) << LinesOf(report);
  PullTo("b");
  EXPECT_EQ(NamesIn(Open("b")), "Desk");
  EXPECT_EQ(DifferenceOf("Desk", folder_ / "a", folder_ / "b"), "");
}

TEST_F(HubRemoval, AMapThatWasJoinedStaysOnTheHubUntilTheJoinedMapIsSaved) {
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

}  // namespace
}  // namespace docent::maps
