// SPDX-License-Identifier: Apache-2.0
#include "maps/maintenance/joining.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/maps/map_samples.h"

namespace docent::maps {
namespace {

using engine::Sim3;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Not a real overlap: the library joins two maps regardless of their contents.
std::shared_ptr<const engine::MapSnapshot> BothOf(const StoredMap& into, const StoredMap& from) {
  engine::JoinedIds ids;
  return std::make_shared<engine::MapSnapshot>(engine::SideBySide(*into.snapshot, *from.snapshot, &ids));
}

JoinRecord RecordOf(const Library& library, const char* into, const char* from) {
  const StoredMap first = library.Load(library.FindByName(into).key),
                  second = library.Load(library.FindByName(from).key);
  JoinRecord record;
  record.into = first.info;
  record.from = second.info;
  record.snapshot = BothOf(first, second);
  auto scene = std::make_shared<SceneRecord>(first.scene);
  scene->text += second.scene.text;
  scene->assets.insert(scene->assets.end(), second.scene.assets.begin(), second.scene.assets.end());
  record.scene = std::move(scene);
  record.bounds = JoinedBounds(first, second, Sim3());
  return record;
}

// East and West, and a hall with a signpost to West.
class JoinedLibrary : public ::testing::Test {
 protected:
  void Add(const char* name, std::uint64_t seed, Policy policy = Policy::kOpen) {
    library_.Save({library_.NewKey(), name, policy, MakeSampleMap(seed), MakeSampleScene(seed, 1)});
  }
  void AddHall(Policy policy = Policy::kOpen) {
    library_.Save({library_.NewKey(), "Hall", policy, MakeSampleMap(9), MakeTextScene("sign a 0 West")});
  }
  std::vector<std::string> Names() const {
    std::vector<std::string> names;
    for (const MapInfo& info : library_.List()) names.push_back(info.name);
    return names;
  }

  const TemporaryFolder folder_;
  Library library_ = OpenToWrite(folder_ / "a.docent");
};

TEST_F(JoinedLibrary, HasOneMapWithEverythingOfBoth) {
  Add("East", 1);
  Add("West", 5);
  AddHall();
  const std::uint64_t key = library_.FindByName("East").key;
  const JoinRecord record = RecordOf(library_, "East", "West");
  ASSERT_TRUE(library_.Join(record));
  EXPECT_EQ(Names(), (std::vector<std::string>{"East", "Hall"}));
  EXPECT_THAT(library_.Verify(), IsEmpty());
  const StoredMap joined = library_.Load(key);
  EXPECT_EQ(FirstDifference(*joined.snapshot, *record.snapshot), "");
  EXPECT_EQ(FirstDifference(joined.scene, *record.scene), "");
  EXPECT_EQ(joined.info.policy, Policy::kOpen);
  EXPECT_EQ(library_.LoadScene(library_.FindByName("Hall").key).text,
            "sign a " + std::to_string(key) + " East");
  library_.LoadAppearance([](const MapInfo& info, const Library::Appearance& appearance) {
    EXPECT_EQ(appearance.problem, "");
    EXPECT_EQ(appearance.thumbnails.size(), info.keyframes);
  });
}

TEST_F(JoinedLibrary, KeepsTheStricterPolicyAndTheBoundsOfBoth) {
  Add("East", 1, Policy::kBounded);
  Add("West", 5);
  const StoredMap east = library_.Load(library_.FindByName("East").key),
                  west = library_.Load(library_.FindByName("West").key);
  const Sim3 east_from_west{engine::Rotation3(), {10, 0, 0}, 2};
  const Bounds bounds = *JoinedBounds(east, west, east_from_west), alone = *ComputeBounds(*west.snapshot);
  EXPECT_EQ(bounds.min, east.info.bounds->min.cwiseMin(east_from_west * alone.min));
  EXPECT_EQ(bounds.max, east.info.bounds->max.cwiseMax(east_from_west * alone.max));
  EXPECT_EQ(JoinedBounds(west, west, Sim3()), std::nullopt) << "open maps have no bounds";
  ASSERT_TRUE(library_.Join(RecordOf(library_, "West", "East")));
  const MapInfo joined = library_.FindByName("West");
  EXPECT_EQ(joined.policy, Policy::kBounded);
  EXPECT_TRUE(joined.bounds.has_value());
  EXPECT_THAT(library_.Verify(), IsEmpty());
}

TEST_F(JoinedLibrary, DoesNotChangeMapsWhosePolicyForbidsIt) {
  Add("East", 1);
  Add("West", 5);
  JoinRecord record = RecordOf(library_, "East", "West");
  for (const Policy policy : {Policy::kAugmentOnly, Policy::kReadOnly}) {
    for (const char* name : {"East", "West"}) {
      const std::uint64_t key = library_.FindByName(name).key;
      library_.SetPolicy(key, policy);
      record.into = library_.FindByName("East");
      record.from = library_.FindByName("West");
      EXPECT_THAT(ErrorOf([&] { library_.Join(record); }),
                  AllOf(HasSubstr(name), HasSubstr(ToString(policy))));
      const auto join = [&] { JoinMaps(&library_, record.into.key, record.from.key, {}, nullptr); };
      EXPECT_THAT(ErrorOf(join), AllOf(HasSubstr(name), HasSubstr(ToString(policy))));
      library_.SetPolicy(key, Policy::kOpen);
    }
  }
  EXPECT_EQ(Names(), (std::vector<std::string>{"East", "West"}));
}

TEST_F(JoinedLibrary, WritesNothingWhenASignpostMayNotBeRedirected) {
  Add("East", 1);
  Add("West", 5);
  AddHall(Policy::kReadOnly);
  const StoredMap before = library_.Load(library_.FindByName("East").key);
  const JoinRecord record = RecordOf(library_, "East", "West");
  EXPECT_THAT(ErrorOf([&] { library_.Join(record); }), AllOf(HasSubstr("Hall"), HasSubstr("West")));
  EXPECT_EQ(Names(), (std::vector<std::string>{"East", "West", "Hall"}));
  EXPECT_EQ(FirstDifference(*library_.Load(before.info.key).snapshot, *before.snapshot), "");
  // When nothing refers to West, the hall's policy does not matter.
  library_.SetPolicy(library_.FindByName("Hall").key, Policy::kOpen);
  library_.Save(
      {library_.FindByName("Hall").key, "", Policy::kOpen, nullptr, MakeTextScene("sign a 0 East")});
  library_.SetPolicy(library_.FindByName("Hall").key, Policy::kReadOnly);
  EXPECT_TRUE(library_.Join(record));
}

TEST_F(JoinedLibrary, KeepsChangesOfAnotherProgram) {
  Add("East", 1);
  Add("West", 5);
  const JoinRecord record = RecordOf(library_, "East", "West");
  Library other = OpenToWrite(folder_ / "a.docent");
  other.Save({record.from.key, "", Policy::kOpen, nullptr, MakeSampleScene(77, 0)});
  EXPECT_FALSE(library_.Join(record));
  EXPECT_EQ(Names(), (std::vector<std::string>{"East", "West"}));
}

TEST_F(JoinedLibrary, RemovesAJoinedMapWithTheSaveOfTheMapThatContainsIt) {
  Add("East", 1);
  Add("West", 5);
  const MapInfo east = library_.FindByName("East"), west = library_.FindByName("West");
  MapRecord record{east.key, "", Policy::kOpen, MakeSampleMap(3), MakeSampleScene(5, 1)};
  record.joined_keys = {west.key, west.key + 50};
  library_.SetPolicy(west.key, Policy::kReadOnly);
  EXPECT_THAT(ErrorOf([&] { library_.Save(record); }), AllOf(HasSubstr("West"), HasSubstr("read-only")));
  EXPECT_EQ(library_.Find(east.key), east) << "nothing was written";
  library_.SetPolicy(west.key, Policy::kOpen);
  EXPECT_TRUE(library_.Save(record));
  EXPECT_EQ(Names(), std::vector<std::string>{"East"});
  EXPECT_EQ(FirstDifference(library_.Load(east.key).scene, *record.scene), "") << "with an asset of West";
  EXPECT_TRUE(library_.Save(record)) << "a map that was removed already is no error";
  EXPECT_THAT(library_.Verify(), IsEmpty());
}

TEST_F(JoinedLibrary, KeepsTwoMapsThatDoNotOverlap) {
  library_.Save({library_.NewKey(), "East", Policy::kOpen, MakeTrueMap(), nullptr});
  library_.Save({library_.NewKey(), "West", Policy::kOpen, MakeTrueMap(), nullptr});
  Library library = Library::Open(folder_ / "a.docent", Access::kReadWrite);
  const std::uint64_t east = library.FindByName("East").key, west = library.FindByName("West").key;
  const JoinResult result = JoinMaps(&library, east, west, {}, nullptr);
  EXPECT_FALSE(result.Joined()) << "noise images have no common place";
  EXPECT_EQ(Names(), (std::vector<std::string>{"East", "West"}));
  EXPECT_THAT(ErrorOf([&] { JoinMaps(&library, east, east, {}, nullptr); }), HasSubstr("itself"));
}

}  // namespace
}  // namespace docent::maps
