// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/change_sequence/walking_people.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "engine/base/random.h"

namespace docent::testing {

namespace {

constexpr int kPeople = 3;
constexpr int kClothes_px = 480;  // side of the pattern
constexpr int kOutlineBits = 4;   // fractional bits of cv::fillPoly's coordinates
constexpr double kTwoPi = 2 * std::numbers::pi;

// Half of the outline from the crown down, x to the right: the proportions of an adult seen from the front or
// from behind, down to the hips, which the lower image border cuts off.
constexpr std::array<std::array<double, 2>, 10> kHalfOutline = {{{0.000, 0.00},
                                                                 {0.050, 0.02},
                                                                 {0.085, 0.08},
                                                                 {0.080, 0.15},
                                                                 {0.050, 0.20},
                                                                 {0.060, 0.23},
                                                                 {0.210, 0.29},
                                                                 {0.250, 0.40},
                                                                 {0.260, 0.70},
                                                                 {0.250, 1.00}}};

cv::Mat MakeClothes(Random* random) {
  const auto color = [&] {
    const double grey = random->Uniform(20, 230);
    return cv::Scalar(std::clamp(grey + random->Uniform(-40, 40), 0.0, 255.0), grey,
                      std::clamp(grey + random->Uniform(-40, 40), 0.0, 255.0));
  };
  cv::Mat clothes(kClothes_px, kClothes_px, CV_8UC3, color());
  for (int i = 0; i < 160; ++i) {
    const cv::Point middle(static_cast<int>(random->Below(kClothes_px)),
                           static_cast<int>(random->Below(kClothes_px)));
    const cv::Size axes(4 + static_cast<int>(random->Below(24)), 4 + static_cast<int>(random->Below(24)));
    cv::ellipse(clothes, middle, axes, random->Uniform(0, 180), 0, 360, color(), cv::FILLED, cv::LINE_AA);
  }
  cv::GaussianBlur(clothes, clothes, {}, 1.0);
  return clothes;
}

}  // namespace

WalkingPeople::WalkingPeople(double ratio, const ChangeContext& context)
    : width_px_(context.width_px), height_px_(context.height_px) {
  Random random(context.seed);
  for (int i = 0; i < kPeople; ++i) {
    Person person;
    // The speed is at most half the image width per second, that of a person who strolls by two metres away.
    // Nearly equal periods keep the people apart, so that the occluded ratio changes little.
    person.period_s = random.Uniform(6.5, 7.5);
    person.phase_rad = kTwoPi * (i + random.Uniform(0, 0.2)) / kPeople;
    person.step_hz = random.Uniform(1.6, 2.0);  // steps per second of a walking person
    person.step_phase_rad = random.Uniform(0, kTwoPi);
    person.stature = random.Uniform(0.85, 1.15);
    person.clothes = MakeClothes(&random);
    people_.push_back(std::move(person));
  }
  // The ratio increases with the size, so that bisection finds the size.
  double low = 0.05, high = 4;
  for (int step = 0; step < 20; ++step) {
    size_ = 0.5 * (low + high);
    constexpr int kTimes = 120;
    double mean = 0;
    for (int i = 0; i < kTimes; ++i) mean += OccludedRatio(context.duration_s * i / kTimes) / kTimes;
    (mean < ratio ? low : high) = size_;
  }
}

cv::Matx23d WalkingPeople::ImageFromPerson(const Person& person, double time_s) const {
  const double size_px = size_ * person.stature * height_px_;
  const double x = width_px_ * (0.5 + 0.45 * std::sin(kTwoPi * time_s / person.period_s + person.phase_rad));
  const double bob = 0.01 * std::sin(kTwoPi * person.step_hz * time_s + person.step_phase_rad);
  // The hips are at the lower border; the head of a person larger than the image is above the upper border.
  const double y = height_px_ - (1 + bob) * size_px + 0.02 * size_px;
  return {size_px, 0, x, 0, size_px, y};
}

std::vector<cv::Point> WalkingPeople::Outline(const Person& person, double time_s, double image_scale) const {
  const cv::Matx23d image_from_person = ImageFromPerson(person, time_s);
  std::vector<cv::Point> outline;
  const auto add = [&](double x, double y) {
    const cv::Vec2d pixel = image_scale * (image_from_person * cv::Vec3d(x, y, 1));
    outline.emplace_back(static_cast<int>(std::lround(pixel[0] * (1 << kOutlineBits))),
                         static_cast<int>(std::lround(pixel[1] * (1 << kOutlineBits))));
  };
  for (const auto& [x, y] : kHalfOutline) add(x, y);
  add(kHalfOutline.back()[0], 1.1);  // below the image even at the highest point of a step
  add(-kHalfOutline.back()[0], 1.1);
  for (auto point = kHalfOutline.rbegin(); point != kHalfOutline.rend(); ++point)
    add(-(*point)[0], (*point)[1]);
  return outline;
}

double WalkingPeople::OccludedRatio(double time_s) const {
  constexpr double kScale = 0.25;
  cv::Mat mask =
      cv::Mat::zeros(static_cast<int>(height_px_ * kScale), static_cast<int>(width_px_ * kScale), CV_8U);
  for (const Person& person : people_)
    cv::fillPoly(mask, std::vector{Outline(person, time_s, kScale)}, 255, cv::LINE_8, kOutlineBits);
  return static_cast<double>(cv::countNonZero(mask)) / static_cast<double>(mask.total());
}

void WalkingPeople::Draw(double time_s, cv::Mat* image) const {
  for (const Person& person : people_) {
    cv::Mat mask = cv::Mat::zeros(image->size(), CV_8U);
    cv::fillPoly(mask, std::vector{Outline(person, time_s, 1)}, 255, cv::LINE_AA, kOutlineBits);
    const cv::Matx23d from_person = ImageFromPerson(person, time_s);
    // The pattern covers x from -0.5 to 0.5 and y from 0 to 1, and is mirrored beyond.
    const cv::Matx23d from_clothes(from_person(0, 0) / kClothes_px, 0,
                                   from_person(0, 2) - 0.5 * from_person(0, 0), 0,
                                   from_person(1, 1) / kClothes_px, from_person(1, 2));
    cv::Mat clothes;
    cv::warpAffine(person.clothes, clothes, from_clothes, image->size(), cv::INTER_LINEAR,
                   cv::BORDER_REFLECT_101);
    if (image->channels() == 1) cv::cvtColor(clothes, clothes, cv::COLOR_BGR2GRAY);
    const int channels = image->channels();
    for (int y = 0; y < image->rows; ++y) {
      uchar* out = image->ptr<uchar>(y);
      const uchar *in = clothes.ptr<uchar>(y), *alpha = mask.ptr<uchar>(y);
      for (int i = 0; i < image->cols * channels; ++i) {
        const int a = alpha[i / channels];
        out[i] = static_cast<uchar>((a * in[i] + (255 - a) * out[i] + 127) / 255);
      }
    }
  }
}

}  // namespace docent::testing
