// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/bundle/skyline_cholesky.h"

#include <Eigen/Cholesky>
#include <algorithm>

namespace docent::engine {
namespace {

// Blocks per panel: products of 48 rows use the multiplication units well, and the eight keyframes of a local
// adjustment fit in one panel.
constexpr int kPanelBlocks = 8;
constexpr Eigen::Index kPanelScalars = static_cast<Eigen::Index>(kPanelBlocks) * SkylineCholesky::kBlock;

}  // namespace

SkylineCholesky::SkylineCholesky(const std::vector<int>& first) : rows_(static_cast<int>(first.size())) {
  Eigen::Index size = 0;
  for (int begin = 0; begin < rows_; begin += kPanelBlocks) {
    const int end = std::min(begin + kPanelBlocks, rows_);
    const int leftmost = *std::min_element(first.begin() + begin, first.begin() + end);
    Panel panel;
    panel.first = leftmost / kPanelBlocks;
    panel.height = static_cast<Eigen::Index>(end - begin) * kBlock;
    panel.offset = size;
    const Eigen::Index left = static_cast<Eigen::Index>(panels_.size()) - panel.first;
    size += panel.height * (left * kPanelScalars + panel.height);
    panels_.push_back(panel);
  }
  values_.resize(static_cast<std::size_t>(size));
}

void SkylineCholesky::SetZero() {
  std::fill(values_.begin(), values_.end(), 0.0);
}

SkylineCholesky::Block SkylineCholesky::At(int row, int column) {
  const Panel& panel = panels_[static_cast<std::size_t>(row / kPanelBlocks)];
  const Eigen::Index row_in_panel = static_cast<Eigen::Index>(row % kPanelBlocks) * kBlock;
  const Eigen::Index from_first = static_cast<Eigen::Index>(column) * kBlock - panel.first * kPanelScalars;
  return Block(values_.data() + panel.offset + from_first * panel.height + row_in_panel,
               Eigen::OuterStride<>(panel.height));
}

Eigen::Index SkylineCholesky::Width(Eigen::Index begin, Eigen::Index end) const {
  if (begin >= end) return 0;
  return (end - 1 - begin) * kPanelScalars + panels_[static_cast<std::size_t>(end - 1)].height;
}

SkylineCholesky::Part SkylineCholesky::Columns(std::size_t row, Eigen::Index begin, Eigen::Index end) {
  const Panel& panel = panels_[row];
  return {values_.data() + panel.offset + (begin - panel.first) * kPanelScalars * panel.height, panel.height,
          Width(begin, end)};
}

SkylineCholesky::ConstPart SkylineCholesky::Columns(std::size_t row, Eigen::Index begin,
                                                    Eigen::Index end) const {
  const Panel& panel = panels_[row];
  return {values_.data() + panel.offset + (begin - panel.first) * kPanelScalars * panel.height, panel.height,
          Width(begin, end)};
}

SkylineCholesky::Outcome SkylineCholesky::Factor(const std::function<bool()>& interrupted) {
  for (std::size_t i = 0; i < panels_.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    for (Eigen::Index column = panels_[i].first; column <= row; ++column) {
      if (interrupted()) return Outcome::kInterrupted;
      const auto j = static_cast<std::size_t>(column);
      Part target = Columns(i, column, column + 1);
      const Eigen::Index begin = std::max(panels_[i].first, panels_[j].first);
      if (begin < column) {
        target.noalias() -= Columns(i, begin, column) * Columns(j, begin, column).transpose();
      }
      if (column < row) {
        const auto diagonal = Columns(j, column, column + 1);
        const auto lower = diagonal.triangularView<Eigen::Lower>();
        lower.transpose().solveInPlace<Eigen::OnTheRight>(target);
      } else {
        const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factor(target);
        if (factor.info() != Eigen::Success) return Outcome::kNotPositive;
      }
    }
  }
  return Outcome::kDone;
}

void SkylineCholesky::Solve(Eigen::VectorXd* right_side) const {
  for (std::size_t i = 0; i < panels_.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    auto part = right_side->segment(row * kPanelScalars, panels_[i].height);
    const ConstPart left = Columns(i, panels_[i].first, row);
    part.noalias() -= left * right_side->segment(panels_[i].first * kPanelScalars, left.cols());
    Columns(i, row, row + 1).triangularView<Eigen::Lower>().solveInPlace(part);
  }
  for (std::size_t i = panels_.size(); i-- > 0;) {
    const auto row = static_cast<Eigen::Index>(i);
    auto part = right_side->segment(row * kPanelScalars, panels_[i].height);
    const ConstPart diagonal = Columns(i, row, row + 1);
    const auto lower = diagonal.triangularView<Eigen::Lower>();
    lower.transpose().solveInPlace(part);
    const ConstPart left = Columns(i, panels_[i].first, row);
    right_side->segment(panels_[i].first * kPanelScalars, left.cols()).noalias() -= left.transpose() * part;
  }
}

}  // namespace docent::engine
