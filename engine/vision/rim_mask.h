// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/option_check.h"
#include "engine/vision/image_pyramid.h"

namespace docent::engine {

struct RimMaskOptions {
  // Grey values. No light falls outside the image circle, but the black level of a sensor, video with a
  // limited range (16) and light that the lens scatters lift it: to 30 on the wide lens of a recorded office.
  int max_black = 40;
  int max_above_black = 12;  // noise, compression, and scattered light
  // The largest share of images in which a pixel of the rim is brighter, because a lamp flares.
  double max_bright_ratio = 0.05;
  // An image with a smaller share of brighter pixels is too dark to show the image circle. The circle of a
  // fisheye lens fills half of a sensor, and half of that may be dark.
  double min_bright_ratio = 0.25;
  int min_images = 20;  // before the mask is used
  int images_per_update = 20;
  // The least share of the image outside the circle. A vignette that does not reach black stays below it.
  double min_ratio = 0.02;

  // Describes the first invalid option in one sentence, or empty.
  std::optional<std::string> Validate() const;
};

// Finds the black rim of a lens whose image circle is smaller than the sensor, from the images alone: the
// pixels that were black in nearly every image so far and are connected to the image's corners, all four of
// them. The edge of the circle moves with the camera, so that corners detected on it are no landmarks, and
// map points that project beyond it cannot be seen. Works on the coarsest pyramid level. Not thread-safe: one
// for each camera, used by its tracking thread. Does not allocate after the first image.
class RimMask {
 public:
  // Throws Error if the options are invalid.
  explicit RimMask(const RimMaskOptions& options = {}) : options_(Checked(options)) {}

  // Adds an image, of which level kPyramidLevels - 1 is read. Images of another size begin a new mask.
  void Add(const ImageFeatures& features);
  // Whether a rim was found. Without one every pixel is visible.
  bool found() const { return found_; }
  // Whether the patch of a corner at `pixel` of `level` lies inside the image circle as a whole.
  bool IsInside(const Eigen::Vector2d& pixel, int level) const;
  // Removes the corners whose patch touches the rim.
  void RemoveCorners(ImageFeatures* features) const;

 private:
  void FindRim();

  const RimMaskOptions options_;
  int columns_ = 0, rows_ = 0, images_ = 0;
  bool found_ = false;
  std::vector<std::uint32_t> bright_;  // how often each pixel was not black, row by row
  std::vector<std::uint8_t> rim_;      // 1 outside the image circle
  std::vector<int> distance_;          // to the nearest pixel of the rim, in pixels of the coarsest level
  std::vector<int> queue_;             // scratch memory
};

}  // namespace docent::engine
