// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

namespace docent::engine {

// A symmetric positive definite matrix of square blocks, one row of blocks per camera of a bundle problem,
// and its Cholesky factor, computed in place. Nothing is stored to the left of the first block of a row, and
// the factor has no fill-in there (George & Liu, "Computer Solution of Large Sparse Positive Definite
// Systems", 1981, ch. 4). In the order of time, keyframes of a path share points with their neighbours only,
// and a place seen again costs no more than its own row. Rows are grouped into panels, so that the work
// consists of products of dense matrices.
//
// Owned by one adjustment and used on its thread only.
class SkylineCholesky {
 public:
  static constexpr int kBlock = 6;

  // first[i]: column of the first block of row i, at most i.
  explicit SkylineCholesky(const std::vector<int>& first);

  int rows() const { return rows_; }
  std::size_t bytes() const { return values_.size() * sizeof(double); }

  void SetZero();
  // Block (row, column) with column <= row, not left of the row's first block. Only the lower triangle of the
  // diagonal blocks is read. Column-major with outer stride.
  using Block = Eigen::Map<Eigen::Matrix<double, kBlock, kBlock>, 0, Eigen::OuterStride<>>;
  Block At(int row, int column);

  enum class Outcome { kDone, kNotPositive, kInterrupted };
  // Replaces the matrix by its factor. Calls `interrupted` before every product of panels, which is about
  // every millisecond for the largest problems.
  Outcome Factor(const std::function<bool()>& interrupted);
  // After Factor(): solves in place for kBlock * rows() values.
  void Solve(Eigen::VectorXd* right_side) const;

 private:
  struct Panel {
    Eigen::Index first = 0;   // index of the panel of the leftmost block
    Eigen::Index height = 0;  // in scalars
    Eigen::Index offset = 0;  // into values_; column-major with `height` rows
  };
  using Part = Eigen::Map<Eigen::MatrixXd>;
  using ConstPart = Eigen::Map<const Eigen::MatrixXd>;

  // The columns of panel-row `row` from panel `begin` up to, not including, panel `end`.
  Part Columns(std::size_t row, Eigen::Index begin, Eigen::Index end);
  ConstPart Columns(std::size_t row, Eigen::Index begin, Eigen::Index end) const;
  Eigen::Index Width(Eigen::Index begin, Eigen::Index end) const;

  int rows_ = 0;
  std::vector<Panel> panels_;
  std::vector<double> values_;
};

}  // namespace docent::engine
