// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "engine/base/time.h"
#include "engine/geometry/camera_model.h"

// Changes to the images of a recorded sequence that simulate the conditions of other visitors: motion blur,
// another exposure, a longer focal length, people in front of the camera, a circular image. Each change is a
// function of the image, its time and the image before it; timestamps and ground truth do not change. Not
// thread-safe.
namespace docent::testing {

class SequenceChange {
 public:
  virtual ~SequenceChange() = default;

  // The camera model of the changed images, given that of the input images.
  virtual engine::CameraModel Lens(const engine::CameraModel& camera) const { return camera; }
  // Returns the changed image, of the same size and type (CV_8UC3 in BGR or CV_8UC1). Images must be passed
  // in the order of their times. The input may share its pixels with other images and is not modified.
  virtual cv::Mat Apply(Timestamp time, const cv::Mat& image) = 0;
  // One line that describes what was done, or empty.
  virtual std::string Summary() const { return {}; }
};

struct ChangeContext {
  int width_px = 0, height_px = 0;
  double duration_s = 0;   // of the changed part
  std::uint64_t seed = 1;  // of the people
};

// Creates a change from its name and number:
//   blur:LENGTH_PX[@ANGLE_DEG]  a line kernel of uniform weight; the angle is measured from x to y, and
//                               without it the blur follows the motion of the image
//   exposure:FACTOR             grey values times FACTOR, clipped at 255
//   tele:FACTOR                 FACTOR times the focal length: the image centre, scaled up
//   people:RATIO                silhouettes that walk through the image and occlude RATIO of it on average
//   rim:DIAMETER                black outside a circle of DIAMETER times the image diagonal
// Throws Error for anything else.
std::unique_ptr<SequenceChange> MakeChange(const std::string& text, const ChangeContext& context);

// A kernel that averages along a line of length_px through its centre; CV_32FC1, with sum 1.
cv::Mat LineKernel(double length_px, double angle_rad);

}  // namespace docent::testing
