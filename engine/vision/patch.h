// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <optional>

// 8x8 grey patches: sampled from one image through an affine warp, compared with another image, and aligned
// to subpixel accuracy. Nothing here allocates. A patch around a pixel p covers p + (-4 .. 3) in both
// directions; this holds on both sides of a match, so the half-pixel offset cancels.
namespace docent::engine {

inline constexpr int kPatchSize = 8;
inline constexpr int kPatchArea = kPatchSize * kPatchSize;
// Grey values from here on count as saturated: a grey value is a mean over colour channels and over the
// pixels of a finer level, and video compression changes it by a few steps.
inline constexpr std::uint8_t kSaturatedGrey = 250;
// With more saturated pixels a patch has hardly any texture left.
inline constexpr int kMaxSaturatedPixels = 3 * kPatchArea / 4;

struct PatchTemplate {
  alignas(32) std::array<std::uint8_t, kPatchArea> pixels{};
  alignas(32) std::array<std::int16_t, kPatchArea> gradient_x{};  // twice the central difference
  alignas(32) std::array<std::int16_t, kPatchArea> gradient_y{};
  Eigen::Matrix3f inverse_hessian;  // of (dx, dy, brightness)
  int sum = 0, sum_of_squares = 0;
  // Sums over the patch: of the gradients, and of each gradient times (pixel - mean).
  Eigen::Vector2f gradient_sum, gradient_dot_pixel;

  float Mean() const { return static_cast<float>(sum) / kPatchArea; }

  float Variance() const {
    return static_cast<float>(sum_of_squares) / kPatchArea -
           static_cast<float>(sum) * static_cast<float>(sum) / (kPatchArea * kPatchArea);
  }
};

// Samples a template: template pixel (i, j) shows source at `center` + source_from_patch * (offset of (i,
// j)). False if the warped patch leaves the image or has too little texture to be matched.
bool CutPatch(const cv::Mat& source, const Eigen::Vector2f& center, const Eigen::Matrix2f& source_from_patch,
              PatchTemplate* patch);

// Zero-mean normalized cross-correlation of the template with the image around the integer pixel (x, y), in
// [-1, 1]. Precondition: the patch lies inside the image.
float PatchCorrelation(const PatchTemplate& patch, const cv::Mat& image, int x, int y);

// Whether a patch around the pixel lies inside the image, with `margin` to spare.
inline bool PatchFits(const cv::Mat& image, float x, float y, float margin = 0.0f) {
  return x >= kPatchSize / 2 + margin && y >= kPatchSize / 2 + margin &&
         x <= static_cast<float>(image.cols - kPatchSize / 2 - 1) - margin &&
         y <= static_cast<float>(image.rows - kPatchSize / 2 - 1) - margin;
}

struct PatchAlignment {
  Eigen::Vector2f pixel;
  float correlation = 0;  // zero-mean normalized, after the last iteration
};
// Inverse-compositional alignment (Baker and Matthews 2004) of translation and brightness from `start`. Empty
// if it does not converge within `max_iterations` or moves further than max_shift_px.
std::optional<PatchAlignment> AlignPatch(const PatchTemplate& patch, const cv::Mat& image,
                                         const Eigen::Vector2f& start, float max_shift_px = 3.0f,
                                         int max_iterations = 10);

// Comparison with photometric tolerance, for images whose exposure or sharpness differs from the patch's. The
// alignment also estimates the contrast. A saturated pixel gives only a lower bound of the brightness: where
// one image saturates in n pixels of a patch, the n brightest pixels of both are treated as equally bright,
// because an exposure that maps one patch to the other maps its n brightest pixels to the saturated ones.
// This costs more and accepts wrong matches more easily.
float TolerantPatchCorrelation(const PatchTemplate& patch, const cv::Mat& image, int x, int y);
std::optional<PatchAlignment> AlignPatchTolerantly(const PatchTemplate& patch, const cv::Mat& image,
                                                   const Eigen::Vector2f& start, float max_shift_px = 3.0f,
                                                   int max_iterations = 10);

// Smaller eigenvalue of the gradient matrix over a 7x7 window around an integer pixel (Shi and Tomasi 1994),
// grey values squared.
float ShiTomasiScore(const cv::Mat& image, int x, int y);

}  // namespace docent::engine
