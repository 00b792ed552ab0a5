// SPDX-License-Identifier: Apache-2.0
#include "ui/label_layout.h"

#include <gtest/gtest.h>

#include "engine/base/random.h"

namespace docent::ui {
namespace {

using Box = Eigen::AlignedBox2d;

const Box kCanvas(Eigen::Vector2d(0, 0), Eigen::Vector2d(1000, 800));

Box BoardAt(double x, double y, double width, double height) {
  return {Eigen::Vector2d(x, y), Eigen::Vector2d(x + width, y + height)};
}

int CountOverlaps(const std::vector<Box>& boards) {
  int count = 0;
  for (std::size_t i = 0; i < boards.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) count += boards[i].intersection(boards[j]).isEmpty() ? 0 : 1;
  }
  return count;
}

TEST(LabelLayout, LeavesBoardsThatAreApartWhereTheyAre) {
  const std::vector<Box> boards = {BoardAt(100, 100, 200, 50), BoardAt(100, 160, 200, 50),
                                   BoardAt(310, 100, 80, 200)};
  const auto placed = LayOutApart(boards, kCanvas, 5);
  for (std::size_t i = 0; i < boards.size(); ++i) EXPECT_TRUE(placed[i].isApprox(boards[i])) << i;
}

TEST(LabelLayout, MovesABoardByAsLittleAsItTakes) {
  const auto placed =
      LayOutApart(std::vector<Box>{BoardAt(100, 100, 200, 50), BoardAt(110, 130, 200, 50)}, kCanvas, 4);
  EXPECT_TRUE(placed[0].isApprox(BoardAt(100, 100, 200, 50)));
  EXPECT_LT((placed[1].min() - Eigen::Vector2d(110, 154)).norm(), 1e-3);
}

TEST(LabelLayout, KeepsManyBoardsApartAndInside) {
  Random random(5);
  for (int run = 0; run < 50; ++run) {
    std::vector<Box> boards;
    for (int i = 0; i < 12; ++i)
      boards.push_back(BoardAt(random.Uniform(300, 500), random.Uniform(300, 400), random.Uniform(80, 160),
                               random.Uniform(30, 60)));
    const auto placed = LayOutApart(boards, kCanvas, 3);
    EXPECT_EQ(CountOverlaps(placed), 0) << run;
    EXPECT_GT(CountOverlaps(boards), 10) << run;
    for (std::size_t i = 0; i < boards.size(); ++i) {
      EXPECT_TRUE(kCanvas.contains(placed[i]));
      EXPECT_TRUE(placed[i].sizes().isApprox(boards[i].sizes(), 1e-9));
    }
  }
}

TEST(LabelLayout, ABoardThatHasToMoveComesInsideFromTheEdge) {
  const std::vector<Box> boards = {BoardAt(10, 10, 100, 30), BoardAt(-80, 20, 200, 50)};
  const auto placed = LayOutApart(boards, kCanvas, 4);
  EXPECT_TRUE(placed[0].isApprox(boards[0]));
  EXPECT_EQ(CountOverlaps(placed), 0);
  EXPECT_NEAR((placed[1].min() - Eigen::Vector2d(0, 44)).norm(), 0, 1e-3);
  const std::vector<Box> alone = {BoardAt(-80, 20, 200, 50)};
  EXPECT_TRUE(LayOutApart(alone, kCanvas, 4)[0].isApprox(alone[0])) << "it covers nothing";
}

TEST(LabelLayout, BoardsWithoutRoomAreNotMoved) {
  const std::vector<Box> boards(3, BoardAt(0, 0, 1000, 800));
  for (const Box& board : LayOutApart(boards, kCanvas, 2)) EXPECT_TRUE(board.isApprox(boards[0]));
}

TEST(LabelLayout, ASmallMotionMovesTheBoardsLittle) {
  // A camera that turns slowly: all boards move by a pixel.
  std::vector<Box> boards = {BoardAt(400, 300, 150, 40), BoardAt(420, 310, 150, 40),
                             BoardAt(430, 325, 150, 40)};
  auto before = LayOutApart(boards, kCanvas, 3);
  for (int step = 0; step < 100; ++step) {
    for (Box& board : boards) board.translate(Eigen::Vector2d(1, 0.5));
    const auto after = LayOutApart(boards, kCanvas, 3);
    for (std::size_t i = 0; i < boards.size(); ++i)
      EXPECT_LT((after[i].min() - before[i].min()).norm(), 2) << step;
    before = after;
  }
}

}  // namespace
}  // namespace docent::ui
