// SPDX-License-Identifier: Apache-2.0
#include "app/session/idle_watch.h"

#include <gtest/gtest.h>

namespace docent::app {
namespace {

// A wall with a bright stripe that begins at this column.
cv::Mat Wall(int column, int noise_seed) {
  cv::Mat image(480, 640, CV_8UC1, cv::Scalar(60)), noise(480, 640, CV_16SC1);
  image(cv::Rect(column, 0, 200, 480)).setTo(180);
  cv::RNG random(static_cast<std::uint64_t>(noise_seed));
  random.fill(noise, cv::RNG::NORMAL, 0, 8);
  cv::add(image, noise, image, cv::noArray(), CV_8U);
  return image;
}

TEST(IdleWatch, NoticesOnceThatADeviceWasLeft) {
  IdleWatch watch(120);
  int left = 0;
  for (int second = 0; second < 600; ++second) {
    const bool now = watch.Update(second, Wall(100, second + 1));
    EXPECT_EQ(now, second == 120) << second;
    left += now;
  }
  EXPECT_EQ(left, 1);
  EXPECT_FALSE(watch.Update(600, Wall(300, 1))) << "somebody takes it";
  for (int second = 601; second < 720; ++second) EXPECT_FALSE(watch.Update(second, Wall(300, second)));
  EXPECT_TRUE(watch.Update(720, Wall(300, 2))) << "and leaves it again";
}

TEST(IdleWatch, DoesNotTakeAVisitorForLeft) {
  IdleWatch watch(120);
  for (int second = 0; second < 600; second += 30)
    EXPECT_FALSE(watch.Update(second, Wall(second % 60 == 0 ? 100 : 150, second + 1)));
  cv::Mat color;
  cv::merge(std::vector<cv::Mat>(3, Wall(150, 5)), color);
  EXPECT_FALSE(watch.Update(610, color)) << "a colour image is compared like a grey one";
}

}  // namespace
}  // namespace docent::app
