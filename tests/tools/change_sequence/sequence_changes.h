// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "engine/base/time.h"
#include "engine/geometry/camera_model.h"

// Changes to the images of a recorded sequence that stand for what other visitors bring: motion blur, another
// exposure, a longer lens, people in the way, a round image. Each change is a function of the image, its time
// and the image before it; timestamps and ground truth stay as they are. One thread.
namespace docent::testing {

class SequenceChange {
 public:
  virtual ~SequenceChange() = default;

  // The lens of the changed images, for the lens of the images that come in.
  virtual engine::CameraModel Lens(const engine::CameraModel& camera) const { return camera; }
  // The changed image, of the same size and type (CV_8UC3 in BGR or CV_8UC1). Images come in the order of
  // their times. The image that is passed in may share its pixels with others and is not written to.
  virtual cv::Mat Apply(Timestamp time, const cv::Mat& image) = 0;
  // One line about what was done, or empty.
  virtual std::string Summary() const { return {}; }
};

struct ChangeContext {
  int width_px = 0, height_px = 0;
  double duration_s = 0;   // of the part that is changed
  std::uint64_t seed = 1;  // of the people
};

// A change by its name and number:
//   blur:LENGTH_PX[@ANGLE_DEG]  a line of uniform weight; along the motion of the image without an angle,
//   which
//                               is measured from x to y
//   exposure:FACTOR             grey values times FACTOR, clipped at 255
//   tele:FACTOR                 FACTOR times the focal length: the middle of the image, scaled up
//   people:SHARE                silhouettes that walk through the image and hide SHARE of it on average
//   rim:DIAMETER                black outside a circle of DIAMETER times the diagonal of the image
// Throws Error with one sentence for anything else.
std::unique_ptr<SequenceChange> MakeChange(const std::string& text, const ChangeContext& context);

// A kernel that averages along a line of length_px through its centre, CV_32FC1, with the sum 1.
cv::Mat LineKernel(double length_px, double angle_rad);

}  // namespace docent::testing
