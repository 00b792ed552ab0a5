// SPDX-License-Identifier: Apache-2.0
#include "app/simulator/sensor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace docent::app {
namespace {

cv::Mat Grey(cv::Size size) {
  return cv::Mat(size, CV_8UC3, cv::Scalar::all(120));
}

TEST(Sensor, DoesNotChangeTheImageWithoutFaults) {
  const Sensor sensor({.size = {64, 48}});
  cv::Mat image = Grey({64, 48});
  sensor.Apply(3, 1.5, &image);
  EXPECT_EQ(cv::norm(image, Grey({64, 48}), cv::NORM_INF), 0);
}

TEST(Sensor, AddsNoiseOfTheGivenSigmaThatDiffersBetweenFrames) {
  const Sensor sensor({.size = {640, 480}, .noise_sigma = 3});
  cv::Mat first = Grey({640, 480}), second = Grey({640, 480}), again = Grey({640, 480});
  sensor.Apply(0, 0, &first);
  sensor.Apply(1, 0, &second);
  sensor.Apply(0, 0, &again);
  EXPECT_EQ(cv::norm(first, again, cv::NORM_INF), 0);
  cv::Scalar mean, deviation;
  cv::meanStdDev(first, mean, deviation);
  EXPECT_NEAR(mean[1], 120, 0.1);
  EXPECT_NEAR(deviation[1], 3, 0.1);
  cv::Mat difference;
  cv::subtract(first, second, difference, cv::noArray(), CV_32F);
  cv::meanStdDev(difference, mean, deviation);
  // The variances of independent noise add up.
  EXPECT_NEAR(deviation[1], 3 * std::sqrt(2.0), 0.15);
}

TEST(Sensor, VignettingDarkensTheCornersButNotTheCentre) {
  const Sensor sensor({.size = {65, 49}, .vignetting = 0.4});
  cv::Mat image = Grey({65, 49});
  sensor.Apply(0, 0, &image);
  EXPECT_EQ(image.at<cv::Vec3b>(24, 32)[0], 120);
  EXPECT_NEAR(image.at<cv::Vec3b>(0, 0)[0], 72, 1);
  EXPECT_NEAR(image.at<cv::Vec3b>(48, 64)[2], 72, 1);
}

TEST(Sensor, ClipsWhateverTheGain) {
  for (const double gain : {150.0, 3e3, 1e6}) {
    for (const double vignetting : {0.0, 0.4}) {
      for (const double noise : {0.0, 2.0}) {
        const Sensor sensor({.size = {65, 49},
                             .vignetting = vignetting,
                             .noise_sigma = noise,
                             .gain = gain,
                             .gain_noise_sigma = noise / 10});
        cv::Mat image = Grey({65, 49});
        sensor.Apply(0, 0, &image);
        double least = 0;
        cv::minMaxLoc(image.reshape(1), &least);
        EXPECT_EQ(least, 255) << gain << " " << vignetting << " " << noise;
      }
    }
  }
}

TEST(Sensor, ExposureDriftsSlowly) {
  const Sensor sensor({.size = {32, 32}, .exposure_drift = 0.1});
  double lowest = 2, highest = 0, largest_step = 0;
  for (int i = 0; i < 900; ++i) {
    const double gain = sensor.Gain(i / 30.0);
    lowest = std::min(lowest, gain);
    highest = std::max(highest, gain);
    largest_step = std::max(largest_step, std::abs(gain - sensor.Gain((i + 1) / 30.0)));
    if (i % 100 != 0) continue;
    cv::Mat image = Grey({32, 32});
    sensor.Apply(i, i / 30.0, &image);
    EXPECT_NEAR(image.at<cv::Vec3b>(5, 5)[1], 120 * gain, 0.6);
  }
  EXPECT_LT(lowest, 0.95);
  EXPECT_GT(highest, 1.05);
  EXPECT_LT(largest_step, 0.01);
}

}  // namespace
}  // namespace docent::app
