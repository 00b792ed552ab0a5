// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/mapper_queue.h"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>
#include <variant>

namespace docent::engine {
namespace {

KeyFrameCandidate CandidateAt(int second) {
  KeyFrameCandidate candidate;
  candidate.time = std::chrono::seconds(second);
  return candidate;
}

TEST(MapperQueue, GivesRequestsInOrderAndRefusesThemWhenItIsFull) {
  MapperQueue queue(2);
  EXPECT_TRUE(queue.Offer(CandidateAt(1)));
  EXPECT_TRUE(queue.Offer(InitialPair()));
  EXPECT_FALSE(queue.Offer(CandidateAt(3)));
  EXPECT_EQ(queue.Length(), 2u);
  const auto first = queue.BeginStep();
  ASSERT_TRUE(first);
  EXPECT_EQ(std::get<KeyFrameCandidate>(*first).time, std::chrono::seconds(1));
  const auto second = queue.BeginStep();
  ASSERT_TRUE(second);
  EXPECT_TRUE(std::holds_alternative<InitialPair>(*second));
  EXPECT_FALSE(queue.BeginStep());
}

TEST(MapperQueue, InterruptsWorkWhileARequestWaits) {
  MapperQueue queue(3);
  EXPECT_FALSE(*queue.interrupt());
  queue.Offer(CandidateAt(1));
  queue.Offer(CandidateAt(2));
  EXPECT_TRUE(*queue.interrupt());
  queue.BeginStep();
  EXPECT_TRUE(*queue.interrupt()) << "another one waits";
  queue.BeginStep();
  EXPECT_FALSE(*queue.interrupt());
  queue.Offer(CandidateAt(3));
  EXPECT_TRUE(*queue.interrupt());
}

TEST(MapperQueue, InterruptsAStepUntilTheNextOne) {
  MapperQueue queue(3);
  queue.BeginStep();
  EXPECT_FALSE(*queue.interrupt());
  queue.Interrupt();
  EXPECT_TRUE(*queue.interrupt());
  queue.EndWork();
  queue.BeginStep();
  EXPECT_FALSE(*queue.interrupt());
}

TEST(MapperQueue, MeasuresHowLongWorkDelaysARequest) {
  constexpr auto kWork = std::chrono::milliseconds(20);
  MapperQueue queue(3);
  queue.Offer(CandidateAt(1));
  queue.BeginStep();
  EXPECT_EQ(queue.EndWork(), 0) << "what was offered before the work is not delayed by it";
  queue.BeginOtherWork();
  queue.Offer(CandidateAt(2));
  std::this_thread::sleep_for(kWork);
  queue.Offer(CandidateAt(3));
  EXPECT_GE(queue.EndWork(), 0.02) << "from the first offer on";
  queue.BeginOtherWork();
  EXPECT_EQ(queue.EndWork(), 0);
}

TEST(MapperQueue, GivesReportsOnceAndDropsEverythingWhenCleared) {
  MapperQueue queue(3);
  queue.Report({{.point = 7, .inlier = 1}});
  queue.Report({{.point = 8, .not_found = 2}});
  const auto reports = queue.TakeReports();
  ASSERT_EQ(reports.size(), 2u);
  EXPECT_EQ(reports[1].point, 8u);
  EXPECT_TRUE(queue.TakeReports().empty());
  queue.Report({{.point = 9}});
  queue.Offer(CandidateAt(1));
  queue.Clear();
  EXPECT_EQ(queue.Length(), 0u);
  EXPECT_TRUE(queue.TakeReports().empty());
}

}  // namespace
}  // namespace docent::engine
