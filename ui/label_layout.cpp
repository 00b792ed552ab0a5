// SPDX-License-Identifier: Apache-2.0
#include "ui/label_layout.h"

#include <algorithm>
#include <limits>

namespace docent::ui {

namespace {

bool Overlaps(const Eigen::AlignedBox2d& a, const Eigen::AlignedBox2d& b, double gap) {
  return (a.min().array() < b.max().array() + gap).all() && (b.min().array() < a.max().array() + gap).all();
}

// The shifts that bring a board to the four sides of another one.
void AddShifts(const Eigen::AlignedBox2d& board, const Eigen::AlignedBox2d& other, double gap,
               std::vector<Eigen::Vector2d>* shifts) {
  // A little more than the gap, so that rounding does not count as an overlap.
  const double apart = gap + 1e-6;
  shifts->emplace_back(0, other.min().y() - apart - board.max().y());
  shifts->emplace_back(0, other.max().y() + apart - board.min().y());
  shifts->emplace_back(other.min().x() - apart - board.max().x(), 0);
  shifts->emplace_back(other.max().x() + apart - board.min().x(), 0);
}

// The board as near to its place as lies within the bounds, where it fits.
Eigen::AlignedBox2d Within(const Eigen::AlignedBox2d& bounds, const Eigen::AlignedBox2d& board) {
  const Eigen::Vector2d last = bounds.max() - board.sizes();
  return board.translated(board.min().cwiseMin(last).cwiseMax(bounds.min()) - board.min());
}

bool Fits(const Eigen::AlignedBox2d& bounds, const Eigen::AlignedBox2d& board) {
  constexpr double kRounding = 1e-6;
  return (board.sizes().array() <= bounds.sizes().array() + kRounding).all();
}

}  // namespace

std::vector<Eigen::AlignedBox2d> LayOutApart(std::span<const Eigen::AlignedBox2d> boards,
                                             const Eigen::AlignedBox2d& bounds, double gap) {
  std::vector<Eigen::AlignedBox2d> placed;
  placed.reserve(boards.size());
  for (const Eigen::AlignedBox2d& board : boards) {
    const auto is_free = [&](const Eigen::AlignedBox2d& at) {
      return std::none_of(placed.begin(), placed.end(),
                          [&](const auto& other) { return Overlaps(at, other, gap); });
    };
    Eigen::AlignedBox2d best = board;
    if (!is_free(board)) {
      std::vector<Eigen::Vector2d> shifts;
      for (const Eigen::AlignedBox2d& other : placed) AddShifts(board, other, gap, &shifts);
      double least = std::numeric_limits<double>::infinity();
      for (const Eigen::Vector2d& shift : shifts) {
        const Eigen::AlignedBox2d moved = Within(bounds, board.translated(shift));
        const double distance = (moved.min() - board.min()).norm();
        if (distance >= least || !Fits(bounds, moved) || !is_free(moved)) continue;
        least = distance;
        best = moved;
      }
    }
    placed.push_back(best);
  }
  return placed;
}

}  // namespace docent::ui
