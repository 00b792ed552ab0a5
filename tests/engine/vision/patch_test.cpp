// SPDX-License-Identifier: Apache-2.0
#include "engine/vision/patch.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <functional>
#include <opencv2/core.hpp>
#include <utility>
#include <vector>

#include "engine/base/random.h"

namespace docent::engine {
namespace {

// A smooth texture: waves with wavelengths of 14 to 30 pixels in several directions. Bilinear interpolation
// would reduce the amplitude of shorter waves.
double Texture(double x, double y) {
  return 128 + 30 * std::sin(0.30 * x + 0.20 * y) + 28 * std::cos(0.19 * x - 0.38 * y + 1) +
         20 * std::sin(0.44 * x - 0.11 * y + 2) + 18 * std::cos(0.08 * x + 0.33 * y + 0.5);
}

cv::Mat Image(int width, int height, const std::function<double(double, double)>& grey) {
  cv::Mat image(height, width, CV_8UC1);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      image.at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(grey(x, y));
  return image;
}

const cv::Mat& TextureImage() {
  static const cv::Mat image = Image(120, 100, Texture);
  return image;
}

const Eigen::Matrix2f kUnwarped = Eigen::Matrix2f::Identity();

TEST(PatchAlignment, RecoversShiftsToFiveHundredthsOfAPixel) {
  Random random(3);
  std::vector<float> errors;
  for (int trial = 0; trial < 200; ++trial) {
    const Eigen::Vector2f center(static_cast<float>(20 + random.Below(80)),
                                 static_cast<float>(20 + random.Below(60)));
    const Eigen::Vector2f shift(static_cast<float>(random.Uniform(-1.5, 1.5)),
                                static_cast<float>(random.Uniform(-1.5, 1.5)));
    const cv::Mat shifted =
        Image(120, 100, [&](double x, double y) { return Texture(x - shift.x(), y - shift.y()); });
    PatchTemplate patch;
    ASSERT_TRUE(CutPatch(TextureImage(), center, kUnwarped, &patch));
    const auto aligned = AlignPatch(patch, shifted, center, 3, 20);
    ASSERT_TRUE(aligned) << center.transpose() << " by " << shift.transpose();
    errors.push_back((aligned->pixel - center - shift).norm());
    EXPECT_GT(aligned->correlation, 0.99f);
  }
  // A patch with little more than an edge, half a pixel off, is less accurate because of the interpolation.
  std::sort(errors.begin(), errors.end());
  EXPECT_LT(errors[errors.size() * 3 / 4], 0.05f);
  EXPECT_LT(errors.back(), 0.12f);
}

TEST(PatchAlignment, AcceptsSubpixelPositionsInBothImages) {
  Random random(4);
  for (int trial = 0; trial < 100; ++trial) {
    const Eigen::Vector2f center(static_cast<float>(random.Uniform(20, 100)),
                                 static_cast<float>(random.Uniform(20, 80)));
    PatchTemplate patch;
    ASSERT_TRUE(CutPatch(TextureImage(), center, kUnwarped, &patch));
    const Eigen::Vector2f start = center + Eigen::Vector2f(0.8f, -0.6f);
    const auto aligned = AlignPatch(patch, TextureImage(), start, 3, 20);
    ASSERT_TRUE(aligned);
    EXPECT_LT((aligned->pixel - center).norm(), 0.07f);
  }
}

TEST(PatchAlignment, IsInvariantToABrightnessOffset) {
  for (const double change : {-35.0, -10.0, 15.0, 30.0}) {
    const cv::Mat changed =
        Image(120, 100, [&](double x, double y) { return 0.7 * (Texture(x - 0.7, y + 0.4) - 128) + 128; });
    const cv::Mat brighter = changed + cv::Scalar(change);
    PatchTemplate patch, same_light;
    ASSERT_TRUE(CutPatch(TextureImage(), {60, 50}, kUnwarped, &patch));
    ASSERT_TRUE(CutPatch(changed, {60, 50}, kUnwarped, &same_light));
    // The correlation is invariant to gain and offset; the aligned position is invariant to the offset.
    const auto aligned = AlignPatch(same_light, brighter, {61, 49}, 3, 20);
    ASSERT_TRUE(aligned);
    EXPECT_LT((aligned->pixel - Eigen::Vector2f(60, 50)).norm(), 0.05f) << change;
    const auto through_gain = AlignPatch(patch, brighter, {61, 50}, 3, 20);
    ASSERT_TRUE(through_gain);
    EXPECT_GT(through_gain->correlation, 0.98f) << change;
  }
}

// The numbers are drawn one after the other, because compilers evaluate arguments in different orders.
Eigen::Vector2i RandomCenter(Random* random) {
  const auto x = static_cast<int>(random->Below(80));
  const auto y = static_cast<int>(random->Below(60));
  return {20 + x, 20 + y};
}
Eigen::Vector2d RandomShift(Random* random) {
  const double x = random->Uniform(-1, 1);
  const double y = random->Uniform(-1, 1);
  return {x, y};
}

TEST(TolerantPatchAlignment, ConvergesAtAnyContrastRatio) {
  Random random(11);
  for (const double contrast : {0.3, 0.5, 1.9, 2.5, 3.5}) {
    const double of_patch = std::min(1.0, 1 / contrast), of_image = of_patch * contrast;
    int tried = 0, converged = 0;
    for (int trial = 0; trial < 100; ++trial) {
      const Eigen::Vector2f center = RandomCenter(&random).cast<float>();
      const Eigen::Vector2d shift = RandomShift(&random);
      const cv::Mat source =
          Image(120, 100, [&](double x, double y) { return of_patch * (Texture(x, y) - 128) + 128; });
      const cv::Mat image = Image(120, 100, [&](double x, double y) {
        return of_image * (Texture(x - shift.x(), y - shift.y()) - 128) + 128;
      });
      PatchTemplate patch;
      if (!CutPatch(source, center, kUnwarped, &patch)) continue;  // too little texture there
      ++tried;
      const auto aligned = AlignPatchTolerantly(patch, image, center);
      if (!aligned) continue;
      ++converged;
      EXPECT_LT((aligned->pixel.cast<double>() - center.cast<double>() - shift).norm(), 0.3) << contrast;
    }
    EXPECT_GE(tried, 95) << contrast;
    EXPECT_GE(converged, 0.95 * tried) << contrast;
  }
}

// The texture as a camera with `gain` times the exposure sees it.
cv::Mat OverExposed(double gain, const Eigen::Vector2d& shift) {
  return Image(120, 100, [=](double x, double y) { return gain * Texture(x - shift.x(), y - shift.y()); });
}
int SaturatedIn(const cv::Mat& image, int x, int y) {
  return cv::countNonZero(image(cv::Rect(x - 4, y - 4, kPatchSize, kPatchSize)) >= kSaturatedGrey);
}

TEST(TolerantPatchAlignment, FindsPatchesThatSaturateInOneImage) {
  Random random(12);
  int partly = 0, found = 0;
  for (int trial = 0; trial < 400; ++trial) {
    const Eigen::Vector2i center = RandomCenter(&random);
    const Eigen::Vector2d shift = RandomShift(&random);
    // Alternately the patch and the image are the saturated one.
    const bool swapped = trial % 2 == 0;
    const cv::Mat bright = OverExposed(1.9, swapped ? Eigen::Vector2d::Zero() : shift);
    const cv::Mat fair = OverExposed(1, swapped ? shift : Eigen::Vector2d::Zero());
    const int saturated = SaturatedIn(bright, center.x(), center.y());
    if (saturated == 0 || saturated > kPatchArea / 2) continue;
    PatchTemplate patch;
    if (!CutPatch(swapped ? bright : fair, center.cast<float>(), kUnwarped, &patch)) continue;
    ++partly;
    const auto aligned = AlignPatchTolerantly(patch, swapped ? fair : bright, center.cast<float>());
    if (!aligned || aligned->correlation < 0.9f) continue;
    if ((aligned->pixel.cast<double>() - center.cast<double>() - shift).norm() < 0.3) ++found;
  }
  ASSERT_GT(partly, 100);
  // Alignment without special treatment of saturated pixels finds a third of them.
  EXPECT_GT(found, 0.7 * partly);
}

TEST(PatchAlignment, AlignsUnderAnAffineWarp) {
  Random random(5);
  for (int trial = 0; trial < 100; ++trial) {
    const double angle = random.Uniform(-3, 3), scale = random.Uniform(0.6, 1.7),
                 shear = random.Uniform(-0.3, 0.3);
    Eigen::Matrix2d source_from_patch;
    source_from_patch << scale * std::cos(angle), -std::sin(angle), std::sin(angle) + shear,
        scale * std::cos(angle);
    if (std::abs(source_from_patch.determinant()) < 0.3) continue;
    const Eigen::Vector2d source(random.Uniform(40, 80), random.Uniform(35, 65));
    const Eigen::Vector2d target(random.Uniform(15, 25), random.Uniform(15, 25));
    const cv::Mat warped = Image(40, 40, [&](double x, double y) {
      const Eigen::Vector2d place = source + source_from_patch * (Eigen::Vector2d(x, y) - target);
      return Texture(place.x(), place.y());
    });
    PatchTemplate patch;
    ASSERT_TRUE(CutPatch(TextureImage(), source.cast<float>(), source_from_patch.cast<float>(), &patch));
    const auto aligned = AlignPatch(patch, warped, target.cast<float>() + Eigen::Vector2f(0.5f, 0.4f), 3, 20);
    ASSERT_TRUE(aligned) << source_from_patch;
    EXPECT_LT((aligned->pixel.cast<double>() - target).norm(), 0.12) << source_from_patch;
  }
}

TEST(PatchAlignment, NeverMovesFurtherThanAllowed) {
  Random random(6);
  int refused = 0, accepted = 0;
  for (int trial = 0; trial < 500; ++trial) {
    PatchTemplate patch;
    const Eigen::Vector2f center(static_cast<float>(random.Uniform(15, 105)),
                                 static_cast<float>(random.Uniform(15, 85)));
    ASSERT_TRUE(CutPatch(TextureImage(), center, kUnwarped, &patch));
    const Eigen::Vector2f start(static_cast<float>(random.Uniform(0, 119)),
                                static_cast<float>(random.Uniform(0, 99)));
    const auto aligned = AlignPatch(patch, TextureImage(), start, 2);
    aligned ? ++accepted : ++refused;
    if (aligned) {
      EXPECT_LE((aligned->pixel - start).norm(), 2.0f);
    }
  }
  EXPECT_GT(refused, 200);
  EXPECT_GT(accepted, 5);
}

TEST(PatchAlignment, FailsWhenTheTargetIsBeyondTheAllowedDistance) {
  // Long wavelengths only, so that alignment would converge from six pixels away if it were allowed to.
  const cv::Mat image = Image(120, 100, [](double x, double y) {
    return 128 + 60 * std::sin(0.11 * x + 0.02 * y) + 55 * std::cos(0.1 * y - 0.03 * x);
  });
  PatchTemplate patch;
  ASSERT_TRUE(CutPatch(image, {60, 50}, kUnwarped, &patch));
  const auto unlimited = AlignPatch(patch, image, {65, 53}, 20, 50);
  ASSERT_TRUE(unlimited);
  EXPECT_LT((unlimited->pixel - Eigen::Vector2f(60, 50)).norm(), 0.1f);
  EXPECT_FALSE(AlignPatch(patch, image, {65, 53}, 3, 50));
}

TEST(PatchAlignment, FailsAtTheImageBorder) {
  PatchTemplate patch;
  ASSERT_TRUE(CutPatch(TextureImage(), {60, 50}, kUnwarped, &patch));
  for (const Eigen::Vector2f& start :
       {Eigen::Vector2f(2, 50), Eigen::Vector2f(118, 50), Eigen::Vector2f(60, 1), Eigen::Vector2f(60, 99),
        Eigen::Vector2f(-50, 50), Eigen::Vector2f(1e6f, 50)}) {
    EXPECT_FALSE(AlignPatch(patch, TextureImage(), start)) << start.transpose();
  }
  const float nan = std::nanf("");
  EXPECT_FALSE(AlignPatch(patch, TextureImage(), {nan, 50}));
}

TEST(CutPatchTest, CopiesTheSourcePixelsWithoutAWarp) {
  PatchTemplate patch;
  ASSERT_TRUE(CutPatch(TextureImage(), {60, 50}, kUnwarped, &patch));
  for (int row = 0; row < kPatchSize; ++row)
    for (int column = 0; column < kPatchSize; ++column)
      EXPECT_EQ(patch.pixels[static_cast<std::size_t>(row * kPatchSize + column)],
                TextureImage().at<std::uint8_t>(50 - 4 + row, 60 - 4 + column));
}

TEST(CutPatchTest, RequiresTheWholeWarpedSquareInsideTheImage) {
  PatchTemplate patch;
  // The patch covers pixels -4 .. 3, plus a border of one pixel for the gradients.
  EXPECT_TRUE(CutPatch(TextureImage(), {5, 50}, kUnwarped, &patch));
  EXPECT_FALSE(CutPatch(TextureImage(), {4.9f, 50}, kUnwarped, &patch));
  EXPECT_TRUE(CutPatch(TextureImage(), {114.9f, 50}, kUnwarped, &patch));
  EXPECT_FALSE(CutPatch(TextureImage(), {115.5f, 50}, kUnwarped, &patch));
  EXPECT_FALSE(CutPatch(TextureImage(), {60, 4.9f}, kUnwarped, &patch));
  EXPECT_FALSE(CutPatch(TextureImage(), {60, 95.5f}, kUnwarped, &patch));
  EXPECT_FALSE(CutPatch(TextureImage(), {8, 50}, 2.0f * kUnwarped, &patch));
  EXPECT_FALSE(CutPatch(TextureImage(), {std::nanf(""), 50}, kUnwarped, &patch));
}

TEST(CutPatchTest, RejectsPatchesWithoutUsableTexture) {
  PatchTemplate patch;
  EXPECT_FALSE(CutPatch(Image(40, 40, [](double, double) { return 90; }), {20, 20}, kUnwarped, &patch));
  // An edge constrains the patch in one direction only.
  EXPECT_FALSE(CutPatch(Image(40, 40, [](double x, double) { return x < 20 ? 30 : 200; }), {20, 20},
                        kUnwarped, &patch));
  Random random(1);
  const cv::Mat noise = Image(40, 40, [&](double, double) { return 90 + random.Uniform(-2, 2); });
  EXPECT_FALSE(CutPatch(noise, {20, 20}, kUnwarped, &patch));
}

double BruteForceCorrelation(const PatchTemplate& patch, const cv::Mat& image, int x, int y) {
  double a = 0, b = 0, aa = 0, bb = 0, ab = 0;
  for (int row = 0; row < kPatchSize; ++row) {
    for (int column = 0; column < kPatchSize; ++column) {
      const double p = patch.pixels[static_cast<std::size_t>(row * kPatchSize + column)];
      const double q = image.at<std::uint8_t>(y - 4 + row, x - 4 + column);
      a += p, b += q, aa += p * p, bb += q * q, ab += p * q;
    }
  }
  return (ab - a * b / 64) / std::sqrt((aa - a * a / 64) * (bb - b * b / 64));
}

TEST(PatchCorrelation, EqualsItsDefinition) {
  Random random(8);
  for (int trial = 0; trial < 200; ++trial) {
    PatchTemplate patch;
    const Eigen::Vector2f center(static_cast<float>(random.Uniform(10, 110)),
                                 static_cast<float>(random.Uniform(10, 90)));
    ASSERT_TRUE(CutPatch(TextureImage(), center, kUnwarped, &patch));
    const int x = 4 + static_cast<int>(random.Below(112)), y = 4 + static_cast<int>(random.Below(92));
    EXPECT_NEAR(PatchCorrelation(patch, TextureImage(), x, y),
                BruteForceCorrelation(patch, TextureImage(), x, y), 2e-4);
  }
}

TEST(PatchCorrelation, IsOneForThePatchMinusOneForItsNegativeAndZeroForBlank) {
  PatchTemplate patch;
  ASSERT_TRUE(CutPatch(TextureImage(), {60, 50}, kUnwarped, &patch));
  EXPECT_NEAR(PatchCorrelation(patch, TextureImage(), 60, 50), 1, 1e-5);
  const cv::Mat negative = 255 - TextureImage();
  EXPECT_NEAR(PatchCorrelation(patch, negative, 60, 50), -1, 1e-5);
  const cv::Mat blank(100, 120, CV_8UC1, cv::Scalar(70));
  EXPECT_EQ(PatchCorrelation(patch, blank, 60, 50), 0);
  const cv::Mat dim = Image(120, 100, [](double x, double y) { return 0.5 * Texture(x, y) + 20; });
  EXPECT_GT(PatchCorrelation(patch, dim, 60, 50), 0.999f);
}

TEST(TolerantPatchCorrelation, EqualsThePlainCorrelationWithoutSaturation) {
  Random random(14);
  const cv::Mat fair = Image(120, 100, [](double x, double y) { return 0.8 * (Texture(x, y) - 128) + 120; });
  for (int trial = 0; trial < 100; ++trial) {
    const int x = 10 + static_cast<int>(random.Below(100)), y = 10 + static_cast<int>(random.Below(80));
    PatchTemplate patch;
    ASSERT_TRUE(CutPatch(fair, {60, 50}, kUnwarped, &patch));
    EXPECT_EQ(TolerantPatchCorrelation(patch, fair, x, y), PatchCorrelation(patch, fair, x, y));
  }
}

TEST(TolerantPatchCorrelation, IsHighForPartialSaturationAndZeroForNearlyFullSaturation) {
  const cv::Mat bright = OverExposed(1.9, Eigen::Vector2d::Zero());
  Random random(13);
  int partly = 0, nearly_all = 0;
  for (int trial = 0; trial < 1000; ++trial) {
    const int x = 10 + static_cast<int>(random.Below(100)), y = 10 + static_cast<int>(random.Below(80));
    PatchTemplate patch;
    const Eigen::Vector2f center(static_cast<float>(x), static_cast<float>(y));
    ASSERT_TRUE(CutPatch(TextureImage(), center, kUnwarped, &patch));
    const int saturated = SaturatedIn(bright, x, y);
    if (saturated > kMaxSaturatedPixels) {
      ++nearly_all;
      EXPECT_EQ(TolerantPatchCorrelation(patch, bright, x, y), 0);
    } else if (saturated > 0) {
      ++partly;
      // Saturated pixels may have any grey value from kSaturatedGrey to 255.
      EXPECT_GT(TolerantPatchCorrelation(patch, bright, x, y), 0.98f) << saturated;
    }
  }
  EXPECT_GT(partly, 100);
  EXPECT_GT(nearly_all, 100);
}

TEST(ShiTomasi, IsTheSmallerEigenvalueOfTheMeanGradientMatrix) {
  Random random(9);
  for (int trial = 0; trial < 100; ++trial) {
    const int x = 4 + static_cast<int>(random.Below(111)), y = 4 + static_cast<int>(random.Below(91));
    Eigen::Matrix2d sum = Eigen::Matrix2d::Zero();
    for (int row = y - 3; row <= y + 3; ++row) {
      for (int column = x - 3; column <= x + 3; ++column) {
        const auto at = [](int r, int c) {
          return static_cast<double>(TextureImage().at<std::uint8_t>(r, c));
        };
        const Eigen::Vector2d gradient(0.5 * (at(row, column + 1) - at(row, column - 1)),
                                       0.5 * (at(row + 1, column) - at(row - 1, column)));
        sum += gradient * gradient.transpose();
      }
    }
    const double expected = Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(sum / 49).eigenvalues()[0];
    EXPECT_NEAR(ShiTomasiScore(TextureImage(), x, y), expected, 1e-3 * (1 + expected));
  }
}

TEST(ShiTomasi, IsZeroOnAnEdgeAndAtTheBorder) {
  const cv::Mat edge = Image(40, 40, [](double x, double) { return x < 20 ? 30 : 200; });
  EXPECT_NEAR(ShiTomasiScore(edge, 20, 20), 0, 1e-3);
  for (const auto& [x, y] : {std::pair{3, 50}, {116, 50}, {60, 3}, {60, 96}, {-5, 50}, {60, 200}})
    EXPECT_EQ(ShiTomasiScore(TextureImage(), x, y), 0) << x << ' ' << y;
}

}  // namespace
}  // namespace docent::engine
