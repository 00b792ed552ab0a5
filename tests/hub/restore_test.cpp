// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "maps/hub/hub.h"
#include "maps/hub/hub_backup.h"
#include "tests/hub/hub_samples.h"
#include "tests/hub/private_server.h"

// Two devices, whose libraries are `a` and `b`, go on with a hub that was restored from an older backup.
namespace docent::maps {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;

class HubRestore : public WithHubServer {
 protected:
  // A map that the hub and both devices have, and a backup of that.
  void ShareMapAndBackUp() {
    hub_ = Database();
    {
      Library a = Open("a");
      const std::uint64_t key = AddSampleMap(&a, "Desk", 7);
      a.ChangeTours([&](std::vector<Tour>* tours) { tours->push_back({"Short", {key}, "", 20}); });
    }
    PushFrom("a");
    PullTo("b");
    BackUpHub(Address(), folder_ / "backup");
  }
  // From now on, the devices use the restored hub.
  void Restore() {
    hub_ = "restored-" + Database();
    RestoreHub(Address(), folder_ / "backup");
  }
  std::string Address(const std::string& user = "postgres") const { return server().Url(hub_, user); }
  SyncReport PushFrom(const std::string& name) { return Push(SampleSync(Address(), folder_ / name)); }
  SyncReport PullTo(const std::string& name, const std::string& user = "postgres") {
    return Pull(SampleSync(Address(user), folder_ / name));
  }
  Library Open(const std::string& name) { return OpenSampleLibrary(folder_ / name); }
  void AddSign(const std::string& device, const std::string& name) {
    AddSampleSignpost(folder_ / device, "Desk", name, "X");
  }
  std::string Texts(const std::string& device) {
    const Library library = Open(device);
    return TextsIn(library, library.FindByName("Desk").key);
  }

  TemporaryFolder folder_;

 private:
  std::string hub_;  // The name of its database.
};

TEST_F(HubRestore, WhatIsNewerThanTheBackupStaysAndIsPushedAgain) {
  ShareMapAndBackUp();
  AddSign("a", "sign-2");
  PushFrom("a");
  PullTo("b");
  Restore();
  EXPECT_THAT(LinesOf(PullTo("b")), HasSubstr("'Desk' is newer here than on the hub"));
  EXPECT_EQ(Texts("b"), "sign-1=Hello sign-2=X") << "the older state has replaced it";
  EXPECT_THAT(LinesOf(PushFrom("a")), HasSubstr("was saved on the hub as revision 2"));
  EXPECT_THAT(PullTo("b").lines, IsEmpty());
  EXPECT_THAT(PushFrom("b").lines, IsEmpty());
  PullTo("c");
  EXPECT_EQ(Texts("c"), "sign-1=Hello sign-2=X");
  EXPECT_EQ(NamesIn(Open("b")), "Desk");
}

TEST_F(HubRestore, AKnownRevisionIsStillKnown) {
  ShareMapAndBackUp();
  Restore();
  EXPECT_THAT(PullTo("a").lines, IsEmpty());
  EXPECT_THAT(PushFrom("b").lines, IsEmpty());
  AddSign("a", "sign-2");
  PushFrom("a");
  EXPECT_THAT(LinesOf(PullTo("b")), HasSubstr("was updated to revision 2"));
  EXPECT_EQ(DifferenceOf("Desk", folder_ / "a", folder_ / "b"), "");
}

TEST_F(HubRestore, ANumberThatIsUsedAgainIsNotTakenForTheSameState) {
  ShareMapAndBackUp();
  AddSign("a", "from-a");
  PushFrom("a");  // Revision 2, which the backup does not have.
  Restore();
  AddSign("b", "from-b");
  EXPECT_THAT(LinesOf(PushFrom("b")), HasSubstr("as revision 2"));
  PullTo("a");
  EXPECT_THAT(Texts("a"), AllOf(HasSubstr("from-a"), HasSubstr("from-b")));
  EXPECT_THAT(LinesOf(PushFrom("a")), HasSubstr("as revision 3"));
  PullTo("b");
  EXPECT_EQ(DifferenceOf("Desk", folder_ / "a", folder_ / "b"), "");
  EXPECT_EQ(NamesIn(Open("b")), "Desk");
}

TEST_F(HubRestore, AMapThatIsNotInTheBackupIsAddedAgain) {
  ShareMapAndBackUp();
  {
    Library a = Open("a");
    AddSampleMap(&a, "Hall", 8);
  }
  PushFrom("a");
  PullTo("b");
  Restore();
  PullTo("b");
  EXPECT_EQ(NamesIn(Open("b")), "Desk,Hall");
  EXPECT_THAT(LinesOf(PushFrom("a")), HasSubstr("'Hall' was added to the hub"));
  EXPECT_THAT(PullTo("b").lines, IsEmpty());
  EXPECT_THAT(PushFrom("b").lines, IsEmpty());
  EXPECT_EQ(NamesIn(Open("b")), "Desk,Hall");
}

TEST_F(HubRestore, AVisitorsDeviceFollowsAgainOnceTheMapIsSaved) {
  ShareMapAndBackUp();
  const std::string vera = AddUser("vera", "visitor");
  AddSign("a", "from-a");
  PushFrom("a");
  PullTo("b", vera);
  Restore();
  PullTo("b", vera);
  EXPECT_THAT(Texts("b"), HasSubstr("from-a"));
  PullTo("c");
  AddSign("c", "from-c");
  PushFrom("c");
  PullTo("b", vera);
  EXPECT_EQ(Texts("b"), Texts("c"));
  EXPECT_THAT(LinesOf(PushFrom("a")), HasSubstr("were merged as revision 3"));
  PullTo("b", vera);
  EXPECT_THAT(Texts("b"), AllOf(HasSubstr("from-a"), HasSubstr("from-c")));
  EXPECT_EQ(DifferenceOf("Desk", folder_ / "a", folder_ / "b"), "");
}

TEST_F(HubRestore, AVisitorsDeviceTakesAMapThatTheBackupLackedOnceItIsSaved) {
  ShareMapAndBackUp();
  const std::string vera = AddUser("vera", "visitor");
  {
    Library a = Open("a");
    const std::uint64_t key = AddSampleMap(&a, "Hall", 8);
    a.ChangeTours([&](std::vector<Tour>* tours) { tours->push_back({"Long", {key}, "", 90}); });
  }
  PushFrom("a");
  AddSampleSignpost(folder_ / "a", "Hall", "sign-2", "X");
  PushFrom("a");  // Revision 2, which the visitor's device gets.
  PullTo("b", vera);
  Restore();
  PullTo("b", vera);
  EXPECT_EQ(NamesIn(Open("b")), "Desk,Hall") << "nobody has saved it yet";
  {
    Library a = Open("a");
    EditScene(&a, a.FindByName("Hall").key,
              [](content::Scene* scene) { scene->entities[0].signpost.text = "Changed"; });
    ExtendMap(&a, a.FindByName("Hall").key, {0.1, 0, 0}, 51);
    a.ChangeTours([](std::vector<Tour>* tours) { tours->front().minutes = 80; });
  }
  PushFrom("a");
  EXPECT_THAT(LinesOf(PullTo("b", vera)), HasSubstr("'Hall' was updated"));
  EXPECT_EQ(NamesIn(Open("b")), "Desk,Hall");
  EXPECT_EQ(DifferenceOf("Hall", folder_ / "a", folder_ / "b"), "");
  const std::vector<Tour> tours = Open("b").Tours();
  ASSERT_EQ(tours.size(), 2u);
  EXPECT_EQ(tours[0].name, "Long");
  EXPECT_EQ(tours[0].minutes, 80);
  EXPECT_THAT(PullTo("b", vera).lines, IsEmpty());
}

TEST_F(HubRestore, AnEditedTourStaysAndIsPushedAgain) {
  ShareMapAndBackUp();
  {
    Library a = Open("a");
    a.ChangeTours([](std::vector<Tour>* tours) { tours->front().minutes = 30; });
  }
  PushFrom("a");
  PullTo("b");
  Restore();
  PullTo("a");
  EXPECT_EQ(Open("a").Tours().at(0).minutes, 30);
  EXPECT_THAT(LinesOf(PushFrom("a")), HasSubstr("The tour 'Short' was saved on the hub"));
  PullTo("b");
  PullTo("c");
  for (const char* device : {"b", "c"}) {
    ASSERT_EQ(Open(device).Tours().size(), 1u) << device;
    EXPECT_EQ(Open(device).Tours()[0].minutes, 30) << device;
  }
}

TEST_F(HubRestore, EachRestorationIsNoted) {
  ShareMapAndBackUp();
  EXPECT_EQ(Hub(Address()).restoration(), "");
  EXPECT_THAT(Hub(Address()).Restorations(), IsEmpty());
  Restore();
  const std::vector<HubRestoration> restorations = Hub(Address()).Restorations();
  ASSERT_EQ(restorations.size(), 1u);
  EXPECT_EQ(restorations[0].id, Hub(Address()).restoration());
  EXPECT_EQ(restorations[0].maps, (std::map<std::string, std::int64_t>{{Hub(Address()).Heads()[0].id, 1}}));
  EXPECT_EQ(restorations[0].tours, (std::map<std::string, std::int64_t>{{"Short", 1}}));
  const std::string vera = AddUser("vera", "visitor");
  EXPECT_FALSE(Hub(Address(vera)).may_save());
  EXPECT_EQ(Hub(Address(vera)).Restorations().size(), 1u);
  EXPECT_TRUE(Hub(Address()).may_save());
  RunHubSql(Address(), "UPDATE docent.hub SET restorations = '[{\"id\": 7}]'");
  EXPECT_THAT(ErrorOf([&] { Hub(Address()).Restorations(); }), HasSubstr("not valid"));
}

}  // namespace
}  // namespace docent::maps
