// SPDX-License-Identifier: Apache-2.0
#include "app/session/left_tour.h"

#include <gtest/gtest.h>

namespace docent::app {
namespace {

cv::Mat Grey(int level) {
  return {48, 64, CV_8UC1, cv::Scalar(level)};
}

// A device with an image a second.
struct Device {
  explicit Device(bool asks) : tour(LeftTour::Times(), asks) {}
  // Lets it lie, or be carried about, for so long. Counts how often the tour begins anew.
  int Lie(int duration_s) { return Pass(duration_s, false); }
  int BeCarried(int duration_s) { return Pass(duration_s, true); }
  int Pass(int duration_s, bool is_carried) {
    int restarts = 0;
    for (const int end = now_s + duration_s; now_s < end; ++now_s)
      restarts += tour.Update(now_s, Grey(is_carried && now_s % 2 == 0 ? 60 : 120), is_begun);
    return restarts;
  }

  LeftTour tour;
  bool is_begun = true;
  int now_s = 0;
};

TEST(LeftTour, AsksWhoeverTakesADeviceThatWasLeft) {
  Device device(true);
  EXPECT_EQ(device.BeCarried(100), 0);
  EXPECT_EQ(device.Lie(290), 0);
  EXPECT_EQ(device.BeCarried(5), 0);
  EXPECT_FALSE(device.tour.is_asking()) << "a rest on a bench is shorter";
  EXPECT_EQ(device.Lie(400), 0);
  EXPECT_FALSE(device.tour.is_asking()) << "nobody is there";
  EXPECT_EQ(device.BeCarried(10), 0);
  EXPECT_TRUE(device.tour.is_asking());
  device.tour.Answer();
  EXPECT_EQ(device.BeCarried(200), 0);
  EXPECT_FALSE(device.tour.is_asking());
}

TEST(LeftTour, BeginsAnewWhenNobodyAnswers) {
  Device device(true);
  device.Lie(400);
  EXPECT_EQ(device.BeCarried(100), 1);
  EXPECT_FALSE(device.tour.is_asking());
}

TEST(LeftTour, AsksAfterALongTimeWithoutImages) {
  Device device(true);
  device.BeCarried(100);
  device.now_s += 1001;  // The device was switched off, and wakes elsewhere.
  device.BeCarried(3);
  EXPECT_TRUE(device.tour.is_asking());
}

TEST(LeftTour, KnowsTheTimeBetweenTwoVisits) {
  Device device(true);
  device.BeCarried(100);
  EXPECT_FALSE(device.tour.is_between_visits());
  device.Lie(400);
  EXPECT_TRUE(device.tour.is_between_visits()) << "nobody is there";
  device.BeCarried(10);
  EXPECT_TRUE(device.tour.is_between_visits()) << "the visitor is asked";
  device.tour.Answer();
  EXPECT_FALSE(device.tour.is_between_visits());
  Device kiosk(false);
  kiosk.BeCarried(100);
  kiosk.Lie(4000);
  EXPECT_TRUE(kiosk.tour.is_between_visits());
  kiosk.BeCarried(1);
  EXPECT_FALSE(kiosk.tour.is_between_visits());
}

TEST(LeftTour, DoesNotAskWhereNothingWasBegunOrNobodyCanAnswer) {
  Device unused(true), unasked(false);
  unused.is_begun = false;
  for (Device* const device : {&unused, &unasked}) {
    EXPECT_EQ(device->Lie(1000), 1);
    EXPECT_EQ(device->BeCarried(100), 0);
    EXPECT_FALSE(device->tour.is_asking());
  }
}

TEST(LeftTour, IsNotLeftByWhoUsesTheDeviceUnseen) {
  Device kiosk(false);
  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(kiosk.Lie(250), 0);
    kiosk.tour.Use();
  }
  EXPECT_EQ(kiosk.Lie(299), 0);
  EXPECT_EQ(kiosk.Lie(100), 1);
  EXPECT_TRUE(kiosk.tour.is_between_visits());
  kiosk.tour.Use();
  EXPECT_FALSE(kiosk.tour.is_between_visits()) << "somebody is there again";
}

TEST(LeftTour, IsNotLeftByWhoUsesTheDeviceWhileThereAreNoImages) {
  for (const bool is_carried : {false, true}) {
    Device kiosk(false);
    kiosk.BeCarried(100);
    kiosk.now_s += 1001;  // The camera was unplugged.
    kiosk.tour.Use();
    EXPECT_EQ(kiosk.Pass(50, is_carried), 0) << is_carried;
    EXPECT_FALSE(kiosk.tour.is_between_visits());
  }
}

TEST(LeftTour, AsksWhoeverUsesADeviceThatWasLeftUnlessThatIsTheAnswer) {
  Device device(true);
  device.Lie(400);
  device.tour.Use();
  EXPECT_EQ(device.Lie(10), 0);
  EXPECT_TRUE(device.tour.is_asking());
  device.tour.Answer();
  device.Lie(400);
  device.tour.Use();  // The menu says whether the tour goes on.
  device.tour.Answer();
  EXPECT_EQ(device.Lie(10), 0);
  EXPECT_FALSE(device.tour.is_asking());
}

}  // namespace
}  // namespace docent::app
