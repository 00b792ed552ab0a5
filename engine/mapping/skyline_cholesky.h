// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

namespace docent::engine {

// A symmetric positive definite matrix of square blocks, one row of blocks for each camera of a bundle, and
// its Cholesky factor, made in place. Of each row nothing is kept to the left of its first block, and the
// factor fills nothing there (George & Liu, "Computer Solution of Large Sparse Positive Definite Systems",
// 1981, ch. 4): keyframes of a walk, in the order of time, share points with their neighbours only, and a
// place seen again costs no more than its own row. Rows are gathered into panels, so that the work is
// products of dense matrices.
//
// Owned by one adjustment, used on its thread only.
class SkylineCholesky {
 public:
  static constexpr int kBlock = 6;

  // first[i] is the column of row i's first block, at most i.
  explicit SkylineCholesky(const std::vector<int>& first);

  int rows() const { return rows_; }
  std::size_t bytes() const { return values_.size() * sizeof(double); }

  void SetZero();
  // Block (row, column), column <= row and not left of the row's first. Only the lower triangle of the blocks
  // on the diagonal is read. Column-major with outer stride.
  using Block = Eigen::Map<Eigen::Matrix<double, kBlock, kBlock>, 0, Eigen::OuterStride<>>;
  Block At(int row, int column);

  enum class Outcome { kDone, kNotPositive, kInterrupted };
  // Replaces the matrix by its factor. `interrupted` is asked before every product of panels, that is about
  // every millisecond at the largest.
  Outcome Factor(const std::function<bool()>& interrupted);
  // After Factor(): solves in place for kBlock * rows() numbers.
  void Solve(Eigen::VectorXd* right_side) const;

 private:
  struct Panel {
    Eigen::Index first = 0;   // panel of the leftmost block
    Eigen::Index height = 0;  // scalars
    Eigen::Index offset = 0;  // into values_, column-major, `height` rows
  };
  using Part = Eigen::Map<Eigen::MatrixXd>;
  using ConstPart = Eigen::Map<const Eigen::MatrixXd>;

  // Columns of panel-row `row` from panel `begin` up to, not including, panel `end`.
  Part Columns(std::size_t row, Eigen::Index begin, Eigen::Index end);
  ConstPart Columns(std::size_t row, Eigen::Index begin, Eigen::Index end) const;
  Eigen::Index Width(Eigen::Index begin, Eigen::Index end) const;

  int rows_ = 0;
  std::vector<Panel> panels_;
  std::vector<double> values_;
};

}  // namespace docent::engine
