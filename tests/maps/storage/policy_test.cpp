// SPDX-License-Identifier: Apache-2.0
#include "maps/storage/policy.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "maps/exchange/exchange.h"
#include "maps/library/library.h"
#include "maps/library/saver.h"
#include "maps/maintenance/maintenance.h"
#include "tests/maps/map_samples.h"

namespace docent::maps {
namespace {

using ::testing::HasSubstr;

constexpr Policy kAll[] = {Policy::kOpen, Policy::kBounded, Policy::kAugmentOnly, Policy::kReadOnly};

TEST(Policy, HasTheNamesOfTheCommandLine) {
  for (const Policy policy : kAll) EXPECT_EQ(ParsePolicy(ToString(policy)), policy);
  EXPECT_STREQ(ToString(Policy::kAugmentOnly), "augment-only");
  EXPECT_EQ(ParsePolicy("Open"), std::nullopt);
  EXPECT_EQ(ParsePolicy(""), std::nullopt);
}

TEST(Policy, ChecksTheBoundsOnlyOfABoundedMap) {
  const Bounds bounds{{0, 0, 0}, {1, 2, 3}};
  const Eigen::Vector3d inside(1, 1, 3), outside(1, 2.001, 1);
  EXPECT_TRUE(KeyFrameAllowed(Policy::kOpen, std::nullopt, outside));
  EXPECT_TRUE(KeyFrameAllowed(Policy::kBounded, bounds, inside));
  EXPECT_FALSE(KeyFrameAllowed(Policy::kBounded, bounds, outside));
  EXPECT_FALSE(KeyFrameAllowed(Policy::kBounded, std::nullopt, inside));
  EXPECT_FALSE(KeyFrameAllowed(Policy::kBounded, bounds, {std::nan(""), 1, 1}));
  EXPECT_FALSE(KeyFrameAllowed(Policy::kAugmentOnly, bounds, inside));
  EXPECT_FALSE(KeyFrameAllowed(Policy::kReadOnly, bounds, inside));
}

TEST(Policy, BoundsContainAllKeyframesAndIgnoreOutliers) {
  engine::MapSnapshot map;
  EXPECT_EQ(ComputeBounds(map), std::nullopt);
  engine::KeyFrame keyframe;
  keyframe.camera_from_map.translation = {0, 0, 5};  // Centre at (0, 0, -5).
  map.keyframes.push_back(keyframe);
  EXPECT_EQ(ComputeBounds(map), (Bounds{{0, 0, -5}, {0, 0, -5}}));
  for (int i = 0; i <= 1000; ++i) {
    engine::MapPoint point;
    point.point_in_map << i / 1000.0, -i / 500.0, 1, 1;
    if (i >= 997) point.point_in_map.head<3>() *= 1e6;
    map.points.push_back(point);
  }
  engine::MapPoint infinite;
  infinite.point_in_map << 1, 0, 0, 0;
  map.points.push_back(infinite);
  const Bounds bounds = *ComputeBounds(map);
  EXPECT_NEAR(bounds.min.y(), -1.98, 0.02);
  EXPECT_NEAR(bounds.max.x(), 0.99, 0.01);
  EXPECT_EQ(bounds.min.z(), -5);
  EXPECT_EQ(bounds.max.z(), 1);
}

// A library with a map of the given policy, and the expected result of each way of writing.
class EveryPolicy : public ::testing::TestWithParam<Policy> {
 protected:
  EveryPolicy() : library_(OpenToWrite(folder_ / "a.docent")) {
    key_ = library_.NewKey();
    library_.Save({key_, "Desk", GetParam(), map_, scene_});
  }
  bool structure() const { return GetParam() == Policy::kOpen || GetParam() == Policy::kBounded; }
  bool content() const { return GetParam() != Policy::kReadOnly; }
  // Runs `write`; a rejection must name the policy and change nothing.
  void ExpectAnswer(bool allowed, const std::function<void()>& write) {
    const auto before = library_.Load(key_);
    const std::string error = ErrorOf(write);
    if (allowed) {
      EXPECT_EQ(error, "");
      return;
    }
    EXPECT_THAT(error, HasSubstr(std::string("its policy is ") + ToString(GetParam())));
    const auto after = library_.Load(key_);
    EXPECT_EQ(after.info, before.info);
    EXPECT_EQ(FirstDifference(*after.snapshot, *before.snapshot), "");
    EXPECT_EQ(FirstDifference(after.scene, before.scene), "");
  }

  TemporaryFolder folder_;
  std::shared_ptr<engine::MapSnapshot> map_ = MakeSampleMap(1);
  std::shared_ptr<SceneRecord> scene_ = MakeSampleScene(1, 1);
  Library library_;
  std::uint64_t key_ = 0;
};

TEST_P(EveryPolicy, IsCheckedWhenAKeyframeIsAddedInside) {
  auto changed = std::make_shared<engine::MapSnapshot>(*map_);
  AddSampleKeyFrame(5, {0.05, 0, 0}, changed.get());
  ExpectAnswer(structure(), [&] { library_.Save({key_, "", Policy::kOpen, changed, nullptr}); });
}

TEST_P(EveryPolicy, IsCheckedWhenAKeyframeIsAddedOutside) {
  auto changed = std::make_shared<engine::MapSnapshot>(*map_);
  AddSampleKeyFrame(5, {50, 0, 0}, changed.get());
  ExpectAnswer(GetParam() == Policy::kOpen, [&] {
    library_.Save({key_, "", Policy::kOpen, changed, nullptr});
  });
}

TEST_P(EveryPolicy, IsCheckedWhenAKeyframeMovesOrIsRemoved) {
  auto changed = std::make_shared<engine::MapSnapshot>(*map_);
  changed->keyframes[1].camera_from_map.translation.x() += 0.001;
  ExpectAnswer(structure(), [&] { library_.Save({key_, "", Policy::kOpen, changed, nullptr}); });
  changed = std::make_shared<engine::MapSnapshot>(*map_);
  changed->keyframes.clear();
  changed->points.clear();
  changed->observations.clear();
  changed->panoramas.clear();
  ExpectAnswer(structure(), [&] { library_.Save({key_, "", Policy::kOpen, changed, nullptr}); });
}

TEST_P(EveryPolicy, IsCheckedWhenAPanoramaMapIsAdded) {
  auto changed = std::make_shared<engine::MapSnapshot>(*map_);
  changed->panoramas.push_back({changed->next_panorama, changed->keyframes[1].id});
  changed->keyframes[1].panorama = changed->next_panorama++;
  ExpectAnswer(structure(), [&] { library_.Save({key_, "", Policy::kOpen, changed, nullptr}); });
}

TEST_P(EveryPolicy, IsCheckedWhenAnImageIsReplaced) {
  auto changed = std::make_shared<engine::MapSnapshot>(*map_);
  changed->keyframes[0].features = MakeSampleMap(77)->keyframes[0].features;
  ExpectAnswer(structure(), [&] { library_.Save({key_, "", Policy::kOpen, changed, nullptr}); });
}

TEST_P(EveryPolicy, IsCheckedWhenAPointOrAnObservationChanges) {
  auto changed = std::make_shared<engine::MapSnapshot>(*map_);
  changed->points[0].point_in_map.x() += 1;
  ExpectAnswer(structure(), [&] { library_.Save({key_, "", Policy::kOpen, changed, nullptr}); });
  changed = std::make_shared<engine::MapSnapshot>(*map_);
  changed->observations.pop_back();
  ExpectAnswer(structure(), [&] { library_.Save({key_, "", Policy::kOpen, changed, nullptr}); });
}

TEST_P(EveryPolicy, IsCheckedWhenContentChanges) {
  ExpectAnswer(content(), [&] { library_.Save({key_, "", Policy::kOpen, nullptr, MakeSampleScene(9, 2)}); });
}

TEST_P(EveryPolicy, AllowsSavingContentWithAnUnchangedStructure) {
  const auto loaded = library_.Load(key_).snapshot;
  ExpectAnswer(content(), [&] { library_.Save({key_, "", Policy::kOpen, loaded, MakeSampleScene(9, 2)}); });
}

TEST_P(EveryPolicy, AllowsASaveThatChangesNothing) {
  const auto before = library_.Find(key_);
  library_.Save({key_, "", Policy::kOpen, library_.Load(key_).snapshot, scene_});
  EXPECT_EQ(library_.Find(key_), before);
}

TEST_P(EveryPolicy, IsCheckedWhenAMapIsRenamed) {
  ExpectAnswer(content(), [&] { library_.Rename(key_, "Table"); });
}

TEST_P(EveryPolicy, IsCheckedWhenAMapIsRemoved) {
  ExpectAnswer(structure(), [&] { library_.Remove(key_); });
}

TEST_P(EveryPolicy, IsCheckedByTheSaverInTheBackground) {
  auto changed = std::make_shared<engine::MapSnapshot>(*map_);
  changed->points[0].point_in_map.x() += 1;
  Saver saver(&library_);
  const auto save = [&](MapRecord record) {
    saver.Submit(std::move(record));
    saver.Flush();
    if (const auto error = saver.TakeError()) std::rethrow_exception(error);
  };
  ExpectAnswer(structure(), [&] { save({key_, "", Policy::kOpen, changed, nullptr}); });
  ExpectAnswer(content(), [&] { save({key_, "", Policy::kOpen, nullptr, MakeSampleScene(9, 2)}); });
}

TEST_P(EveryPolicy, IsCheckedWhenAnAdjustedMapIsSaved) {
  auto changed = std::make_shared<engine::MapSnapshot>(*map_);
  for (engine::MapPoint& point : changed->points) {
    if (!point.infinite()) point.point_in_map.head<3>() *= 1.001;
  }
  ++changed->revision;
  MapRecord record{key_, "", Policy::kOpen, changed, nullptr};
  record.expected_revision = map_->revision;
  ExpectAnswer(structure(), [&] { EXPECT_TRUE(library_.Save(record)); });
  if (!structure()) return;
  const auto saved = library_.Find(key_);
  EXPECT_FALSE(library_.Save(record)) << "the stored map has changed since";
  EXPECT_EQ(library_.Find(key_), saved);
}

TEST_P(EveryPolicy, IsCheckedWhenTheMapIsOptimized) {
  auto crooked = std::make_shared<engine::MapSnapshot>(*MakeTrueMap());
  for (engine::MapPoint& point : crooked->points) point.point_in_map.z() += point.id % 2 == 0 ? 0.02 : -0.02;
  Library library = Library::Open(folder_ / "b.docent", Access::kReadWrite, CreateIfMissing::kYes);
  const std::uint64_t key = library.NewKey();
  library.Save({key, "Crooked", GetParam(), crooked, nullptr});
  const Optimization result = OptimizeMap(&library, key, nullptr);
  const bool same = FirstDifference(*library.Load(key).snapshot, *crooked).empty();
  EXPECT_EQ(result.outcome,
            structure() ? Optimization::Outcome::kAdjusted : Optimization::Outcome::kNotAllowed);
  EXPECT_EQ(same, !structure());
}

TEST_P(EveryPolicy, IsImportedWithTheMapAndExistingMapsAreUnchanged) {
  const auto before = library_.Load(key_);
  {
    Library other = OpenToWrite(folder_ / "b.docent");
    other.Save({other.NewKey(), "Desk", GetParam(), MakeSampleMap(8), MakeSampleScene(8, 1)});
    ImportMaps(other, folder_ / "a.docent");
  }
  const auto after = library_.Load(key_);
  EXPECT_EQ(after.info, before.info);
  EXPECT_EQ(FirstDifference(*after.snapshot, *before.snapshot), "");
  EXPECT_EQ(FirstDifference(after.scene, before.scene), "");
  key_ = library_.FindByName("Desk (2)").key;
  EXPECT_EQ(library_.Find(key_).policy, GetParam());
  ExpectAnswer(structure(), [&] {
    library_.Save({key_, "", Policy::kOpen, MakeSampleMap(8, {.points = 50}), nullptr});
  });
  ExpectAnswer(content(), [&] { library_.Save({key_, "", Policy::kOpen, nullptr, MakeSampleScene(9, 2)}); });
}

TEST_P(EveryPolicy, IsRelaxedOnlyBySetPolicy) {
  library_.Save({key_, "", Policy::kOpen, nullptr, nullptr});
  EXPECT_EQ(library_.Find(key_).policy, GetParam());
  library_.SetPolicy(key_, Policy::kOpen);
  auto changed = std::make_shared<engine::MapSnapshot>(*map_);
  AddSampleKeyFrame(5, {50, 0, 0}, changed.get());
  library_.Save({key_, "", Policy::kOpen, changed, MakeSampleScene(3, 0)});
  EXPECT_EQ(FirstDifference(*library_.Load(key_).snapshot, *changed), "");
}

TEST_P(EveryPolicy, CannotBeChangedInALibraryThatWasOpenedReadOnly) {
  Library visitor = OpenToRead(folder_ / "a.docent");
  const std::function<void()> writes[] = {
      [&] { visitor.NewKey(); },
      [&] {
        visitor.Save({key_, "", Policy::kOpen, MakeSampleMap(8), nullptr});
      },
      [&] {
        visitor.Save({key_, "", Policy::kOpen, nullptr, MakeSampleScene(8, 1)});
      },
      [&] { visitor.Rename(key_, "Table"); },
      [&] { visitor.Remove(key_); },
      [&] { visitor.SetPolicy(key_, Policy::kOpen); },
  };
  for (const auto& write : writes) EXPECT_THAT(ErrorOf(write), HasSubstr("was opened read-only"));
}

INSTANTIATE_TEST_SUITE_P(Policies, EveryPolicy, ::testing::ValuesIn(kAll));

TEST(BoundedMap, KeepsItsOriginalBoundsUntilItIsOpen) {
  const TemporaryFolder folder;
  Library library = OpenToWrite(folder / "a.docent");
  const std::uint64_t key = library.NewKey();
  auto map = MakeSampleMap(1);
  library.Save({key, "Desk", Policy::kOpen, map, nullptr});
  EXPECT_EQ(library.Find(key).bounds, std::nullopt);
  library.SetPolicy(key, Policy::kBounded);
  const auto bounds = library.Find(key).bounds;
  ASSERT_TRUE(bounds);
  EXPECT_EQ(bounds, ComputeBounds(*map));
  AddSampleKeyFrame(5, bounds->max, map.get());
  library.Save({key, "", Policy::kOpen, map, nullptr});
  for (const Policy policy : {Policy::kReadOnly, Policy::kBounded}) library.SetPolicy(key, policy);
  EXPECT_EQ(library.Find(key).bounds, bounds);
  library.SetPolicy(key, Policy::kOpen);
  EXPECT_EQ(library.Find(key).bounds, std::nullopt);

  const std::uint64_t empty = library.NewKey();
  library.Save({empty, "Empty", Policy::kOpen, nullptr, nullptr});
  EXPECT_THAT(ErrorOf([&] { library.SetPolicy(empty, Policy::kBounded); }), HasSubstr("without keyframes"));
}

}  // namespace
}  // namespace docent::maps
