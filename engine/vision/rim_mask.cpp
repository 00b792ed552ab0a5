// SPDX-License-Identifier: Apache-2.0
#include "engine/vision/rim_mask.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace docent::engine {

namespace {

constexpr int kCoarsest = kPyramidLevels - 1;
// Half the width of a patch and of its border of one pixel for gradients, and one pixel for the softness of
// the edge.
constexpr int kReach = 6;

}  // namespace

std::optional<std::string> RimMaskOptions::Validate() const {
  return OptionCheck()
      .Within(max_black, 0, 255, "black level of a rim")
      .Within(max_above_black, 0, 255, "noise of a rim")
      .Ratio(max_bright_ratio, "ratio of bright images of a rim")
      .Ratio(min_bright_ratio, "ratio of bright pixels of an image that shows a rim")
      .AtLeast(min_images, 1, "number of images of a rim")
      .AtLeast(images_per_update, 1, "number of images between two updates of a rim")
      .Ratio(min_ratio, "ratio of the image outside its circle")
      .fault();
}

void RimMask::Add(const ImageFeatures& features) {
  const cv::Mat& image = features.levels[kCoarsest];
  if (image.empty()) return;
  if (image.cols != columns_ || image.rows != rows_) {
    columns_ = image.cols;
    rows_ = image.rows;
    images_ = 0;
    found_ = false;
    const auto pixels = static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_);
    bright_.assign(pixels, 0);
    rim_.assign(pixels, 0);
    distance_.assign(pixels, 0);
    queue_.assign(pixels, 0);
  }
  // The black level of the image: the brightest of its four corners.
  const int last_column = columns_ - 1, last_row = rows_ - 1;
  const int black =
      std::max({image.at<std::uint8_t>(0, 0), image.at<std::uint8_t>(0, last_column),
                image.at<std::uint8_t>(last_row, 0), image.at<std::uint8_t>(last_row, last_column)});
  const int limit = std::min(black, options_.max_black) + options_.max_above_black;
  // An image of a covered lens or of a dark room shows no image circle. Many of them would make a rim of
  // whatever is dark in the images that follow.
  std::size_t bright = 0;
  for (int row = 0; row < rows_; ++row) {
    const std::uint8_t* const pixels = image.ptr<std::uint8_t>(row);
    bright += static_cast<std::size_t>(
        std::count_if(pixels, pixels + columns_, [limit](std::uint8_t pixel) { return pixel > limit; }));
  }
  if (static_cast<double>(bright) < options_.min_bright_ratio * static_cast<double>(bright_.size())) return;
  ++images_;
  std::size_t at = 0;
  for (int row = 0; row < rows_; ++row) {
    const std::uint8_t* const pixels = image.ptr<std::uint8_t>(row);
    for (int column = 0; column < columns_; ++column, ++at) bright_[at] += pixels[column] > limit;
  }
  if (images_ >= options_.min_images && images_ % options_.images_per_update == 0) FindRim();
}

void RimMask::FindRim() {
  const auto most = static_cast<std::uint32_t>(options_.max_bright_ratio * images_);
  const auto is_dark = [&](int at) { return bright_[static_cast<std::size_t>(at)] <= most; };
  std::fill(rim_.begin(), rim_.end(), 0);
  found_ = false;
  const int corners[4] = {0, columns_ - 1, (rows_ - 1) * columns_, rows_ * columns_ - 1};
  if (!std::all_of(std::begin(corners), std::end(corners), is_dark)) return;
  // Flood fill from the four corners.
  std::size_t end = 0;
  const auto add = [&](int at) {
    const auto i = static_cast<std::size_t>(at);
    if (rim_[i] || !is_dark(at)) return;
    rim_[i] = 1;
    queue_[end++] = at;
  };
  for (const int corner : corners) add(corner);
  for (std::size_t begin = 0; begin < end; ++begin) {
    const int at = queue_[begin], column = at % columns_;
    if (column > 0) add(at - 1);
    if (column + 1 < columns_) add(at + 1);
    if (at >= columns_) add(at - columns_);
    if (at + columns_ < rows_ * columns_) add(at + columns_);
  }
  const int center = (rows_ / 2) * columns_ + columns_ / 2;
  if (rim_[static_cast<std::size_t>(center)] ||
      static_cast<double>(end) < options_.min_ratio * static_cast<double>(rim_.size()))
    return;
  found_ = true;
  // Breadth-first distances from the rim, by steps to the four neighbours; a pixel of the rim has 0.
  std::fill(distance_.begin(), distance_.end(), -1);
  for (std::size_t i = 0; i < end; ++i) distance_[static_cast<std::size_t>(queue_[i])] = 0;
  const auto visit = [&](int at, int distance) {
    const auto i = static_cast<std::size_t>(at);
    if (distance_[i] >= 0) return;
    distance_[i] = distance;
    queue_[end++] = at;
  };
  for (std::size_t begin = 0; begin < end; ++begin) {
    const int at = queue_[begin], column = at % columns_;
    const int distance = distance_[static_cast<std::size_t>(at)] + 1;
    if (column > 0) visit(at - 1, distance);
    if (column + 1 < columns_) visit(at + 1, distance);
    if (at >= columns_) visit(at - columns_, distance);
    if (at + columns_ < rows_ * columns_) visit(at + columns_, distance);
  }
}

bool RimMask::IsInside(const Eigen::Vector2d& pixel, int level) const {
  if (!found_) return true;
  const Eigen::Vector2d coarse =
      LevelFromLevelZero(LevelZeroFromLevel(pixel, level), kCoarsest).array().round();
  const int column = std::clamp(static_cast<int>(coarse.x()), 0, columns_ - 1);
  const int row = std::clamp(static_cast<int>(coarse.y()), 0, rows_ - 1);
  // Steps to the four neighbours overestimate a diagonal distance by at most this factor.
  const int reach_on_level = kReach << level;
  constexpr double kDiagonal = std::numbers::sqrt2;
  const double needed = kDiagonal * (1 + static_cast<double>(reach_on_level) / (1 << kCoarsest));
  const auto at =
      static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(column);
  return distance_[at] > needed;
}

void RimMask::RemoveCorners(ImageFeatures* features) const {
  if (!found_) return;
  for (int level = 0; level < kPyramidLevels; ++level) {
    auto& corners = features->corners[static_cast<std::size_t>(level)];
    auto& row_begin = features->row_begin[static_cast<std::size_t>(level)];
    std::size_t kept = 0, next = 0;
    for (std::size_t row = 0; row + 1 < row_begin.size(); ++row) {
      const auto row_end = static_cast<std::size_t>(row_begin[row + 1]);
      row_begin[row] = static_cast<int>(kept);
      for (; next < row_end; ++next) {
        const Corner corner = corners[next];
        if (IsInside(Eigen::Vector2d(corner.x, corner.y), level)) corners[kept++] = corner;
      }
    }
    if (!row_begin.empty()) row_begin.back() = static_cast<int>(kept);
    corners.resize(kept);
  }
}

}  // namespace docent::engine
