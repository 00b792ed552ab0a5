// SPDX-License-Identifier: Apache-2.0
#include "maps/maintenance/maintenance.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <mutex>
#include <thread>

#include "engine/base/random.h"
#include "engine/vision/features.h"
#include "tests/maps/map_samples.h"

namespace docent::maps {
namespace {

using ::testing::IsEmpty;

TEST(Maintenance, RestoresAPerturbedMapToGroundTruth) {
  const TemporaryFolder folder;
  Library library = Library::Open(folder / "a.docent", Access::kReadWrite, CreateIfMissing::kYes);
  const auto truth = MakeTrueMap();
  ASSERT_EQ(engine::Validate(*truth), "");
  EXPECT_LT(ReprojectionRms(*truth, *truth), 1e-4);
  auto crooked = std::make_shared<engine::MapSnapshot>(*truth);
  Random random(4);
  for (engine::KeyFrame& keyframe : crooked->keyframes) {
    if (!keyframe.fixed) keyframe.camera_from_map.translation.x() += random.Uniform(-0.01, 0.01);
  }
  for (engine::MapPoint& point : crooked->points) point.point_in_map[2] += random.Uniform(-0.02, 0.02);
  for (const Policy policy : {Policy::kOpen, Policy::kReadOnly}) {
    const std::uint64_t key = library.NewKey();
    library.Save({key, ToString(policy), policy, crooked, nullptr});
    const Optimization result = OptimizeMap(&library, key, nullptr);
    const auto stored = library.Load(key).snapshot;
    if (policy == Policy::kReadOnly) {
      EXPECT_EQ(result.outcome, Optimization::Outcome::kNotAllowed);
      EXPECT_EQ(FirstDifference(*stored, *crooked), "");
      continue;
    }
    EXPECT_EQ(result.outcome, Optimization::Outcome::kAdjusted);
    EXPECT_GT(result.rms_before_px, 0.3);
    EXPECT_LT(result.rms_after_px, 0.01);
    for (std::size_t i = 0; i < stored->keyframes.size(); ++i) {
      EXPECT_LT(
          (stored->keyframes[i].camera_from_map.translation - truth->keyframes[i].camera_from_map.translation)
              .norm(),
          1e-3);
    }
    const std::atomic<bool> interrupt = true;
    EXPECT_NE(OptimizeMap(&library, key, &interrupt).outcome, Optimization::Outcome::kAdjusted);
  }
  EXPECT_THAT(library.Verify(), IsEmpty());
}

TEST(Maintenance, MovesContentWithItsAnchor) {
  const TemporaryFolder folder;
  Library library = Library::Open(folder / "a.docent", Access::kReadWrite, CreateIfMissing::kYes);
  auto crooked = std::make_shared<engine::MapSnapshot>(*MakeTrueMap());
  Random random(4);
  for (engine::MapPoint& point : crooked->points) point.point_in_map[2] += random.Uniform(-0.02, 0.02);
  const std::uint64_t key = library.NewKey();
  library.Save(
      {key, "a", Policy::kOpen, crooked, MakeTextScene("here"), {}, {}, {}, {}, MakeTextScene("came here")});
  const auto move = [&](const StoredContent& content, const engine::MapSnapshot& before,
                        const engine::MapSnapshot& after) {
    EXPECT_EQ(content.scene->text, "here");
    EXPECT_EQ(content.history->text, "came here");
    EXPECT_EQ(FirstDifference(before, *crooked), "");
    EXPECT_NE(FirstDifference(after, *crooked), "");
    return StoredContent{MakeTextScene("there"), MakeTextScene("came there")};
  };
  ASSERT_EQ(OptimizeMap(&library, key, nullptr, move).outcome, Optimization::Outcome::kAdjusted);
  EXPECT_EQ(library.Load(key).scene.text, "there");
  EXPECT_EQ(library.LoadHistory(key)->text, "came there");
}

TEST(Maintenance, KeepsChangesOfAnotherProgram) {
  const TemporaryFolder folder;
  LibraryOptions options;
  std::optional<Library> other;
  std::uint64_t key = 0;
  auto crooked = std::make_shared<engine::MapSnapshot>(*MakeTrueMap());
  for (engine::MapPoint& point : crooked->points) point.point_in_map.z() += point.id % 2 == 0 ? 0.02 : -0.02;
  const auto theirs = MakeSampleMap(5);
  theirs->revision = crooked->revision + 7;
  // The other one saves while this one reads the images, after this one's transaction has begun.
  std::once_flag once;
  std::jthread saves;
  options.make_features = [&](const cv::Mat& gray) {
    std::call_once(once, [&] {
      saves = std::jthread([&] { other->Save({key, "", Policy::kOpen, theirs, nullptr}); });
      saves.join();
    });
    return engine::MakeFeatures(gray);
  };
  Library library = Library::Open(folder / "a.docent", Access::kReadWrite, CreateIfMissing::kYes, options);
  key = library.NewKey();
  library.Save({key, "Desk", Policy::kOpen, crooked, nullptr});
  other.emplace(Library::Open(folder / "a.docent", Access::kReadWrite, CreateIfMissing::kNo, QuickOptions()));
  EXPECT_EQ(OptimizeMap(&library, key, nullptr).outcome, Optimization::Outcome::kChangedMeanwhile);
  EXPECT_EQ(FirstDifference(*other->Load(key).snapshot, *theirs), "");
}

TEST(Maintenance, KeepsContentThatAnotherProgramSavesMeanwhile) {
  const TemporaryFolder folder;
  auto crooked = std::make_shared<engine::MapSnapshot>(*MakeTrueMap());
  for (engine::MapPoint& point : crooked->points) point.point_in_map.z() += point.id % 2 == 0 ? 0.02 : -0.02;
  Library library = Library::Open(folder / "a.docent", Access::kReadWrite, CreateIfMissing::kYes);
  const std::uint64_t key = library.NewKey();
  library.Save({key, "Desk", Policy::kOpen, crooked, MakeTextScene("ours")});
  Library other = OpenToWrite(folder / "a.docent");
  // Content moves after the map was read and before the result is saved.
  const auto move = [&](const StoredContent&, const engine::MapSnapshot&, const engine::MapSnapshot&) {
    other.Save({key, "", Policy::kOpen, nullptr, MakeTextScene("theirs")});
    return StoredContent{MakeTextScene("ours, moved"), nullptr};
  };
  EXPECT_EQ(OptimizeMap(&library, key, nullptr, move).outcome, Optimization::Outcome::kChangedMeanwhile);
  EXPECT_EQ(other.LoadScene(key).text, "theirs");
  EXPECT_EQ(FirstDifference(*other.Load(key).snapshot, *crooked), "");
}

TEST(Maintenance, CullsRedundantKeyframesOfAnIdleMap) {
  auto map = std::make_shared<engine::MapSnapshot>(*MakeTrueMap(12, 0.02));
  ASSERT_EQ(engine::Validate(*map), "");
  const AdjustedMap adjusted = AdjustIdleMap(*map, nullptr);
  ASSERT_EQ(adjusted.optimization.outcome, Optimization::Outcome::kAdjusted);
  EXPECT_EQ(adjusted.optimization.keyframes_removed, 4u) << "all except the eight that every map keeps";
  EXPECT_EQ(adjusted.snapshot->keyframes.size(), 8u);
  EXPECT_EQ(adjusted.snapshot->points.size(), map->points.size()) << "no point is lost";
  EXPECT_EQ(adjusted.optimization.observations_removed, 0u);
  EXPECT_EQ(engine::Validate(*adjusted.snapshot), "");
  EXPECT_GT(adjusted.snapshot->revision, map->revision);
}

}  // namespace
}  // namespace docent::maps
