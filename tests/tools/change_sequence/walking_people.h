// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "tests/tools/change_sequence/sequence_changes.h"

namespace docent::testing {

// Three opaque silhouettes (head, shoulders, trunk) with patterned clothes, who walk to and fro in front of
// the camera. The pattern moves with the person, so that its keypoints do not belong to the static world. The
// size of the people follows from the ratio of the image that they occlude on average over the duration.
// Immutable.
class WalkingPeople {
 public:
  WalkingPeople(double ratio, const ChangeContext& context);

  // Draws them over an image (CV_8UC3 or CV_8UC1).
  void Draw(double time_s, cv::Mat* image) const;
  // The ratio of the image that is occluded at a time.
  double OccludedRatio(double time_s) const;

 private:
  struct Person {
    double period_s, phase_rad;      // of walking to and fro
    double step_hz, step_phase_rad;  // of moving up and down with each step
    double stature;                  // relative to the others
    cv::Mat clothes;                 // CV_8UC3
  };
  // Maps a person's unit frame (x from -0.5 to 0.5, y from 0 at the crown to 1) to image coordinates.
  cv::Matx23d ImageFromPerson(const Person& person, double time_s) const;
  std::vector<cv::Point> Outline(const Person& person, double time_s, double image_scale) const;

  int width_px_, height_px_;
  double size_ = 1;  // of a person of stature 1, in image heights
  std::vector<Person> people_;
};

}  // namespace docent::testing
