// SPDX-License-Identifier: Apache-2.0
#include "engine/vision/small_blurry_image.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <thread>
#include <vector>

#include "engine/base/random.h"

namespace docent::engine {
namespace {

constexpr double kPi = 3.14159265358979323846;
double Degrees(double radians) {
  return radians * 180 / kPi;
}
double Radians(double degrees) {
  return degrees * kPi / 180;
}

// A painted sphere around the camera: grey values that depend on the direction alone, in patches of
// 30 degrees down to 2 degrees, so that a rotation's picture follows from mathematics.
class PaintedSphere {
 public:
  explicit PaintedSphere(std::uint64_t seed) : seed_(seed) {}

  double Grey(const Eigen::Vector3d& direction) const {
    double grey = 128;
    double amplitude = 70;
    for (double frequency = 2; frequency < 40; frequency *= 2.3, amplitude *= 0.72)
      grey += amplitude * Noise(frequency * direction);
    return grey;
  }

  // gain and offset act as a change of exposure.
  cv::Mat Render(const CameraModel& camera, const Rotation3& camera_from_sphere, double gain = 1,
                 double offset = 0, double noise = 0) const {
    const Rotation3 sphere_from_camera = camera_from_sphere.inverse();
    cv::Mat picture(camera.height_px(), camera.width_px(), CV_8UC1, cv::Scalar(0));
    // Other noise in every picture: its seed comes from where the camera looks.
    const double bits = 1e9 * camera_from_sphere.Log().sum();
    Random random(seed_ + static_cast<std::uint64_t>(std::abs(bits)));
    for (int y = 0; y < picture.rows; ++y)
      for (int x = 0; x < picture.cols; ++x)
        if (const auto ray = camera.Unproject({x, y}))
          picture.at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(
              gain * Grey(sphere_from_camera * *ray) + offset + noise * random.Uniform(-1.7, 1.7));
    return picture;
  }

 private:
  double Corner(int x, int y, int z) const {
    const auto part = [](int v) { return static_cast<std::uint64_t>(v + 1000); };
    Random random(seed_ + part(x) * 73856093u + part(y) * 19349663u + part(z) * 83492791u);
    random.Next();
    return random.Uniform(-1, 1);
  }
  // Values at the corners of a unit lattice, smoothly joined.
  double Noise(const Eigen::Vector3d& position) const {
    const Eigen::Vector3i cell = position.array().floor().cast<int>();
    const Eigen::Array3d f = (position - cell.cast<double>()).array();
    const Eigen::Array3d s = f * f * (3 - 2 * f);
    double sum = 0;
    for (int corner = 0; corner < 8; ++corner) {
      const int dx = corner & 1, dy = (corner >> 1) & 1, dz = corner >> 2;
      const double weight = (dx ? s[0] : 1 - s[0]) * (dy ? s[1] : 1 - s[1]) * (dz ? s[2] : 1 - s[2]);
      sum += weight * Corner(cell.x() + dx, cell.y() + dy, cell.z() + dz);
    }
    return sum;
  }
  std::uint64_t seed_;
};

CameraModel Pinhole() {
  return {LensModel::kRadialTangential, {320, 240, 260, 260, 159.5, 119.5}, {-0.2, 0.05}};
}
CameraModel WideFov() {
  return {LensModel::kFov, {320, 240, 200, 202, 158, 121}, {0.9}};
}
CameraModel Fisheye() {
  return {LensModel::kKannalaBrandt, {320, 240, 130, 130, 160, 120}, {0.01, -0.004}};
}

Rotation3 RandomRotation(Random* random, double angle) {
  Eigen::Vector3d axis;
  do axis = {random->Uniform(-1, 1), random->Uniform(-1, 1), random->Uniform(-1, 1)};
  while (axis.norm() < 0.1 || axis.norm() > 1);
  return Rotation3::Exp(angle * axis.normalized());
}

double AngleBetween(const Rotation3& a, const Rotation3& b) {
  return (a.inverse() * b).Angle();
}

cv::Mat NoisePicture(int width, int height, std::uint64_t seed) {
  Random random(seed);
  cv::Mat picture(height, width, CV_8UC1);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      picture.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(random.Below(256));
  return picture;
}

TEST(MakingAThumbnail, BlursAsOpenCvDoes) {
  for (const double sigma_px : {0.8, 2.5}) {
    for (const cv::Size size : {cv::Size(640, 480), cv::Size(333, 251), cv::Size(64, 64), cv::Size(90, 3)}) {
      const cv::Mat picture = NoisePicture(size.width, size.height, 4);
      const SmallBlurryImage made = MakeSmallBlurryImage(picture, sigma_px);
      cv::Mat expected;
      picture(cv::Rect({0, 0}, made.pixels.size() * made.scale)).convertTo(expected, CV_32F);
      cv::resize(expected, expected, made.pixels.size(), 0, 0, cv::INTER_AREA);
      cv::GaussianBlur(expected, expected, {}, sigma_px);
      expected -= cv::mean(expected);
      EXPECT_LT(cv::norm(expected, made.pixels, cv::NORM_INF), 0.02) << size << ' ' << sigma_px;
    }
  }
}

TEST(MakingAThumbnail, UsesMemoryAgainUnlessSomebodyHoldsIt) {
  const cv::Mat one = NoisePicture(320, 240, 1), other = NoisePicture(320, 240, 2);
  SmallBlurryImage thumbnail;
  MakeSmallBlurryImage(one, kThumbnailBlurPx, &thumbnail);
  const void* memory = thumbnail.pixels.data;
  MakeSmallBlurryImage(other, kThumbnailBlurPx, &thumbnail);
  EXPECT_EQ(thumbnail.pixels.data, memory);
  EXPECT_EQ(Difference(thumbnail, MakeSmallBlurryImage(other)), 0);
  const SmallBlurryImage held = thumbnail;
  MakeSmallBlurryImage(one, kThumbnailBlurPx, &thumbnail);
  EXPECT_EQ(Difference(held, MakeSmallBlurryImage(other)), 0);
  EXPECT_EQ(Difference(thumbnail, MakeSmallBlurryImage(one)), 0);
}

TEST(SmallBlurryImage, IsAtMostEightyWideWithTheScaleThatMakesItSo) {
  const struct {
    int width, height, scale, small_width, small_height;
  } cases[] = {{640, 480, 8, 80, 60}, {752, 480, 10, 75, 48},   {80, 60, 1, 80, 60},
               {81, 60, 2, 40, 30},   {1920, 1080, 24, 80, 45}, {1, 1, 1, 1, 1}};
  for (const auto& c : cases) {
    const SmallBlurryImage small = MakeSmallBlurryImage(cv::Mat(c.height, c.width, CV_8UC1, cv::Scalar(7)));
    EXPECT_EQ(small.pixels.type(), CV_32FC1);
    EXPECT_EQ(small.scale, c.scale) << c.width;
    EXPECT_EQ(small.pixels.size(), cv::Size(c.small_width, c.small_height));
  }
}

TEST(SmallBlurryImage, KeepsBlockMeansWithTheirFractionAndNoMean) {
  cv::Mat picture(16, 160, CV_8UC1);
  for (int y = 0; y < picture.rows; ++y)
    for (int x = 0; x < picture.cols; ++x)
      picture.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>((x * 37 + y * 101) % 256);
  const SmallBlurryImage small = MakeSmallBlurryImage(picture, 0);
  ASSERT_EQ(small.scale, 2);
  cv::Mat expected(8, 80, CV_64FC1);
  for (int y = 0; y < 8; ++y)
    for (int x = 0; x < 80; ++x)
      expected.at<double>(y, x) = cv::mean(picture(cv::Rect(2 * x, 2 * y, 2, 2)))[0];
  const double mean = cv::mean(expected)[0];
  for (int y = 0; y < 8; ++y)
    for (int x = 0; x < 80; ++x)
      EXPECT_NEAR(small.pixels.at<float>(y, x), expected.at<double>(y, x) - mean, 1e-3);
  EXPECT_NEAR(cv::mean(small.pixels)[0], 0, 1e-3);
}

TEST(SmallBlurryImage, SumsOfLargeBrightBlocksDoNotOverflow) {
  cv::Mat picture(600, 24000, CV_8UC1, cv::Scalar(255));
  picture.colRange(0, 12000).setTo(253);
  const SmallBlurryImage small = MakeSmallBlurryImage(picture, 0);
  ASSERT_EQ(small.scale, 300);
  EXPECT_NEAR(small.pixels.at<float>(0, 0), -1, 1e-3);
  EXPECT_NEAR(small.pixels.at<float>(1, 79), 1, 1e-3);
}

TEST(SmallBlurryImage, DifferenceIsTheMeanSquareAndInfiniteForOtherSizes) {
  SmallBlurryImage a, b;
  a.pixels = cv::Mat(6, 7, CV_32FC1, cv::Scalar(2));
  b.pixels = cv::Mat(6, 7, CV_32FC1, cv::Scalar(2));
  EXPECT_EQ(Difference(a, b), 0);
  b.pixels.at<float>(3, 4) = 2 + 21;
  EXPECT_NEAR(Difference(a, b), 21.0 * 21 / 42, 1e-6);
  b.pixels = cv::Mat(7, 6, CV_32FC1, cv::Scalar(2));
  EXPECT_EQ(Difference(a, b), std::numeric_limits<double>::infinity());
  EXPECT_EQ(Difference({}, {}), std::numeric_limits<double>::infinity());
}

TEST(SmallBlurryImage, TheSamePlaceDiffersLessThanAnotherPlace) {
  const PaintedSphere sphere(3);
  const auto make = [&](const Rotation3& rotation) {
    return MakeSmallBlurryImage(sphere.Render(Pinhole(), rotation, 1, 0, 4));
  };
  const auto here = make({});
  const auto nearby = make(Rotation3::Exp({0.01, 0.02, 0}));
  const auto elsewhere = make(Rotation3::Exp({0, 1.5, 0}));
  EXPECT_LT(5 * Difference(here, nearby), Difference(here, elsewhere));
}

struct AlignmentCase {
  const char* name;
  CameraModel camera;
  double angle_deg, tolerance_deg;
};

class RotationAlignmentOfLens : public testing::TestWithParam<AlignmentCase> {};

TEST_P(RotationAlignmentOfLens, RecoversTheRotationOfAPaintedSphere) {
  const AlignmentCase& c = GetParam();
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    Random random(seed);
    const PaintedSphere sphere(seed);
    const Rotation3 a_from_sphere = RandomRotation(&random, 2);
    const Rotation3 b_from_a = RandomRotation(&random, Radians(c.angle_deg));
    const auto a = MakeSmallBlurryImage(sphere.Render(c.camera, a_from_sphere, 1, 0, 2));
    const auto b = MakeSmallBlurryImage(sphere.Render(c.camera, b_from_a * a_from_sphere, 1, 0, 2));
    const auto alignment = AlignRotation(a, c.camera, b, c.camera);
    ASSERT_TRUE(alignment) << seed;
    EXPECT_TRUE(alignment->converged) << seed;
    EXPECT_LT(Degrees(AngleBetween(alignment->b_from_a, b_from_a)), c.tolerance_deg)
        << "seed " << seed << " rms " << alignment->rms << " overlap " << alignment->overlap;
    EXPECT_GT(alignment->overlap, 0.5);
    EXPECT_LE(alignment->overlap, 1);
  }
}

INSTANTIATE_TEST_SUITE_P(SmallBlurryImage, RotationAlignmentOfLens,
                         testing::Values(AlignmentCase{"RadialStill", Pinhole(), 0, 0.05},
                                         AlignmentCase{"RadialOne", Pinhole(), 1, 0.1},
                                         AlignmentCase{"RadialFive", Pinhole(), 5, 0.1},
                                         AlignmentCase{"RadialTen", Pinhole(), 10, 0.1},
                                         AlignmentCase{"FovTwo", WideFov(), 2, 0.1},
                                         AlignmentCase{"FovTen", WideFov(), 10, 0.1},
                                         AlignmentCase{"FisheyeTen", Fisheye(), 10, 0.1}),
                         [](const auto& test) { return test.param.name; });

TEST(RotationAlignment, IsNotDisturbedByAChangeOfExposure) {
  const PaintedSphere sphere(11);
  const Rotation3 b_from_a = Rotation3::Exp({0.03, -0.05, 0.04});
  const auto a = MakeSmallBlurryImage(sphere.Render(Pinhole(), {}));
  const auto b = MakeSmallBlurryImage(sphere.Render(Pinhole(), b_from_a, 0.7, 15));
  const auto alignment = AlignRotation(a, Pinhole(), b, Pinhole());
  ASSERT_TRUE(alignment);
  EXPECT_TRUE(alignment->converged);
  EXPECT_LT(Degrees(AngleBetween(alignment->b_from_a, b_from_a)), 0.15);
}

TEST(RotationAlignment, WorksBetweenTwoDifferentCameras) {
  const PaintedSphere sphere(12);
  const Rotation3 b_from_a = Rotation3::Exp({0.02, 0.06, -0.03});
  const auto a = MakeSmallBlurryImage(sphere.Render(Pinhole(), {}));
  const auto b = MakeSmallBlurryImage(sphere.Render(WideFov(), b_from_a));
  const auto alignment = AlignRotation(a, Pinhole(), b, WideFov());
  ASSERT_TRUE(alignment);
  EXPECT_LT(Degrees(AngleBetween(alignment->b_from_a, b_from_a)), 0.5);
}

TEST(RotationAlignment, StartsFromTheInitialRotation) {
  const PaintedSphere sphere(13);
  const Rotation3 b_from_a = Rotation3::Exp({0.05, 0.38, 0.02});
  const auto a = MakeSmallBlurryImage(sphere.Render(Pinhole(), {}));
  const auto b = MakeSmallBlurryImage(sphere.Render(Pinhole(), b_from_a));
  const auto alignment = AlignRotation(a, Pinhole(), b, Pinhole(), Rotation3::Exp({0.0, 0.33, 0.0}));
  ASSERT_TRUE(alignment);
  EXPECT_LT(Degrees(AngleBetween(alignment->b_from_a, b_from_a)), 0.3);
}

TEST(RotationAlignment, IsEmptyWithoutOverlap) {
  const PaintedSphere sphere(14);
  const auto a = MakeSmallBlurryImage(sphere.Render(Pinhole(), {}));
  EXPECT_FALSE(AlignRotation(a, Pinhole(), a, Pinhole(), Rotation3::Exp({0, 2.5, 0})));
  EXPECT_FALSE(AlignRotation({}, Pinhole(), a, Pinhole()));
}

TEST(RotationAlignment, DoesNotClaimToConvergeOnABlankWall) {
  const auto blank = MakeSmallBlurryImage(cv::Mat(240, 320, CV_8UC1, cv::Scalar(90)));
  const auto alignment = AlignRotation(blank, Pinhole(), blank, Pinhole());
  ASSERT_TRUE(alignment);
  EXPECT_FALSE(alignment->converged);
}

TEST(RotationAlignment, AnswersTheSameOnEveryThread) {
  const PaintedSphere sphere(15);
  const auto a = MakeSmallBlurryImage(sphere.Render(Pinhole(), {}));
  const auto b = MakeSmallBlurryImage(sphere.Render(Pinhole(), Rotation3::Exp({0.02, 0.03, 0.01})));
  const auto expected = AlignRotation(a, Pinhole(), b, Pinhole());
  ASSERT_TRUE(expected);
  std::vector<double> differences(4, -1);
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < differences.size(); ++i)
    threads.emplace_back([&, i] {
      for (int repeat = 0; repeat < 20; ++repeat) {
        const auto alignment = AlignRotation(a, Pinhole(), b, Pinhole());
        differences[i] = std::max(
            differences[i],
            (alignment->b_from_a.quaternion().coeffs() - expected->b_from_a.quaternion().coeffs()).norm());
      }
    });
  for (auto& thread : threads) thread.join();
  for (const double difference : differences) EXPECT_EQ(difference, 0);
}

// What is painted lies on a sphere about the first camera; the second has turned about a point behind the
// first, and so has gone to the side.
TEST(AlignRotation, TakesTheTurnAboutAPointBehindTheCamera) {
  const CameraModel camera(LensModel::kRadialTangential, {320, 240, 260, 260, 160, 120}, {});
  const PaintedSphere sphere(5);
  const Eigen::Vector3d pivot(0, 0, -0.5);  // of the sphere's radius
  const Rotation3 turn = Rotation3::Exp({0, Radians(6), 0});
  cv::Mat there(camera.height_px(), camera.width_px(), CV_8UC1, cv::Scalar(0));
  const Eigen::Vector3d center = pivot - turn.inverse() * pivot;
  for (int y = 0; y < there.rows; ++y) {
    for (int x = 0; x < there.cols; ++x) {
      const Eigen::Vector3d direction = turn.inverse() * *camera.Unproject({x, y});
      const double along = direction.dot(center);
      const double distance = -along + std::sqrt(along * along + 1 - center.squaredNorm());
      there.at<std::uint8_t>(y, x) =
          cv::saturate_cast<std::uint8_t>(sphere.Grey(center + distance * direction));
    }
  }
  const SmallBlurryImage a = MakeSmallBlurryImage(sphere.Render(camera, {})), b = MakeSmallBlurryImage(there);
  const auto found = AlignRotation(a, camera, b, camera, {}, 10, pivot);
  const auto as_if_still = AlignRotation(a, camera, b, camera, {}, 10);
  ASSERT_TRUE(found && as_if_still);
  EXPECT_TRUE(found->converged);
  EXPECT_LT(Degrees((found->b_from_a * turn.inverse()).Angle()), 0.1);
  EXPECT_GT(Degrees(as_if_still->b_from_a.Angle()), 8.0) << "half as much again, from going to the side";
}

}  // namespace
}  // namespace docent::engine
