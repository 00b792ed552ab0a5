// SPDX-License-Identifier: Apache-2.0
#include "maps/library/map_copies.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "maps/exchange/exchange.h"
#include "maps/library/map_pager.h"
#include "tests/maps/map_samples.h"

namespace docent::maps {
namespace {

using ::testing::IsEmpty;
using ::testing::Pair;
using ::testing::UnorderedElementsAre;

// A library with two different maps, of which the first was imported from another library twice.
class Copies : public ::testing::Test {
 protected:
  Copies() {
    Save("Desk", MakeSampleMap(1, {.keyframes = 6}));
    Save("Door", MakeSampleMap(2, {.keyframes = 6}));
    ExportMap(library_, 1, folder_ / "desk.docent");
    for (int i = 0; i < 2; ++i) ImportMaps(OpenToRead(folder_ / "desk.docent"), folder_ / "a.docent");
  }
  std::uint64_t Save(const std::string& name, std::shared_ptr<const engine::MapSnapshot> map) {
    const std::uint64_t key = library_.NewKey();
    library_.Save({key, name, Policy::kOpen, std::move(map), nullptr});
    return key;
  }
  std::uint64_t KeyOf(const std::string& name) const { return library_.FindByName(name).key; }

  const TemporaryFolder folder_;
  Library library_ = OpenToWrite(folder_ / "a.docent");
};

TEST_F(Copies, AreReplacedByTheNewest) {
  EXPECT_THAT(ReplacedByCopies(FindCopies(library_)),
              UnorderedElementsAre(Pair(KeyOf("Desk"), KeyOf("Desk (3)")),
                                   Pair(KeyOf("Desk (2)"), KeyOf("Desk (3)"))));
}

TEST_F(Copies, AreFoundAfterOneOfThemHasGrown) {
  auto grown = std::make_shared<engine::MapSnapshot>(*library_.Load(KeyOf("Desk (2)")).snapshot);
  for (std::uint64_t i = 0; i < 4; ++i)
    AddSampleKeyFrame(50 + i, {1 + 0.1 * static_cast<double>(i), 0, 0}, grown.get());
  ++grown->revision;
  library_.Save({KeyOf("Desk (2)"), "Desk (2)", Policy::kOpen, grown, nullptr});
  EXPECT_THAT(ReplacedByCopies(FindCopies(library_)),
              UnorderedElementsAre(Pair(KeyOf("Desk"), KeyOf("Desk (2)")),
                                   Pair(KeyOf("Desk (3)"), KeyOf("Desk (2)"))))
      << "it is the one that was changed last";
}

TEST_F(Copies, AreNotMapsThatShareAFewImagesOnly) {
  auto other = MakeSampleMap(3, {.keyframes = 6});
  AddSampleKeyFrame(77, {1, 0, 0}, other.get());
  auto another = MakeSampleMap(4, {.keyframes = 6});
  AddSampleKeyFrame(77, {1, 0, 0}, another.get());
  Save("Window", other);
  Save("Wall", another);
  for (const MapCopy& copy : FindCopies(library_)) EXPECT_TRUE(copy.older.name.starts_with("Desk"));
}

TEST_F(Copies, TheOlderOnesAreNeitherLoadedNorFound) {
  engine::PlaceIndex index;
  PagerOptions options;
  options.left_out = {KeyOf("Desk"), KeyOf("Desk (2)")};
  const Library read = OpenToRead(folder_ / "a.docent");
  MapPager pager(&read, &index, options, {});
  pager.Open();
  EXPECT_THAT(pager.maps_in_memory(), UnorderedElementsAre(KeyOf("Door"), KeyOf("Desk (3)")));
  pager.Load(KeyOf("Desk"));
  EXPECT_EQ(pager.maps_in_memory().size(), 3u) << "but an author can still choose them";
}

TEST_F(Copies, HaveNoNumbersInTheirNamesForVisitors) {
  const auto names = NamesForVisitors(library_.List(), FindCopies(library_));
  ASSERT_TRUE(names.contains("Desk (3)"));
  EXPECT_EQ(names.at("Desk (3)"), "Desk") << "the newest one is shown";
  EXPECT_EQ(names.at("Desk"), "Desk (3)") << "names stay unique";
  EXPECT_FALSE(names.contains("Door"));
}

std::vector<MapInfo> MapsNamed(const std::vector<std::string>& names) {
  std::vector<MapInfo> maps;
  for (const std::string& name : names) {
    MapInfo& map = maps.emplace_back();
    map.key = maps.size();
    map.name = name;
  }
  return maps;
}

TEST(NamesForVisitors, LeaveAloneNamesOfOtherOrigin) {
  const auto copies = [](const std::string& older, const std::string& newer) {
    const std::vector<MapInfo> maps = MapsNamed({older, newer});
    return NamesForVisitors(maps, {MapCopy{maps[0], maps[1]}});
  };
  EXPECT_THAT(copies("Ships (2)", "Ships"), IsEmpty());
  EXPECT_THAT(copies("Ships", "Ships (new)"), IsEmpty());
  EXPECT_THAT(copies("Ships", "Ships ()"), IsEmpty());
  EXPECT_THAT(copies("Ships (2)", "Ships (3)"), UnorderedElementsAre(Pair("Ships (3)", "Ships")))
      << "the first one was removed";
  EXPECT_THAT(copies("Paintings (1900)", "Paintings (1900) (2)"),
              UnorderedElementsAre(Pair("Paintings (1900) (2)", "Paintings (1900)"),
                                   Pair("Paintings (1900)", "Paintings (1900) (2)")));
}

TEST(NamesForVisitors, HaveNoNumberOfACopyWhoseOriginalIsGone) {
  const auto names = [](const std::vector<std::string>& maps) {
    return NamesForVisitors(MapsNamed(maps), {});
  };
  EXPECT_THAT(names({"Ships (2)", "Masks"}), UnorderedElementsAre(Pair("Ships (2)", "Ships")));
  EXPECT_THAT(names({"Ships (2)", "Ships"}), IsEmpty()) << "they show different things";
  EXPECT_THAT(names({"Room (1)", "Room (2)"}), IsEmpty()) << "visitors have to tell them apart";
  EXPECT_THAT(names({"Paintings (1900)"}), IsEmpty());
}

TEST_F(Copies, AreNamedToTheCurator) {
  const std::vector<MapCopy> copies = FindCopies(library_);
  ASSERT_EQ(copies.size(), 2u);
  EXPECT_EQ(
      TextOf(copies[0]),
      "'Desk' and 'Desk (3)' show the same images; visitors are shown the newer one, 'Desk (3)'. Remove "
      "the one that is not needed");
}

TEST(NoCopies, AreInALibraryOfDifferentMapsOrWithoutMaps) {
  const TemporaryFolder folder;
  Library library = OpenToWrite(folder / "a.docent");
  EXPECT_THAT(FindCopies(library), IsEmpty());
  for (std::uint64_t seed = 1; seed <= 5; ++seed)
    library.Save(
        {library.NewKey(), "map " + std::to_string(seed), Policy::kOpen, MakeSampleMap(seed), nullptr});
  library.Save({library.NewKey(), "empty", Policy::kOpen, nullptr, nullptr});
  library.Save({library.NewKey(), "empty too", Policy::kOpen, nullptr, nullptr});
  EXPECT_THAT(FindCopies(library), IsEmpty());
}

}  // namespace
}  // namespace docent::maps
