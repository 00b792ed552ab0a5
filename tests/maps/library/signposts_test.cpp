// SPDX-License-Identifier: Apache-2.0
#include "maps/library/signposts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "maps/exchange/exchange.h"
#include "maps/library/library.h"
#include "maps/maintenance/recovery.h"
#include "tests/maps/map_samples.h"

namespace docent::maps {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// A hall with signposts to a desk (with and without its key), to a door, and to a map that never was there.
class Signposts : public ::testing::Test {
 protected:
  Signposts() {
    Add("Hall", Policy::kOpen, "sign a 2 Desk\nsign b 0 Desk\nsign c 3 Door\nsign d 0 Nowhere\nsign e 0 ");
    Add("Desk", Policy::kOpen, "sign f 1 Hall");
    Add("Door", Policy::kReadOnly, "sign g 0 Desk\nsign h 2 Desk");
  }
  void Add(const char* name, Policy policy, const char* text) {
    const std::uint64_t key = library_.NewKey();
    library_.Save({key, name, policy, MakeSampleMap(key), MakeTextScene(text)});
  }
  std::string TextOf(std::uint64_t key) const { return library_.LoadScene(key).text; }

  const TemporaryFolder folder_;
  Library library_ = OpenToWrite(folder_ / "a.docent");
};

TEST_F(Signposts, LeadToARenamedMap) {
  library_.Rename(2, "Counter");
  EXPECT_EQ(TextOf(1), "sign a 2 Counter\nsign b 2 Counter\nsign c 3 Door\nsign d 0 Nowhere\nsign e 0 ");
  EXPECT_EQ(TextOf(3), "sign g 2 Counter\nsign h 2 Counter") << "where it leads is no change of the content";
  EXPECT_THAT(library_.SignpostsToNoMap(),
              ElementsAre(AllOf(HasSubstr("map 'Hall' (1)"), HasSubstr("'d' leads to the map 'Nowhere'"))));
  // Another map that gets the old name is not where they lead.
  Add("Desk", Policy::kOpen, "");
  EXPECT_EQ(library_.SignpostsTo(2).size(), 4u);
  EXPECT_THAT(library_.SignpostsTo(4), IsEmpty());
  EXPECT_THAT(library_.Verify(), IsEmpty());
}

TEST_F(Signposts, LeadNowhereWhenTheirMapIsRemoved) {
  std::vector<std::string> names;
  for (const Library::Signpost& signpost : library_.SignpostsTo(2))
    names.push_back(signpost.map.name + signpost.name);
  EXPECT_THAT(names, ElementsAre("Halla", "Hallb", "Doorg", "Doorh"));
  EXPECT_THAT(ErrorOf([&] { library_.Remove(2); }), AllOf(HasSubstr("map 'Door'"), HasSubstr("read-only")));
  EXPECT_EQ(library_.List().size(), 3u);
  library_.SetPolicy(3, Policy::kAugmentOnly);
  library_.Remove(2);
  EXPECT_EQ(TextOf(1), "sign a 0 \nsign b 0 \nsign c 3 Door\nsign d 0 Nowhere\nsign e 0 ");
  EXPECT_EQ(TextOf(3), "sign g 0 \nsign h 0 ");
  EXPECT_EQ(library_.SignpostsToNoMap().size(), 1u);
}

// Undo and redo restore no signpost to a map that is gone, also where the scene has none.
TEST_F(Signposts, FollowTheirMapInUndoHistoriesToo) {
  Add("Attic", Policy::kOpen, "no signpost");
  for (const std::uint64_t key : {1, 4}) {
    MapRecord record{key, "", Policy::kOpen, nullptr, nullptr};
    record.history = MakeTextScene("sign a 0 Desk\nsign b 2 Desk\nsign c 3 Door");
    library_.Save(record);
  }
  const auto history_of = [&](std::uint64_t key) { return library_.LoadHistory(key).value().text; };
  library_.SetPolicy(3, Policy::kOpen);
  library_.SetPolicy(4, Policy::kReadOnly);
  library_.Rename(2, "Counter");
  EXPECT_EQ(history_of(1), "sign a 2 Counter\nsign b 2 Counter\nsign c 3 Door");
  EXPECT_EQ(history_of(4), history_of(1));
  library_.Remove(2);
  EXPECT_EQ(history_of(1), "sign a 0 \nsign b 0 \nsign c 3 Door");
  EXPECT_EQ(history_of(4), history_of(1)) << "what could be undone does not keep a map from being removed";
  MapRecord record{1, "", Policy::kOpen, MakeSampleMap(9), nullptr};
  record.joined_keys = {3};
  library_.Save(record);
  EXPECT_EQ(history_of(4), "sign a 0 \nsign b 0 \nsign c 1 Hall");
  EXPECT_THAT(library_.Verify(), IsEmpty());
}

TEST_F(Signposts, FollowAMapThatIsJoinedInASave) {
  MapRecord record{1, "", Policy::kOpen, MakeSampleMap(9), nullptr};
  record.joined_keys = {2};
  library_.Save(record);
  EXPECT_EQ(TextOf(3), "sign g 1 Hall\nsign h 1 Hall");
}

TEST_F(Signposts, LeadToTheSameMapsInAnotherLibrary) {
  {
    Library other = OpenToWrite(folder_ / "b.docent");
    other.Save({other.ReserveKeys(20) + 19, "Desk", Policy::kOpen, MakeSampleMap(5), MakeTextScene("")});
    other.Save({other.NewKey(), "Nowhere", Policy::kOpen, MakeSampleMap(5), MakeTextScene("")});
  }
  ImportMaps(library_, folder_ / "b.docent", SampleSceneTools());
  const Library other = OpenToRead(folder_ / "b.docent");
  EXPECT_EQ(other.LoadScene(other.FindByName("Hall").key).text,
            "sign a 23 Desk (2)\nsign b 23 Desk (2)\nsign c 24 Door\nsign d 21 Nowhere\nsign e 0 ");
  ExportMap(library_, 1, folder_ / "c.docent", SampleSceneTools());
  const Library exported = OpenToRead(folder_ / "c.docent");
  EXPECT_EQ(exported.LoadScene(exported.FindByName("Hall").key).text,
            "sign a 0 Desk\nsign b 0 Desk\nsign c 0 Door\nsign d 0 Nowhere\nsign e 0 ");
}

TEST_F(Signposts, ToALostMapAreCutInARecoveredLibrary) {
  { Library closed = std::move(library_); }
  RunSql(folder_ / "a.docent", "DELETE FROM parts WHERE map_key = 2; DELETE FROM pictures WHERE map_key = 2");
  const Recovery recovery = Recover(folder_ / "a.docent", folder_ / "b.docent", SampleSceneTools());
  EXPECT_THAT(recovery.problems,
              ::testing::Contains(HasSubstr("the signpost 'a' leads to the map 'Desk', which could "
                                            "not be recovered")));
  const Library recovered = OpenToRead(folder_ / "b.docent");
  EXPECT_EQ(recovered.LoadScene(1).text,
            "sign a 0 \nsign b 0 Desk\nsign c 3 Door\nsign d 0 Nowhere\nsign e 0 ");
  EXPECT_EQ(recovered.Find(3).policy, Policy::kReadOnly);
  EXPECT_EQ(recovered.LoadScene(3).text, "sign g 0 Desk\nsign h 0 ");
  // No later map gets the key of the lost one.
  EXPECT_GT(OpenToWrite(folder_ / "b.docent").NewKey(), 3u);
}

TEST_F(Signposts, OfAnUnreadableSceneDoNotStopWhatConcernsOthers) {
  library_.Save({2, "", Policy::kOpen, nullptr, MakeTextScene("sign x 3 Door\ndamaged")});
  EXPECT_THAT(library_.Verify(),
              ElementsAre(AllOf(HasSubstr("map 'Desk' (2)"), HasSubstr("a line is damaged"))));
  library_.SetPolicy(3, Policy::kOpen);
  library_.Rename(3, "Gate");
  library_.Remove(3);
  EXPECT_EQ(TextOf(2), "sign x 3 Door\ndamaged");
}

TEST_F(Signposts, AndModelsThatAreReadableAreRecoveredFromADamagedScene) {
  auto scene = std::make_shared<SceneRecord>(*MakeSampleScene(30, 2));
  scene->text = "sign x 1 Hall\nmodel asset-30\ndamaged\nmodel asset-31";
  library_.Save({2, "", Policy::kOpen, nullptr, scene});
  { Library closed = std::move(library_); }
  RunSql(folder_ / "a.docent", "DELETE FROM assets WHERE id = 'asset-31'");
  const Recovery recovery = Recover(folder_ / "a.docent", folder_ / "b.docent", SampleSceneTools());
  EXPECT_EQ(recovery.maps_partial, 1u);
  const Library recovered = OpenToRead(folder_ / "b.docent");
  const SceneRecord left = recovered.LoadScene(2);
  EXPECT_EQ(left.text, "sign x 1 Hall\nmodel asset-30");
  ASSERT_EQ(left.assets.size(), 1u);
  EXPECT_EQ(*left.assets[0].bytes, *scene->assets[0].bytes);
  EXPECT_THAT(recovered.Verify(), IsEmpty());
}

}  // namespace
}  // namespace docent::maps
