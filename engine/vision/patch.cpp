// SPDX-License-Identifier: Apache-2.0
#include "engine/vision/patch.h"

#include <Eigen/LU>
#include <cmath>
#include <cstring>

namespace docent::engine {

namespace {

constexpr int kBordered = kPatchSize + 2;
constexpr float kHalf = kPatchSize / 2;
// Grey values squared; below it a patch is sensor noise.
constexpr float kMinVariance = 9.0f;

float SampleBilinear(const cv::Mat& image, float x, float y) {
  const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
  const float fx = x - static_cast<float>(x0), fy = y - static_cast<float>(y0);
  const std::uint8_t* top = image.ptr<std::uint8_t>(y0) + x0;
  const std::uint8_t* bottom = top + image.step[0];
  const float upper = static_cast<float>(top[0]) + fx * static_cast<float>(top[1] - top[0]);
  const float lower = static_cast<float>(bottom[0]) + fx * static_cast<float>(bottom[1] - bottom[0]);
  return upper + fy * (lower - upper);
}

bool CutBordered(const cv::Mat& source, const Eigen::Vector2f& center, const Eigen::Matrix2f& warp,
                 std::array<float, kBordered * kBordered>* out) {
  // The corners of the warped square bound it, as the warp is affine.
  for (const float i : {-kHalf - 1, kHalf}) {
    for (const float j : {-kHalf - 1, kHalf}) {
      const Eigen::Vector2f corner = center + warp * Eigen::Vector2f(i, j);
      if (!(corner.x() >= 0 && corner.y() >= 0 && corner.x() < static_cast<float>(source.cols - 1) &&
            corner.y() < static_cast<float>(source.rows - 1))) {
        return false;
      }
    }
  }
  std::size_t index = 0;
  for (int row = 0; row < kBordered; ++row) {
    Eigen::Vector2f pixel = center + warp * Eigen::Vector2f(-kHalf - 1, static_cast<float>(row) - kHalf - 1);
    for (int column = 0; column < kBordered; ++column) {
      (*out)[index++] = SampleBilinear(source, pixel.x(), pixel.y());
      pixel += warp.col(0);
    }
  }
  return true;
}

}  // namespace

bool CutPatch(const cv::Mat& source, const Eigen::Vector2f& center, const Eigen::Matrix2f& source_from_patch,
              PatchTemplate* patch) {
  std::array<float, kBordered * kBordered> bordered;
  if (!CutBordered(source, center, source_from_patch, &bordered)) return false;
  patch->sum = 0;
  patch->sum_of_squares = 0;
  Eigen::Matrix3f hessian = Eigen::Matrix3f::Zero();
  for (std::size_t row = 0; row < kPatchSize; ++row) {
    for (std::size_t column = 0; column < kPatchSize; ++column) {
      const std::size_t at = row * kPatchSize + column;
      const float* p = &bordered[(row + 1) * kBordered + column + 1];
      const int value = static_cast<int>(p[0] + 0.5f);
      patch->pixels[at] = static_cast<std::uint8_t>(value);
      patch->sum += value;
      patch->sum_of_squares += value * value;
      const float gx = p[1] - p[-1], gy = p[kBordered] - p[-kBordered];
      patch->gradient_x[at] = static_cast<std::int16_t>(std::lround(gx));
      patch->gradient_y[at] = static_cast<std::int16_t>(std::lround(gy));
      const Eigen::Vector3f jacobian(0.5f * gx, 0.5f * gy, 1.0f);
      hessian.noalias() += jacobian * jacobian.transpose();
    }
  }
  if (patch->Variance() < kMinVariance) return false;
  const float determinant = hessian.determinant();
  if (!(determinant > 1e3f)) return false;
  patch->inverse_hessian = hessian.inverse();
  return true;
}

float PatchCorrelation(const PatchTemplate& patch, const cv::Mat& image, int x, int y) {
  alignas(32) std::array<std::uint8_t, kPatchArea> window;
  const std::uint8_t* row = image.ptr<std::uint8_t>(y - kPatchSize / 2) + x - kPatchSize / 2;
  for (std::size_t i = 0; i < kPatchSize; ++i, row += image.step[0]) {
    std::memcpy(window.data() + i * kPatchSize, row, kPatchSize);
  }
  int sum = 0, squares = 0, cross = 0;
  for (std::size_t i = 0; i < kPatchArea; ++i) {
    const int value = window[i];
    sum += value;
    squares += value * value;
    cross += value * patch.pixels[i];
  }
  const float n = kPatchArea;
  const float covariance =
      n * static_cast<float>(cross) - static_cast<float>(sum) * static_cast<float>(patch.sum);
  const float variance_a =
      n * static_cast<float>(squares) - static_cast<float>(sum) * static_cast<float>(sum);
  const float variance_b = n * static_cast<float>(patch.sum_of_squares) -
                           static_cast<float>(patch.sum) * static_cast<float>(patch.sum);
  const float product = variance_a * variance_b;
  return product > 1.0f ? covariance / std::sqrt(product) : 0.0f;
}

std::optional<PatchAlignment> AlignPatch(const PatchTemplate& patch, const cv::Mat& image,
                                         const Eigen::Vector2f& start, float max_shift_px,
                                         int max_iterations) {
  constexpr float kConverged = 0.02f;  // pixels
  float x = start.x(), y = start.y();
  float brightness = 0;
  bool converged = false;
  float correlation = 0;
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    if (!PatchFits(image, x, y, 1.0f)) return std::nullopt;
    const float left = x - kHalf, top = y - kHalf;
    const int x0 = static_cast<int>(left), y0 = static_cast<int>(top);
    const float fx = left - static_cast<float>(x0), fy = top - static_cast<float>(y0);
    const float w00 = (1 - fx) * (1 - fy), w01 = fx * (1 - fy), w10 = (1 - fx) * fy, w11 = fx * fy;
    float sum_x = 0, sum_y = 0, sum_e = 0, sum_ee = 0, sum_i = 0, sum_ii = 0;
    const std::uint8_t* row = image.ptr<std::uint8_t>(y0) + x0;
    for (std::size_t i = 0; i < kPatchSize; ++i, row += image.step[0]) {
      const std::uint8_t* next = row + image.step[0];
      const std::size_t at = i * kPatchSize;
      for (std::size_t j = 0; j < kPatchSize; ++j) {
        const float value = w00 * static_cast<float>(row[j]) + w01 * static_cast<float>(row[j + 1]) +
                            w10 * static_cast<float>(next[j]) + w11 * static_cast<float>(next[j + 1]);
        const float error = value - static_cast<float>(patch.pixels[at + j]) - brightness;
        sum_x += error * static_cast<float>(patch.gradient_x[at + j]);
        sum_y += error * static_cast<float>(patch.gradient_y[at + j]);
        sum_e += error;
        sum_ee += error * error;
        sum_i += value;
        sum_ii += value * value;
      }
    }
    const float n = kPatchArea;
    const float residual_variance = sum_ee / n - (sum_e / n) * (sum_e / n);
    const float image_variance = sum_ii / n - (sum_i / n) * (sum_i / n);
    const float patch_variance = patch.Variance();
    // Var(I - T) = Var(I) + Var(T) - 2 Cov(I, T).
    const float product = image_variance * patch_variance;
    correlation = product > 1e-3f
                      ? 0.5f * (image_variance + patch_variance - residual_variance) / std::sqrt(product)
                      : 0;
    if (converged) break;
    const Eigen::Vector3f update = patch.inverse_hessian * Eigen::Vector3f(0.5f * sum_x, 0.5f * sum_y, sum_e);
    x -= update[0];
    y -= update[1];
    brightness += update[2];
    const float shift_x = x - start.x(), shift_y = y - start.y();
    if (!(shift_x * shift_x + shift_y * shift_y <= max_shift_px * max_shift_px)) return std::nullopt;
    // One more pass after convergence measures the correlation where the patch came to rest.
    converged = update[0] * update[0] + update[1] * update[1] < kConverged * kConverged;
  }
  if (!converged) return std::nullopt;
  return PatchAlignment{{x, y}, correlation};
}

float ShiTomasiScore(const cv::Mat& image, int x, int y) {
  constexpr int kRadius = 3;
  if (x < kRadius + 1 || y < kRadius + 1 || x >= image.cols - kRadius - 1 || y >= image.rows - kRadius - 1)
    return 0;
  int xx = 0, xy = 0, yy = 0;
  for (int row = y - kRadius; row <= y + kRadius; ++row) {
    const std::uint8_t* p = image.ptr<std::uint8_t>(row);
    const std::uint8_t* above = p - image.step[0];
    const std::uint8_t* below = p + image.step[0];
    for (int column = x - kRadius; column <= x + kRadius; ++column) {
      const int gx = p[column + 1] - p[column - 1], gy = below[column] - above[column];
      xx += gx * gx;
      xy += gx * gy;
      yy += gy * gy;
    }
  }
  constexpr float kNormalize = 1.0f / (4 * (2 * kRadius + 1) * (2 * kRadius + 1));
  const float a = static_cast<float>(xx) * kNormalize, b = static_cast<float>(xy) * kNormalize,
              c = static_cast<float>(yy) * kNormalize;
  const float difference = a - c;
  return 0.5f * (a + c - std::sqrt(difference * difference + 4 * b * b));
}

}  // namespace docent::engine
