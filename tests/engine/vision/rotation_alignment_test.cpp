// SPDX-License-Identifier: Apache-2.0
#include "engine/vision/rotation_alignment.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <thread>
#include <vector>

#include "tests/engine/vision/painted_sphere.h"

namespace docent::engine {
namespace {

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

INSTANTIATE_TEST_SUITE_P(Lenses, RotationAlignmentOfLens,
                         testing::Values(AlignmentCase{"RadialStill", Pinhole(), 0, 0.05},
                                         AlignmentCase{"RadialOne", Pinhole(), 1, 0.1},
                                         AlignmentCase{"RadialFive", Pinhole(), 5, 0.1},
                                         AlignmentCase{"RadialTen", Pinhole(), 10, 0.1},
                                         AlignmentCase{"FovTwo", WideFov(), 2, 0.1},
                                         AlignmentCase{"FovTen", WideFov(), 10, 0.1},
                                         AlignmentCase{"FisheyeTen", Fisheye(), 10, 0.1}),
                         [](const auto& test) { return test.param.name; });

TEST(RotationAlignment, IsInvariantToExposure) {
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

TEST(RotationAlignment, FailsWithoutOverlap) {
  const PaintedSphere sphere(14);
  const auto a = MakeSmallBlurryImage(sphere.Render(Pinhole(), {}));
  EXPECT_FALSE(AlignRotation(a, Pinhole(), a, Pinhole(), Rotation3::Exp({0, 2.5, 0})));
  EXPECT_FALSE(AlignRotation({}, Pinhole(), a, Pinhole()));
}

TEST(RotationAlignment, DoesNotConvergeOnABlankImage) {
  const auto blank = MakeSmallBlurryImage(cv::Mat(240, 320, CV_8UC1, cv::Scalar(90)));
  const auto alignment = AlignRotation(blank, Pinhole(), blank, Pinhole());
  ASSERT_TRUE(alignment);
  EXPECT_FALSE(alignment->converged);
}

TEST(RotationAlignment, IsDeterministicAcrossThreads) {
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

// The textured sphere is centred at the first camera. The second camera is rotated about a point behind the
// first, and is therefore displaced sideways.
TEST(AlignRotation, RecoversARotationAboutAPivotBehindTheCamera) {
  const CameraModel camera(LensModel::kRadialTangential, {320, 240, 260, 260, 160, 120}, {});
  const PaintedSphere sphere(5);
  const Eigen::Vector3d pivot(0, 0, -0.5);  // in units of the sphere's radius
  const Rotation3 turn = Rotation3::Exp({0, Radians(6), 0});
  cv::Mat second_image(camera.height_px(), camera.width_px(), CV_8UC1, cv::Scalar(0));
  const Eigen::Vector3d center = pivot - turn.inverse() * pivot;
  for (int y = 0; y < second_image.rows; ++y) {
    for (int x = 0; x < second_image.cols; ++x) {
      const Eigen::Vector3d direction = turn.inverse() * *camera.Unproject({x, y});
      const double along = direction.dot(center);
      const double distance = -along + std::sqrt(along * along + 1 - center.squaredNorm());
      second_image.at<std::uint8_t>(y, x) =
          cv::saturate_cast<std::uint8_t>(sphere.Grey(center + distance * direction));
    }
  }
  const SmallBlurryImage a = MakeSmallBlurryImage(sphere.Render(camera, {})),
                         b = MakeSmallBlurryImage(second_image);
  const auto found = AlignRotation(a, camera, b, camera, {}, 10, pivot);
  const auto without_pivot = AlignRotation(a, camera, b, camera, {}, 10);
  ASSERT_TRUE(found && without_pivot);
  EXPECT_TRUE(found->converged);
  EXPECT_LT(Degrees((found->b_from_a * turn.inverse()).Angle()), 0.1);
  EXPECT_GT(Degrees(without_pivot->b_from_a.Angle()), 8.0)
      << "the sideways displacement appears as additional rotation";
}

}  // namespace
}  // namespace docent::engine
