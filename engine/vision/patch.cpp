// SPDX-License-Identifier: Apache-2.0
#include "engine/vision/patch.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <functional>

#include "engine/vision/lanes.h"

namespace docent::engine {

namespace {

constexpr int kBordered = kPatchSize + 2;
constexpr float kHalf = kPatchSize / 2;
// Grey values squared; a patch below it contains only sensor noise.
constexpr float kMinVariance = 9.0f;
constexpr float kMinDeterminant = 1e3f;  // of the Hessian
// Range of the image's contrast relative to the patch's: two f-stops either way. Blur lowers it; exposure
// raises or lowers it.
constexpr float kMinContrast = 0.25f, kMaxContrast = 4.0f;

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
  // The corners of the warped patch bound it, as the warp is affine.
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

// Over the image values under the patch, minus the patch's mean, which keeps the sums small.
struct ShiftedSums {
  float value, value_squared, value_times_pixel;
  Eigen::Vector2f value_times_gradient;
};

// left, top: position of the patch in the image, interpolated between pixels. With kLimited, brighter values
// count as `limit`.
template <bool kLimited>
ShiftedSums SumShifted(const PatchTemplate& patch, const cv::Mat& image, float left, float top,
                       float limit = 0) {
  static_assert(kPatchSize == 8);  // a row is eight floats
  const int x0 = static_cast<int>(left), y0 = static_cast<int>(top);
  const EightFloats to_right = AllFloats(left - static_cast<float>(x0));
  const EightFloats to_below = AllFloats(top - static_cast<float>(y0));
  const EightFloats mean = AllFloats(patch.Mean());
  [[maybe_unused]] const EightFloats limit_less_mean = AllFloats(limit - patch.Mean());
  const std::uint8_t* row = image.ptr<std::uint8_t>(y0) + x0;
  const auto along_row = [&] {
    const EightFloats here = LoadAsFloats(row);
    return here + to_right * (LoadAsFloats(row + 1) - here) - mean;
  };
  EightFloats above = along_row();
  EightFloats sum = AllFloats(0), squares = sum, cross = sum, along_x = sum, along_y = sum;
  for (std::size_t at = 0; at < kPatchArea; at += kPatchSize) {
    row += image.step[0];
    const EightFloats below = along_row();
    EightFloats value = above + to_below * (below - above);
    if constexpr (kLimited) value = Smaller(value, limit_less_mean);
    above = below;
    sum += value;
    squares += value * value;
    cross += value * LoadAsFloats(&patch.pixels[at]);
    along_x += value * LoadAsFloats(&patch.gradient_x[at]);
    along_y += value * LoadAsFloats(&patch.gradient_y[at]);
  }
  return {Sum(sum), Sum(squares), Sum(cross), {Sum(along_x), Sum(along_y)}};
}

using PatchPixels = std::array<std::uint8_t, kPatchArea>;

// The pixels of a patch around an integer pixel; the patch must lie inside the image.
PatchPixels PixelsAround(const cv::Mat& image, int x, int y) {
  PatchPixels pixels;
  const std::uint8_t* row = image.ptr<std::uint8_t>(y - kPatchSize / 2) + x - kPatchSize / 2;
  for (std::size_t i = 0; i < kPatchSize; ++i, row += image.step[0])
    std::copy(row, row + kPatchSize, pixels.begin() + static_cast<std::ptrdiff_t>(i * kPatchSize));
  return pixels;
}

int CountSaturated(const PatchPixels& pixels) {
  return static_cast<int>(std::count_if(pixels.begin(), pixels.end(),
                                        [](std::uint8_t value) { return value >= kSaturatedGrey; }));
}

// The grey value of the count-th brightest pixel; count > 0.
std::uint8_t NthBrightest(PatchPixels pixels, int count) {
  const auto at = pixels.begin() + (count - 1);
  std::nth_element(pixels.begin(), at, pixels.end(), std::greater<>());
  return *at;
}

float CorrelationOf(const PatchPixels& a, const PatchPixels& b) {
  int sum_a = 0, sum_b = 0, aa = 0, bb = 0, ab = 0;
  for (std::size_t i = 0; i < kPatchArea; ++i) {
    const int va = a[i], vb = b[i];
    sum_a += va;
    sum_b += vb;
    aa += va * va;
    bb += vb * vb;
    ab += va * vb;
  }
  const float covariance = static_cast<float>(kPatchArea * ab - sum_a * sum_b);
  const float product = static_cast<float>(kPatchArea * aa - sum_a * sum_a) *
                        static_cast<float>(kPatchArea * bb - sum_b * sum_b);
  return product > 1.0f ? covariance / std::sqrt(product) : 0.0f;
}

// Computes all sums and the Hessian from pixels and gradients. False if too little texture is left.
bool Summarize(PatchTemplate* patch) {
  int sum = 0, sum_of_squares = 0, sum_x = 0, sum_y = 0, dot_x = 0, dot_y = 0, xx = 0, xy = 0, yy = 0;
  for (std::size_t at = 0; at < kPatchArea; ++at) {
    const int value = patch->pixels[at], x = patch->gradient_x[at], y = patch->gradient_y[at];
    sum += value;
    sum_of_squares += value * value;
    sum_x += x;
    sum_y += y;
    dot_x += x * value;
    dot_y += y * value;
    xx += x * x;
    xy += x * y;
    yy += y * y;
  }
  patch->sum = sum;
  patch->sum_of_squares = sum_of_squares;
  if (patch->Variance() < kMinVariance) return false;
  // Of half the gradients and a constant brightness.
  const float xx_4 = 0.25f * static_cast<float>(xx), xy_4 = 0.25f * static_cast<float>(xy),
              yy_4 = 0.25f * static_cast<float>(yy);
  const float x_2 = 0.5f * static_cast<float>(sum_x), y_2 = 0.5f * static_cast<float>(sum_y);
  Eigen::Matrix3f hessian;
  hessian << xx_4, xy_4, x_2, xy_4, yy_4, y_2, x_2, y_2, kPatchArea;
  if (!(hessian.determinant() > kMinDeterminant)) return false;
  patch->inverse_hessian = hessian.inverse();
  patch->gradient_sum = Eigen::Vector2i(sum_x, sum_y).cast<float>();
  patch->gradient_dot_pixel =
      Eigen::Vector2i(dot_x, dot_y).cast<float>() - patch->Mean() * patch->gradient_sum;
  return true;
}

// The patch with its `count` brightest pixels set equally bright; false if too little texture is left.
bool LimitBrightness(const PatchTemplate& patch, int count, PatchTemplate* limited) {
  const std::uint8_t limit = NthBrightest(patch.pixels, count);
  for (std::size_t at = 0; at < kPatchArea; ++at) {
    const bool flat = patch.pixels[at] >= limit;
    limited->pixels[at] = std::min(patch.pixels[at], limit);
    limited->gradient_x[at] = flat ? std::int16_t{0} : patch.gradient_x[at];
    limited->gradient_y[at] = flat ? std::int16_t{0} : patch.gradient_y[at];
  }
  return Summarize(limited);
}

// The contrast of the image relative to the patch's.
enum class Contrast { kEqual, kEstimated };

// kLimited: see SumShifted.
template <Contrast kContrast, bool kLimited>
std::optional<PatchAlignment> Align(const PatchTemplate& patch, const cv::Mat& image,
                                    const Eigen::Vector2f& start, float max_shift_px, int max_iterations,
                                    float limit = 0) {
  constexpr float kConverged = 0.02f;  // pixels
  constexpr float kWeight = 1.0f / kPatchArea;
  float x = start.x(), y = start.y();
  float brightness = 0;
  bool converged = false;
  float correlation = 0;
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    if (!PatchFits(image, x, y, 1.0f)) return std::nullopt;
    const ShiftedSums sums = SumShifted<kLimited>(patch, image, x - kHalf, y - kHalf, limit);
    const float mean = sums.value * kWeight;
    const float covariance = sums.value_times_pixel * kWeight - mean * patch.Mean();
    const float product = (sums.value_squared * kWeight - mean * mean) * patch.Variance();
    correlation = product > 1e-3f ? covariance / std::sqrt(product) : 0;
    if (converged) break;
    Eigen::Vector2f step;
    if constexpr (kContrast == Contrast::kEqual) {
      // Steepest-descent terms of the error value - pixel - brightness.
      const Eigen::Vector2f steepest =
          sums.value_times_gradient - patch.gradient_dot_pixel - brightness * patch.gradient_sum;
      const Eigen::Vector3f update =
          patch.inverse_hessian *
          Eigen::Vector3f(0.5f * steepest[0], 0.5f * steepest[1], sums.value - kPatchArea * brightness);
      step = update.head<2>();
      brightness += update[2];
    } else {
      // The image's contrast relative to the patch's, by linear regression. Without it the step would be too
      // long or too short by this factor: at twice the contrast the iteration never converges.
      const float contrast = std::clamp(covariance / patch.Variance(), kMinContrast, kMaxContrast);
      // Steepest-descent terms of the error value - contrast * pixel - brightness.
      const Eigen::Vector2f steepest =
          sums.value_times_gradient - contrast * patch.gradient_dot_pixel - brightness * patch.gradient_sum;
      const Eigen::Vector3f update =
          patch.inverse_hessian *
          Eigen::Vector3f(0.5f * steepest[0], 0.5f * steepest[1], sums.value - kPatchArea * brightness);
      step = update.head<2>() / contrast;
      brightness += update[2];
    }
    x -= step[0];
    y -= step[1];
    const float shift_x = x - start.x(), shift_y = y - start.y();
    if (!(shift_x * shift_x + shift_y * shift_y <= max_shift_px * max_shift_px)) return std::nullopt;
    // One more iteration after convergence measures the correlation at the final position.
    converged = step[0] * step[0] + step[1] * step[1] < kConverged * kConverged;
  }
  if (!converged) return std::nullopt;
  return PatchAlignment{{x, y}, correlation};
}

}  // namespace

bool CutPatch(const cv::Mat& source, const Eigen::Vector2f& center, const Eigen::Matrix2f& source_from_patch,
              PatchTemplate* patch) {
  std::array<float, kBordered * kBordered> bordered;
  if (!CutBordered(source, center, source_from_patch, &bordered)) return false;
  std::array<int, kPatchArea> values, rounded_x, rounded_y;
  Eigen::Array<float, kPatchArea, 1> gradient_x, gradient_y;
  for (std::size_t row = 0; row < kPatchSize; ++row) {
    const std::size_t at = row * kPatchSize;
    const float* p = &bordered[(row + 1) * kBordered + 1];
    const EightFloats gx = LoadFloats(p + 1) - LoadFloats(p - 1);
    const EightFloats gy = LoadFloats(p + kBordered) - LoadFloats(p - kBordered);
    StoreTruncated(LoadFloats(p) + AllFloats(0.5f), &values[at]);
    StoreRounded(gx, &rounded_x[at]);
    StoreRounded(gy, &rounded_y[at]);
    Store(gx, gradient_x.data() + at);
    Store(gy, gradient_y.data() + at);
  }
  int sum = 0, sum_of_squares = 0, sum_x = 0, sum_y = 0, dot_x = 0, dot_y = 0;
  for (std::size_t at = 0; at < kPatchArea; ++at) {
    const int value = values[at], x = rounded_x[at], y = rounded_y[at];
    patch->pixels[at] = static_cast<std::uint8_t>(value);
    patch->gradient_x[at] = static_cast<std::int16_t>(x);
    patch->gradient_y[at] = static_cast<std::int16_t>(y);
    sum += value;
    sum_of_squares += value * value;
    sum_x += x;
    sum_y += y;
    dot_x += x * value;
    dot_y += y * value;
  }
  patch->sum = sum;
  patch->sum_of_squares = sum_of_squares;
  if (patch->Variance() < kMinVariance) return false;
  // Of half the gradients and a constant brightness.
  const float xx = 0.25f * gradient_x.square().sum(), xy = 0.25f * (gradient_x * gradient_y).sum(),
              yy = 0.25f * gradient_y.square().sum();
  const float x1 = 0.5f * gradient_x.sum(), y1 = 0.5f * gradient_y.sum();
  Eigen::Matrix3f hessian;
  hessian << xx, xy, x1, xy, yy, y1, x1, y1, kPatchArea;
  const float determinant = hessian.determinant();
  if (!(determinant > kMinDeterminant)) return false;
  patch->inverse_hessian = hessian.inverse();
  patch->gradient_sum = Eigen::Vector2i(sum_x, sum_y).cast<float>();
  patch->gradient_dot_pixel =
      Eigen::Vector2i(dot_x, dot_y).cast<float>() - patch->Mean() * patch->gradient_sum;
  return true;
}

float PatchCorrelation(const PatchTemplate& patch, const cv::Mat& image, int x, int y) {
  cv::v_int32x4 cross = cv::v_setzero_s32(), squares = cross;
  cv::v_uint16x8 values = cv::v_setzero_u16();
  const std::uint8_t* row = image.ptr<std::uint8_t>(y - kPatchSize / 2) + x - kPatchSize / 2;
  for (std::size_t i = 0; i < kPatchSize; ++i, row += image.step[0]) {
    const cv::v_uint16x8 value = cv::v_load_expand(row);
    const cv::v_int16x8 image_values = cv::v_reinterpret_as_s16(value);
    const cv::v_int16x8 template_values =
        cv::v_reinterpret_as_s16(cv::v_load_expand(&patch.pixels[i * kPatchSize]));
    values += value;
    squares += cv::v_dotprod(image_values, image_values);
    cross += cv::v_dotprod(image_values, template_values);
  }
  const int sum = static_cast<int>(cv::v_reduce_sum(values));
  const float n = kPatchArea;
  const float covariance = n * static_cast<float>(cv::v_reduce_sum(cross)) -
                           static_cast<float>(sum) * static_cast<float>(patch.sum);
  const float variance_a =
      n * static_cast<float>(cv::v_reduce_sum(squares)) - static_cast<float>(sum) * static_cast<float>(sum);
  const float variance_b = n * static_cast<float>(patch.sum_of_squares) -
                           static_cast<float>(patch.sum) * static_cast<float>(patch.sum);
  const float product = variance_a * variance_b;
  return product > 1.0f ? covariance / std::sqrt(product) : 0.0f;
}

std::optional<PatchAlignment> AlignPatch(const PatchTemplate& patch, const cv::Mat& image,
                                         const Eigen::Vector2f& start, float max_shift_px,
                                         int max_iterations) {
  return Align<Contrast::kEqual, false>(patch, image, start, max_shift_px, max_iterations);
}

float TolerantPatchCorrelation(const PatchTemplate& patch, const cv::Mat& image, int x, int y) {
  PatchPixels image_values = PixelsAround(image, x, y);
  const int count = std::max(CountSaturated(patch.pixels), CountSaturated(image_values));
  if (count == 0) return PatchCorrelation(patch, image, x, y);
  if (count > kMaxSaturatedPixels) return 0;
  PatchPixels template_values = patch.pixels;
  const std::uint8_t image_limit = NthBrightest(image_values, count),
                     template_limit = NthBrightest(template_values, count);
  for (std::uint8_t& value : image_values) value = std::min(value, image_limit);
  for (std::uint8_t& value : template_values) value = std::min(value, template_limit);
  return CorrelationOf(template_values, image_values);
}

std::optional<PatchAlignment> AlignPatchTolerantly(const PatchTemplate& patch, const cv::Mat& image,
                                                   const Eigen::Vector2f& start, float max_shift_px,
                                                   int max_iterations) {
  // Saturation is determined where the search starts and assumed to be the same one or two pixels away.
  if (!PatchFits(image, start.x(), start.y(), 1.0f)) return std::nullopt;
  const PatchPixels image_values =
      PixelsAround(image, static_cast<int>(start.x()), static_cast<int>(start.y()));
  const int count = std::max(CountSaturated(patch.pixels), CountSaturated(image_values));
  if (count == 0)
    return Align<Contrast::kEstimated, false>(patch, image, start, max_shift_px, max_iterations);
  PatchTemplate limited;
  if (count > kMaxSaturatedPixels || !LimitBrightness(patch, count, &limited)) return std::nullopt;
  return Align<Contrast::kEstimated, true>(limited, image, start, max_shift_px, max_iterations,
                                           NthBrightest(image_values, count));
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
