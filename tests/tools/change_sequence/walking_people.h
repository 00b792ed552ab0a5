// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "tests/tools/change_sequence/sequence_changes.h"

namespace docent::testing {

// Three opaque silhouettes (head, shoulders, trunk) with patterned clothes, who walk to and fro before the
// camera. The pattern moves with its wearer, so that corners on it are found and do not belong to the world.
// Their size follows from the share of the image that they hide on average over the duration. Immutable.
class WalkingPeople {
 public:
  WalkingPeople(double share, const ChangeContext& context);

  // Draws them over an image (CV_8UC3 or CV_8UC1).
  void Draw(double time_s, cv::Mat* image) const;
  // The share of the image that is hidden at a time.
  double HiddenShare(double time_s) const;

 private:
  struct Person {
    double period_s, phase_rad;      // of walking to and fro
    double step_hz, step_phase_rad;  // of going up and down with each step
    double stature;                  // against the others
    cv::Mat clothes;                 // CV_8UC3
  };
  // Coordinates of an image from those of a person's unit frame: x from -0.5 to 0.5, y from 0 (the crown)
  // to 1.
  cv::Matx23d ImageFromPerson(const Person& person, double time_s) const;
  std::vector<cv::Point> Outline(const Person& person, double time_s, double image_scale) const;

  int width_px_, height_px_;
  double size_ = 1;  // of a person of stature 1, in heights of the image
  std::vector<Person> people_;
};

}  // namespace docent::testing
