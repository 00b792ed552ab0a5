// SPDX-License-Identifier: Apache-2.0
#include "engine/vision/small_blurry_image.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <opencv2/core.hpp>
#include <opencv2/core/hal/intrin.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace docent::engine {
namespace {

constexpr int kMaxWidth = 80;

// Adds a row of grey values to 16-bit column sums.
void AddRow(const std::uint8_t* row, int width, std::uint16_t* sums) {
  int x = 0;
  for (; x + 16 <= width; x += 16) {
    cv::v_uint16x8 low, high;
    cv::v_expand(cv::v_load(row + x), low, high);
    cv::v_store(sums + x, cv::v_load(sums + x) + low);
    cv::v_store(sums + x + 8, cv::v_load(sums + x + 8) + high);
  }
  for (; x < width; ++x) sums[x] = static_cast<std::uint16_t>(sums[x] + row[x]);
}

// Working memory for thumbnails, one per thread to avoid allocations.
struct Workspace {
  std::vector<std::uint16_t> sums;  // column sums of a row of blocks
  std::vector<float> totals;        // sums of these blocks
  std::vector<float> kernel;        // of the blur, from its centre outwards
  double kernel_sigma_px = 0;
  std::vector<float> padded;  // a row, or rows of a column, with the mirrored border
};

// Mean of scale x scale blocks; rows and columns beyond the last whole block are dropped. Grey values keep
// their fraction, which an 8-bit resize would round away.
void MeanOfBlocks(const cv::Mat& gray, int scale, Workspace* workspace, cv::Mat* result) {
  const int width = gray.cols / scale, height = gray.rows / scale;
  result->create(height, width, CV_32FC1);
  const float weight = 1.0f / (static_cast<float>(scale) * static_cast<float>(scale));
  std::vector<std::uint16_t>& sums = workspace->sums;
  std::vector<float>& totals = workspace->totals;
  sums.resize(static_cast<std::size_t>(width * scale));
  totals.resize(static_cast<std::size_t>(width));
  constexpr int kRowsBeforeOverflow = 257;  // 257 * 255 = 65535
  for (int y = 0; y < height; ++y) {
    std::fill(totals.begin(), totals.end(), 0.0f);
    for (int first = 0; first < scale; first += kRowsBeforeOverflow) {
      std::fill(sums.begin(), sums.end(), std::uint16_t{0});
      const int last = std::min(scale, first + kRowsBeforeOverflow);
      for (int row = first; row < last; ++row)
        AddRow(gray.ptr<std::uint8_t>(y * scale + row), width * scale, sums.data());
      for (int x = 0; x < width; ++x) {
        const std::uint16_t* block = sums.data() + x * scale;
        std::uint32_t sum = 0;
        for (int column = 0; column < scale; ++column) sum += block[column];
        totals[static_cast<std::size_t>(x)] += static_cast<float>(sum);
      }
    }
    float* out = result->ptr<float>(y);
    for (int x = 0; x < width; ++x) out[x] = totals[static_cast<std::size_t>(x)] * weight;
  }
}

// A Gaussian's weights out to four sigma, summing to one over both sides.
void MakeKernel(double sigma_px, Workspace* workspace) {
  if (workspace->kernel_sigma_px == sigma_px) return;
  workspace->kernel_sigma_px = sigma_px;
  const auto radius = static_cast<std::size_t>(std::ceil(4 * sigma_px));
  std::vector<double> weights(radius + 1);
  double sum = 0;
  for (std::size_t i = 0; i <= radius; ++i) {
    weights[i] = std::exp(-0.5 * static_cast<double>(i * i) / (sigma_px * sigma_px));
    sum += i == 0 ? weights[i] : 2 * weights[i];
  }
  workspace->kernel.assign(weights.begin(), weights.end());
  for (float& weight : workspace->kernel) weight = static_cast<float>(weight / sum);
}

// The index in an image mirrored about its outermost pixels.
int Reflect(int index, int size) {
  if (size == 1) return 0;
  const int period = 2 * (size - 1);
  index = std::abs(index) % period;
  return index < size ? index : period - index;
}

// Blurs in place, first along the rows, then along the columns, with all columns side by side.
void Blur(Workspace* workspace, cv::Mat* pixels) {
  using Row = Eigen::Map<Eigen::ArrayXf>;
  const std::vector<float>& kernel = workspace->kernel;
  const int radius = static_cast<int>(kernel.size()) - 1;
  const Eigen::Index width = pixels->cols;
  std::vector<float>& padded = workspace->padded;
  padded.resize(static_cast<std::size_t>((pixels->rows + 2 * radius) * (pixels->cols + 2 * radius)));
  for (int y = 0; y < pixels->rows; ++y) {
    float* row = pixels->ptr<float>(y);
    for (int x = -radius; x < pixels->cols + radius; ++x)
      padded[static_cast<std::size_t>(x + radius)] = row[Reflect(x, pixels->cols)];
    const auto shifted = [&](int by) { return Row(padded.data() + radius + by, width); };
    Row out(row, width);
    out = kernel[0] * shifted(0);
    for (int i = 1; i <= radius; ++i) out += kernel[static_cast<std::size_t>(i)] * (shifted(-i) + shifted(i));
  }
  for (int y = -radius; y < pixels->rows + radius; ++y) {
    const float* row = pixels->ptr<float>(Reflect(y, pixels->rows));
    std::copy(row, row + width, padded.begin() + (y + radius) * width);
  }
  for (int y = 0; y < pixels->rows; ++y) {
    const auto shifted = [&](int by) { return Row(padded.data() + (y + radius + by) * width, width); };
    Row out(pixels->ptr<float>(y), width);
    out = kernel[0] * shifted(0);
    for (int i = 1; i <= radius; ++i) out += kernel[static_cast<std::size_t>(i)] * (shifted(-i) + shifted(i));
  }
}

}  // namespace

void MakeSmallBlurryImage(const cv::Mat& gray, double blur_sigma_px, SmallBlurryImage* result) {
  CV_Assert(gray.type() == CV_8UC1 && !gray.empty());
  thread_local Workspace workspace;
  result->scale = std::min((gray.cols + kMaxWidth - 1) / kMaxWidth, gray.rows);
  // If the previous thumbnail has another owner, it is left unchanged.
  if (result->pixels.u && result->pixels.u->refcount > 1) result->pixels.release();
  MeanOfBlocks(gray, result->scale, &workspace, &result->pixels);
  if (blur_sigma_px > 0) {
    MakeKernel(blur_sigma_px, &workspace);
    Blur(&workspace, &result->pixels);
  }
  double sum = 0;
  for (int y = 0; y < result->pixels.rows; ++y)
    sum += static_cast<double>(
        Eigen::Map<Eigen::ArrayXf>(result->pixels.ptr<float>(y), result->pixels.cols).sum());
  const auto mean = static_cast<float>(sum / static_cast<double>(result->pixels.total()));
  for (int y = 0; y < result->pixels.rows; ++y)
    Eigen::Map<Eigen::ArrayXf>(result->pixels.ptr<float>(y), result->pixels.cols) -= mean;
}

SmallBlurryImage MakeSmallBlurryImage(const cv::Mat& gray, double blur_sigma_px) {
  SmallBlurryImage result;
  MakeSmallBlurryImage(gray, blur_sigma_px, &result);
  return result;
}

double Difference(const SmallBlurryImage& a, const SmallBlurryImage& b) {
  if (a.pixels.size() != b.pixels.size() || a.pixels.empty()) return std::numeric_limits<double>::infinity();
  double sum = 0;
  for (int y = 0; y < a.pixels.rows; ++y) {
    const Eigen::Map<const Eigen::ArrayXf> row_a(a.pixels.ptr<float>(y), a.pixels.cols);
    const Eigen::Map<const Eigen::ArrayXf> row_b(b.pixels.ptr<float>(y), b.pixels.cols);
    sum += static_cast<double>((row_a - row_b).square().sum());
  }
  return sum / static_cast<double>(a.pixels.total());
}

}  // namespace docent::engine
