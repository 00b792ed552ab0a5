// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <optional>

// 8x8 grey patches: cut from one image through an affine warp, compared with another, aligned to a fraction
// of a pixel. Nothing here allocates. A patch about a pixel p covers p + (-4 .. 3) in both directions; the
// same rule holds on both sides of a match, so the half pixel cancels.
namespace docent::engine {

inline constexpr int kPatchSize = 8;
inline constexpr int kPatchArea = kPatchSize * kPatchSize;
// Grey values from here on are saturated: a grey value is a mean over colour channels and over the pixels of
// a finer level, and video compression moves it by a few steps.
inline constexpr std::uint8_t kSaturatedGrey = 250;
// Of a patch; with more saturated pixels hardly anything is left that could be told apart.
inline constexpr int kMaxSaturatedPixels = 3 * kPatchArea / 4;

struct PatchTemplate {
  alignas(32) std::array<std::uint8_t, kPatchArea> pixels{};
  alignas(32) std::array<std::int16_t, kPatchArea> gradient_x{};  // twice the central difference
  alignas(32) std::array<std::int16_t, kPatchArea> gradient_y{};
  Eigen::Matrix3f inverse_hessian;  // of (dx, dy, brightness)
  int sum = 0, sum_of_squares = 0;
  // Sums over the patch: of the gradients, and of each times the pixel less the mean.
  Eigen::Vector2f gradient_sum, gradient_dot_pixel;

  float Mean() const { return static_cast<float>(sum) / kPatchArea; }

  float Variance() const {
    return static_cast<float>(sum_of_squares) / kPatchArea -
           static_cast<float>(sum) * static_cast<float>(sum) / (kPatchArea * kPatchArea);
  }
};

// Cuts a template: template pixel (i, j) shows source at `center` + source_from_patch * (offset of (i, j)).
// False when the warped patch leaves the image or has too little texture to be found again.
bool CutPatch(const cv::Mat& source, const Eigen::Vector2f& center, const Eigen::Matrix2f& source_from_patch,
              PatchTemplate* patch);

// Zero-mean normalised cross-correlation of the template with the image about whole pixel (x, y), in [-1,
// 1]. The caller has made sure that the patch lies inside.
float PatchCorrelation(const PatchTemplate& patch, const cv::Mat& image, int x, int y);

// Whether a patch about the pixel lies inside, with `margin` to spare.
inline bool PatchFits(const cv::Mat& image, float x, float y, float margin = 0.0f) {
  return x >= kPatchSize / 2 + margin && y >= kPatchSize / 2 + margin &&
         x <= static_cast<float>(image.cols - kPatchSize / 2 - 1) - margin &&
         y <= static_cast<float>(image.rows - kPatchSize / 2 - 1) - margin;
}

struct PatchAlignment {
  Eigen::Vector2f pixel;
  float correlation = 0;  // zero-mean normalised, at the end
};
// Inverse-compositional alignment (Baker and Matthews 2004) of translation and brightness from `start`. Empty
// when it does not converge within `max_iterations` or wanders further than max_shift_px.
std::optional<PatchAlignment> AlignPatch(const PatchTemplate& patch, const cv::Mat& image,
                                         const Eigen::Vector2f& start, float max_shift_px = 3.0f,
                                         int max_iterations = 10);

// The same for images whose exposure or sharpness is another than the patch's. The alignment estimates the
// contrast as well. A pixel that saturates tells only that the surface is at least so bright: where one image
// saturates in n pixels of a patch, the n brightest pixels of both are compared as if they were equally
// bright, as an exposure that maps one patch to the other maps its n brightest pixels to the saturated ones.
// Costs more, and what is alike passes for the same more easily.
float TolerantPatchCorrelation(const PatchTemplate& patch, const cv::Mat& image, int x, int y);
std::optional<PatchAlignment> AlignPatchTolerantly(const PatchTemplate& patch, const cv::Mat& image,
                                                   const Eigen::Vector2f& start, float max_shift_px = 3.0f,
                                                   int max_iterations = 10);

// Smaller eigenvalue of the gradient matrix over a 7x7 window about a whole pixel (Shi and Tomasi 1994),
// grey values squared.
float ShiTomasiScore(const cv::Mat& image, int x, int y);

}  // namespace docent::engine
