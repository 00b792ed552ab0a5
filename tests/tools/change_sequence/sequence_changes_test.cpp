// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/change_sequence/sequence_changes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "tests/support/error_of.h"
#include "tests/tools/change_sequence/walking_people.h"

namespace docent::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr ChangeContext kContext{320, 240, 10, 1};

cv::Mat Dot(const Eigen::Vector2d& middle, double sigma_px) {
  cv::Mat image(240, 320, CV_8UC1);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      const double squared = (Eigen::Vector2d(x, y) - middle).squaredNorm();
      image.at<uchar>(y, x) =
          cv::saturate_cast<uchar>(255 * std::exp(-0.5 * squared / (sigma_px * sigma_px)));
    }
  }
  return image;
}

Eigen::Vector2d Centroid(const cv::Mat& image) {
  const cv::Moments moments = cv::moments(image);
  return {moments.m10 / moments.m00, moments.m01 / moments.m00};
}

std::string ErrorOfChange(const std::string& change) {
  return ErrorOf([&] { MakeChange(change, kContext); });
}

TEST(SequenceChanges, BlurKernelHasItsLengthAndAngle) {
  for (const double angle : {0.0, 0.5, std::numbers::pi / 2}) {
    const cv::Mat kernel = LineKernel(13, angle);
    const cv::Moments moments = cv::moments(kernel);
    EXPECT_NEAR(moments.m00, 1, 1e-6);
    const double along = moments.mu20 * std::cos(angle) * std::cos(angle) +
                         2 * moments.mu11 * std::cos(angle) * std::sin(angle) +
                         moments.mu02 * std::sin(angle) * std::sin(angle);
    const double across = moments.mu20 + moments.mu02 - along;
    // A uniform line of length L has a variance of L^2 / 12; the bilinear weights add at most a quarter of a
    // square pixel.
    EXPECT_NEAR(along, 13.0 * 13 / 12, 0.25);
    EXPECT_LT(across, 0.26);
  }
}

TEST(SequenceChanges, BlurFollowsTheMotionOfTheImage) {
  cv::Mat world(400, 400, CV_8UC1);
  cv::randu(world, 0, 255);
  cv::GaussianBlur(world, world, {}, 2);
  const auto blur = MakeChange("blur:13", kContext);
  const auto vertical = MakeChange("blur:13@90", kContext);
  blur->Apply({}, world({20, 20, 320, 240}));
  const cv::Mat second = world({20, 26, 320, 240});
  EXPECT_LT(cv::norm(blur->Apply(FromSeconds(0.03), second), vertical->Apply({}, second), cv::NORM_L1) /
                static_cast<double>(second.total()),
            1.0);
}

TEST(SequenceChanges, ExposureMultipliesAndClips) {
  const cv::Mat image(std::vector<uchar>{0, 100, 130, 200}, true);
  const auto exposed = [&](const char* change) {
    return std::vector<int>(MakeChange(change, kContext)->Apply({}, image));
  };
  EXPECT_THAT(exposed("exposure:1.9"), ElementsAre(0, 190, 247, 255));
  EXPECT_THAT(exposed("exposure:0.5"), ElementsAre(0, 50, 65, 100));
}

TEST(SequenceChanges, TeleImagesMatchTheirCameraModel) {
  const engine::CameraModel camera(engine::LensModel::kRadialTangential, {320, 240, 200, 201, 163, 117},
                                   {-0.2, 0.03, 0.001, -0.002, 0});
  const auto tele = MakeChange("tele:1.6", kContext);
  const engine::CameraModel lens = tele->Lens(camera);
  for (const Eigen::Vector3d& point : {Eigen::Vector3d(0, 0, 1), {0.3, 0.1, 1}, {-0.2, -0.25, 1}}) {
    const cv::Mat changed = tele->Apply({}, Dot(*camera.Project(point), 3));
    EXPECT_LT((Centroid(changed) - *lens.Project(point)).norm(), 0.02) << point.transpose();
  }
  EXPECT_DOUBLE_EQ(lens.intrinsics().fx, 1.6 * camera.intrinsics().fx);
}

TEST(SequenceChanges, PeopleOccludeTheGivenRatioAndMove) {
  const WalkingPeople people(1.0 / 3, kContext);
  double mean = 0;
  for (int i = 0; i < 100; ++i) mean += people.OccludedRatio(0.1 * i) / 100;
  EXPECT_NEAR(mean, 1.0 / 3, 0.01);
  // Pixels that are equal on a black and on a white image are occluded.
  const auto occluded = [&](double time_s) {
    cv::Mat black(240, 320, CV_8UC3, cv::Scalar::all(0)), white(240, 320, CV_8UC3, cv::Scalar::all(255));
    people.Draw(time_s, &black);
    people.Draw(time_s, &white);
    cv::Mat difference;
    cv::absdiff(black, white, difference);
    cv::extractChannel(difference, difference, 0);
    return cv::Mat(difference == 0);
  };
  const cv::Mat now = occluded(1), later = occluded(1.5);
  EXPECT_NEAR(cv::countNonZero(now) / 76800.0, people.OccludedRatio(1), 0.02);
  EXPECT_GT(cv::countNonZero(now != later), 2000);
}

TEST(SequenceChanges, RimIsBlackOnlyOutsideItsCircle) {
  const cv::Mat image(240, 320, CV_8UC3, cv::Scalar(10, 100, 200));
  const cv::Mat round = MakeChange("rim:0.8", kContext)->Apply({}, image);  // a circle of 320 pixels
  EXPECT_EQ(round.at<cv::Vec3b>(0, 0), cv::Vec3b(0, 0, 0));
  EXPECT_EQ(round.at<cv::Vec3b>(120, 8), cv::Vec3b(10, 100, 200));
  EXPECT_EQ(round.at<cv::Vec3b>(239, 160), cv::Vec3b(10, 100, 200));
}

TEST(SequenceChanges, ReportsWhatIsWrongWithAChange) {
  EXPECT_THAT(ErrorOfChange("fog:3"), HasSubstr("blur, exposure, tele, people and rim"));
  EXPECT_THAT(ErrorOfChange("blur"), HasSubstr("needs a number from 1 to 200"));
  EXPECT_THAT(ErrorOfChange("tele:0.5"), HasSubstr("needs a number from 1 to 10"));
  EXPECT_THAT(ErrorOfChange("blur:13@north"), HasSubstr("needs a number"));
}

}  // namespace
}  // namespace docent::testing
