// SPDX-License-Identifier: Apache-2.0
#include "engine/recognition/descriptor_database.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <vector>

#include "engine/vision/features.h"
#include "tests/engine/recognition/made_descriptors.h"
#include "tests/engine/rendered_world.h"

namespace docent::engine {
namespace {

using testing_descriptors::Disturbed;
using testing_descriptors::MadeDescriptor;
using testing_descriptors::MadeTree;
using DatabaseEntry = DescriptorDatabase::Entry;
using DatabaseMatch = DescriptorDatabase::Match;

// The distinct descriptors of the points of a made-up map.
class PointDescriptors {
 public:
  explicit PointDescriptors(std::size_t points) {
    Random random(21);
    for (std::size_t i = 0; i < points; ++i) descriptors_.push_back(MadeDescriptor(&random));
  }
  const Descriptor& operator[](std::size_t point) const { return descriptors_[point]; }

  // The entries of a keyframe that observes the points from `first` to `first + count - 1`.
  std::vector<DatabaseEntry> KeyFrame(KeyFrameId id, std::size_t first, std::size_t count,
                                      int noise = 6) const {
    Random random(1000 + id);
    std::vector<DatabaseEntry> entries;
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t point = (first + i) % descriptors_.size();
      entries.push_back({Disturbed(descriptors_[point], noise, &random), id, static_cast<MapPointId>(point),
                         Eigen::Vector2f(static_cast<float>(random.Below(640)), 3),
                         static_cast<std::uint8_t>(random.Below(4))});
    }
    return entries;
  }

 private:
  std::vector<Descriptor> descriptors_;
};
const PointDescriptors& Points() {
  static const PointDescriptors descriptors(2000);
  return descriptors;
}

void AddAll(const std::vector<DatabaseEntry>& entries, DescriptorDatabase* database) {
  for (const DatabaseEntry& entry : entries) database->Add(entry);
}

std::vector<Descriptor> DescriptorsOf(const std::vector<DatabaseEntry>& entries) {
  std::vector<Descriptor> descriptors;
  for (const DatabaseEntry& entry : entries) descriptors.push_back(entry.descriptor);
  return descriptors;
}

void ExpectSameResults(const DescriptorDatabase& a, const DescriptorDatabase& b) {
  const std::vector<Descriptor> queries = DescriptorsOf(Points().KeyFrame(999, 150, 300, 10));
  for (const bool each_keyframe : {false, true}) {
    DescriptorDatabase::MatchOptions options;
    options.each_keyframe = each_keyframe;
    const auto first = a.FindMatches(queries, options), second = b.FindMatches(queries, options);
    ASSERT_EQ(first.size(), second.size());
    for (std::size_t i = 0; i < first.size(); ++i) {
      EXPECT_EQ(first[i].query, second[i].query);
      EXPECT_EQ(first[i].entry, second[i].entry);
      EXPECT_EQ(first[i].distance, second[i].distance);
    }
  }
}

TEST(DescriptorDatabase, IsRestoredByRemovingAddedKeyFrames) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    Random random(seed);
    DescriptorDatabase database(MadeTree());
    for (KeyFrameId id = 0; id < 6; ++id) AddAll(Points().KeyFrame(id, 60 * id, 150), &database);
    const DescriptorDatabase before = database;
    // The entries of several keyframes are added interleaved, and an old keyframe is removed and added again.
    std::vector<DatabaseEntry> fresh;
    for (KeyFrameId id = 100; id < 105; ++id) {
      const auto entries = Points().KeyFrame(id, random.Below(2000), 50 + random.Below(200));
      fresh.insert(fresh.end(), entries.begin(), entries.end());
    }
    for (std::size_t i = fresh.size(); i > 1; --i)
      std::swap(fresh[i - 1], fresh[random.Below(static_cast<std::uint32_t>(i))]);
    AddAll(fresh, &database);
    const KeyFrameId removed = random.Below(6);
    database.RemoveKeyFrame(removed);
    EXPECT_FALSE(database == before);
    EXPECT_FALSE(database.Contains(removed));
    std::vector<KeyFrameId> order = {100, 101, 102, 103, 104};
    for (std::size_t i = order.size(); i > 1; --i)
      std::swap(order[i - 1], order[random.Below(static_cast<std::uint32_t>(i))]);
    for (const KeyFrameId id : order) database.RemoveKeyFrame(id);
    AddAll(Points().KeyFrame(removed, 60 * removed, 150), &database);
    EXPECT_TRUE(database == before);
    EXPECT_EQ(database.size(), before.size());
    ExpectSameResults(database, before);
  }
}

TEST(DescriptorDatabase, MatchesTheExpectedEntriesAfterRandomChanges) {
  Random random(5);
  DescriptorDatabase database(MadeTree());
  std::vector<DatabaseEntry> expected;
  for (int step = 0; step < 400; ++step) {
    const KeyFrameId keyframe = random.Below(12);
    switch (random.Below(8)) {
      case 0:
        database.RemoveKeyFrame(keyframe);
        std::erase_if(expected, [&](const DatabaseEntry& entry) { return entry.keyframe == keyframe; });
        break;
      case 1:
      case 2: {
        const MapPointId point = random.Below(40);
        database.RemoveObservation(keyframe, point);
        std::erase_if(expected, [&](const DatabaseEntry& entry) {
          return entry.keyframe == keyframe && entry.point == point;
        });
        break;
      }
      default:
        for (int i = 0; i < 5; ++i) {
          const MapPointId point = random.Below(40);
          const DatabaseEntry entry{Disturbed(Points()[point], 5, &random), keyframe, point, {1, 2}, 0};
          database.Add(entry);
          expected.push_back(entry);
        }
    }
    ASSERT_EQ(database.size(), expected.size());
  }
  DescriptorDatabase again(MadeTree());
  AddAll(expected, &again);
  EXPECT_TRUE(database == again);
  std::set<KeyFrameId> keyframes;
  for (const DatabaseEntry& entry : expected) keyframes.insert(entry.keyframe);
  for (KeyFrameId id = 0; id < 12; ++id) EXPECT_EQ(database.Contains(id), keyframes.contains(id));
  database.Clear();
  EXPECT_TRUE(database == DescriptorDatabase(MadeTree()));
}

TEST(DescriptorDatabase, EqualityComparesEveryFieldOfItsEntries) {
  const DatabaseEntry entry{Points()[0], 1, 2, {3, 4}, 1};
  std::vector<DatabaseEntry> others(5, entry);
  others[0].descriptor = Points()[1];
  others[1].keyframe = 7;
  others[2].point = 7;
  others[3].pixel.y() = 7;
  others[4].level = 2;
  DescriptorDatabase one(MadeTree());
  one.Add(entry);
  for (const DatabaseEntry& other : others) {
    DescriptorDatabase two(MadeTree());
    two.Add(other);
    EXPECT_FALSE(one == two);
  }
}

TEST(DescriptorMatches, FindThePointWithTheMostSimilarDescriptor) {
  DescriptorDatabase database(MadeTree());
  for (KeyFrameId id = 0; id < 10; ++id) AddAll(Points().KeyFrame(id, 100 * id, 300), &database);
  const std::vector<DatabaseEntry> seen = Points().KeyFrame(50, 200, 400);
  const auto matches = database.FindMatches(DescriptorsOf(seen), {});
  EXPECT_GT(matches.size(), 300u);
  std::set<MapPointId> points;
  std::size_t last = 0;
  for (const DatabaseMatch& match : matches) {
    EXPECT_EQ(match.entry.point, seen[match.query].point);
    EXPECT_EQ(match.distance, SquaredDistance(seen[match.query].descriptor, match.entry.descriptor));
    EXPECT_TRUE(points.insert(match.entry.point).second);
    EXPECT_GE(match.query, last);
    last = match.query;
  }
}

TEST(DescriptorMatches, AreUsuallyTheNearestOfAllEntries) {
  DescriptorDatabase database(MadeTree());
  std::vector<DatabaseEntry> all;
  for (KeyFrameId id = 0; id < 4; ++id) {
    const auto entries = Points().KeyFrame(id, 300 * id, 300);
    all.insert(all.end(), entries.begin(), entries.end());
  }
  AddAll(all, &database);
  DescriptorDatabase::MatchOptions options;
  options.leaves = 8;
  options.max_ratio = 1;
  options.mutual = false;
  const std::vector<Descriptor> queries = DescriptorsOf(Points().KeyFrame(50, 100, 300, 12));
  std::size_t exact = 0;
  for (const DatabaseMatch& match : database.FindMatches(queries, options)) {
    int least = match.distance;
    for (const DatabaseEntry& entry : all)
      least = std::min(least, SquaredDistance(queries[match.query], entry.descriptor));
    exact += least == match.distance;
  }
  EXPECT_GT(exact, 270u);
}

TEST(DescriptorMatches, AreRejectedWhereTwoPointsAreSimilar) {
  DescriptorDatabase database(MadeTree());
  Random random(8);
  database.Add({Disturbed(Points()[0], 3, &random), 1, 10, {1, 1}, 0});
  const Descriptor query = Disturbed(Points()[0], 3, &random);
  EXPECT_EQ(database.FindMatches(std::span(&query, 1), {}).size(), 1u);
  // A second observation of the same point is not ambiguous, another point is.
  database.Add({Disturbed(Points()[0], 3, &random), 2, 10, {1, 1}, 0});
  EXPECT_EQ(database.FindMatches(std::span(&query, 1), {}).size(), 1u);
  database.Add({Disturbed(Points()[0], 3, &random), 3, 11, {1, 1}, 0});
  EXPECT_EQ(database.FindMatches(std::span(&query, 1), {}).size(), 0u);
  // Within each single keyframe there is one unambiguous match.
  DescriptorDatabase::MatchOptions options;
  options.each_keyframe = true;
  const auto matches = database.FindMatches(std::span(&query, 1), options);
  ASSERT_EQ(matches.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(matches[i].entry.keyframe, i + 1);
  options.except_keyframe = 2;
  EXPECT_EQ(database.FindMatches(std::span(&query, 1), options).size(), 2u);
  options.each_keyframe = false;
  options.only_keyframe = 3;
  const auto only = database.FindMatches(std::span(&query, 1), options);
  ASSERT_EQ(only.size(), 1u);
  EXPECT_EQ(only[0].entry.point, 11u);
}

TEST(DescriptorMatches, AssignAPointToTheNearestDescriptorOnly) {
  DescriptorDatabase database(MadeTree());
  Random random(9);
  const Descriptor descriptor = Points()[5];
  database.Add({descriptor, 1, 10, {1, 1}, 0});
  const std::vector<Descriptor> queries = {Disturbed(descriptor, 5, &random),
                                           Disturbed(descriptor, 1, &random),
                                           Disturbed(descriptor, 7, &random)};
  for (const bool mutual : {false, true}) {
    DescriptorDatabase::MatchOptions options;
    options.mutual = mutual;
    const auto matches = database.FindMatches(queries, options);
    ASSERT_EQ(matches.size(), 1u);
    EXPECT_EQ(matches[0].query, 1u);
  }
}

TEST(DescriptorMatches, AreNotFoundForUnknownDescriptors) {
  DescriptorDatabase database(MadeTree());
  AddAll(Points().KeyFrame(1, 0, 500), &database);
  const auto matches = database.FindMatches(DescriptorsOf(Points().KeyFrame(2, 1000, 500)), {});
  EXPECT_LT(matches.size(), 5u);
  EXPECT_TRUE(DescriptorDatabase(MadeTree()).FindMatches(std::span(&Points()[0], 1), {}).empty());
  EXPECT_TRUE(database.FindMatches({}, {}).empty());
}

TEST(DescribedObservations, AreFoundFromAnotherPlaceAndFromTwiceTheDistance) {
  const auto world = testing_world::RenderedWorld::SingleWall(2, 4);
  const auto camera = testing_world::PinholeCamera(640, 480);
  const Rigid3 pose = testing_world::CameraAt({0, 0, 0});
  const Map map = testing_world::TrueMap(world, camera, {pose}, 400);
  const auto& record = map.keyframes().begin()->second;
  DescriptorDatabase database(DefaultVocabulary());
  for (const Observation& observation : record.observations)
    AddObservation(*record.keyframe.features, observation, 1, &database);
  EXPECT_GT(database.size(), 2 * record.observations.size());
  for (const Rigid3& other : {testing_world::CameraAt({0.3, 0.1, -0.2}, {0, -5, 30}),
                              testing_world::CameraAt({0, 0.1, -1.8}, {0, 0, -20})}) {
    const auto places = DescribeCorners(*MakeFeatures(world.Render(*camera, other, 1.5)));
    std::vector<Descriptor> queries;
    for (const DescribedKeypoint& place : places) queries.push_back(place.oriented.descriptor);
    const auto matches = database.FindMatches(queries, {});
    int right = 0;
    for (const DatabaseMatch& match : matches) {
      const auto point = std::find_if(map.points().begin(), map.points().end(), [&](const auto& candidate) {
        return candidate.point.id == match.entry.point;
      });
      ASSERT_NE(point, map.points().end());
      const auto expected = camera->Project(other * point->point.position());
      right += expected && (expected->cast<float>() - places[match.query].pixel).norm() <
                               static_cast<float>(3 << places[match.query].level);
    }
    EXPECT_GT(right, 20);  // a pose needs eight matches
    EXPECT_GT(right, static_cast<int>(matches.size()) / 2) << matches.size();
  }
  // Removing every observation leaves the database empty.
  for (const Observation& observation : record.observations)
    database.RemoveObservation(observation.keyframe, observation.point);
  EXPECT_EQ(database.size(), 0u);
}

}  // namespace
}  // namespace docent::engine
