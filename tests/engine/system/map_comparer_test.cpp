// SPDX-License-Identifier: Apache-2.0
#include "engine/system/map_comparer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <future>
#include <memory>
#include <optional>
#include <semaphore>
#include <utility>
#include <variant>

#include "engine/system/mapping_thread.h"
#include "tests/engine/mapping/loops/gallery.h"

namespace docent::engine {
namespace {

using testing_world::InTheGallery;
using testing_world::VariedGallery;

// The map of a walk along the gallery.
std::shared_ptr<const MapSnapshot> MapOfGallery(double from, double to) {
  std::vector<Rigid3> poses;
  for (double x = from; x <= to; x += 0.2) poses.push_back(InTheGallery(x, 0));
  return testing_world::MapOfGallery(VariedGallery(), poses).Snapshot();
}
const std::shared_ptr<const MapSnapshot>& Left() {
  static const auto map = MapOfGallery(0, 3.4);
  return map;
}
const std::shared_ptr<const MapSnapshot>& Right() {
  static const auto map = MapOfGallery(2.1, 6);
  return map;
}

template <typename Result>
bool IsReady(std::future<Result>& result) {
  return result.wait_for(std::chrono::minutes(2)) == std::future_status::ready;
}

TEST(MapComparer, GivesTheResultOfTheLastComparisonOnce) {
  std::promise<void> done;
  MapComparer comparer({}, [&] { done.set_value(); });
  EXPECT_FALSE(comparer.Take());
  comparer.Start(7, Left(), Right());
  auto ready = done.get_future();
  ASSERT_TRUE(IsReady(ready));
  const auto result = comparer.Take();
  ASSERT_TRUE(result);
  EXPECT_EQ(result->number, 7u);
  EXPECT_EQ(result->comparison.a, Left());
  EXPECT_EQ(result->comparison.b, Right());
  EXPECT_EQ(result->comparison.overlap.outcome, MapOverlap::Outcome::kOverlap);
  EXPECT_GT(result->comparison.seconds, 0);
  EXPECT_FALSE(comparer.Take());
}

TEST(MapComparer, DropsAComparisonThatAnotherOneFollows) {
  std::counting_semaphore<> done{0};
  MapComparer comparer({}, [&] { done.release(); });
  comparer.Start(1, Left(), Right());
  comparer.Start(2, Left(), std::make_shared<MapSnapshot>());
  std::optional<MapComparer::Result> result;
  // On a busy machine the first one may be done before it is dropped.
  while (!result && done.try_acquire_for(std::chrono::minutes(2))) result = comparer.Take();
  ASSERT_TRUE(result);
  EXPECT_EQ(result->number, 2u);
  EXPECT_EQ(result->comparison.overlap.outcome, MapOverlap::Outcome::kNothingToCompare);
}

TEST(MapComparer, HasNoResultOfACancelledComparison) {
  std::promise<void> done;
  MapComparer comparer({}, [&] { done.set_value(); });
  comparer.Start(1, Left(), Right());
  auto ready = done.get_future();
  ASSERT_TRUE(IsReady(ready));
  comparer.Cancel();
  EXPECT_FALSE(comparer.Take());
}

// A mapper of the left part, with the updates that report a join.
class JoiningThread : public testing::Test {
 protected:
  using Update = MappingThread::MapperUpdate;
  JoiningThread() { mapping_.Adopt(1, Left()); }
  ~JoiningThread() override { mapping_.Finish(); }

  std::promise<Update> joined_;
  std::promise<void> held_, adjusted_again_;
  bool hold_ = false;  // keep the mapper from its next step after a join
  bool adjusted_ = false;
  MappingThread mapping_{{}, true, [this](const Update& update) {
                           if (update.join) {
                             joined_.set_value(update);
                             if (hold_) held_.get_future().wait();
                             return;
                           }
                           const bool adjusted =
                               std::ranges::any_of(update.events, [](const MapperEvent& event) {
                                 return std::holds_alternative<MapperEvent::GloballyAdjusted>(event.what);
                               });
                           if (hold_ && adjusted && !std::exchange(adjusted_, true))
                             adjusted_again_.set_value();
                         }};
};

TEST_F(JoiningThread, ReportsTheJoinedMap) {
  mapping_.Join(1, 5, Right());
  EXPECT_FALSE(mapping_.IsIdle()) << "maps are being compared";
  auto report = joined_.get_future();
  ASSERT_TRUE(IsReady(report));
  const Update update = report.get();
  EXPECT_EQ(update.key, 1u);
  EXPECT_EQ(update.join->number, 5u);
  ASSERT_NE(update.join->attempt.joined, nullptr);
  EXPECT_EQ(update.snapshot, update.join->attempt.joined->map);
  EXPECT_EQ(Validate(*update.snapshot), "");
  EXPECT_EQ(update.snapshot->keyframes.size(), Left()->keyframes.size() + Right()->keyframes.size());
}

TEST_F(JoiningThread, AdjustsTheSeamOfAMapThatWasLeftBefore) {
  hold_ = true;
  mapping_.Join(1, 5, Right());
  auto report = joined_.get_future();
  ASSERT_TRUE(IsReady(report));
  mapping_.Adopt(1, report.get().snapshot);
  held_.set_value();
  auto again = adjusted_again_.get_future();
  EXPECT_TRUE(IsReady(again)) << "nothing else makes an adjustment of the whole map due";
}

TEST_F(JoiningThread, ReportsWhyMapsAreNotJoined) {
  mapping_.Join(1, 5, std::make_shared<MapSnapshot>());
  auto report = joined_.get_future();
  ASSERT_TRUE(IsReady(report));
  const Update update = report.get();
  EXPECT_EQ(update.join->attempt.joined, nullptr);
  EXPECT_EQ(update.join->attempt.refusal, JoinRefusal::kNoOverlap);
  EXPECT_EQ(update.snapshot, nullptr);
}

TEST_F(JoiningThread, ReportsNothingOfAMapThatWasAdoptedAgain) {
  mapping_.Join(1, 5, Right());
  mapping_.Adopt(1, Left());
  mapping_.WaitUntilIdle(std::chrono::steady_clock::now() + std::chrono::minutes(2), {});
  EXPECT_TRUE(mapping_.IsIdle());
  auto report = joined_.get_future();
  EXPECT_EQ(report.wait_for(std::chrono::seconds(0)), std::future_status::timeout);
}

}  // namespace
}  // namespace docent::engine
