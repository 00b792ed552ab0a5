// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/point_reports.h"

#include <gtest/gtest.h>

namespace docent::engine {
namespace {

using Attempt = MapTracker::Attempt;

TEST(PointReports, CountHowTheSearchesOfEachPointEnded) {
  PointReports reports;
  reports.Add(std::vector<Attempt>{{7, true, true}, {3, true, false}, {5, false, false}});
  reports.Add(std::vector<Attempt>{{4, true, true}, {7, true, true}, {3, false, false}});
  const auto taken = reports.Take();
  ASSERT_EQ(taken.size(), 4u);
  EXPECT_EQ(taken[0].point, 3u);
  EXPECT_EQ(taken[0].outlier, 1);
  EXPECT_EQ(taken[0].not_found, 1);
  EXPECT_EQ(taken[1].point, 4u);
  EXPECT_EQ(taken[1].inlier, 1);
  EXPECT_EQ(taken[2].point, 5u);
  EXPECT_EQ(taken[2].not_found, 1);
  EXPECT_EQ(taken[3].point, 7u);
  EXPECT_EQ(taken[3].inlier, 2);
}

TEST(PointReports, AreEmptyAfterTheyWereTakenOrCleared) {
  PointReports reports;
  reports.Add(std::vector<Attempt>{{7, true, true}});
  EXPECT_EQ(reports.Take().size(), 1u);
  EXPECT_TRUE(reports.Take().empty());
  reports.Add(std::vector<Attempt>{{7, true, true}});
  reports.Clear();
  EXPECT_TRUE(reports.Take().empty());
}

}  // namespace
}  // namespace docent::engine
