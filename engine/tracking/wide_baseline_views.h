// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "engine/base/time.h"
#include "engine/geometry/rigid3.h"
#include "engine/initialization/initial_pair.h"
#include "engine/tracking/camera_image.h"
#include "engine/vision/descriptor.h"

namespace docent::engine {

// Pairs the present image with images that were taken long before in about the same direction, and matches
// them by descriptors of their corners. A camera that turns fast and moves little has the parallax that an
// initialization needs only between such images: its keypoint tracks end within a second, and the points of a
// panorama map are searched where the rotation alone predicts them, so that those with parallax are not
// found. One per camera, on the tracker's thread. It allocates, and a pair takes three milliseconds; it is
// not used once a map has depth.
class WideBaselineViews {
 public:
  // An image with its orientation in the panorama map.
  struct View {
    InitialPair::View image;
    Rigid3 camera_from_map;
    Eigen::Vector3d rotation_rate = Eigen::Vector3d::Zero();  // radians per frame
  };
  struct Pair {
    View earlier;
    std::vector<InitialPair::Match> matches;  // pixel_a in the earlier image
    std::vector<std::uint32_t> ids;           // of the earlier image's corners, ascending
  };

  // Forgets all images.
  void Reset();
  // Describes the image and remembers it. Pairs returns earlier ones with enough matches: of those that look
  // about where the camera looks, the few that have waited longest.
  std::vector<Pair> Pairs(const CameraImage& image, const Rigid3& camera_from_map,
                          const Eigen::Vector3d& rotation_rate);
  // The earlier image of a pair comes first for the next second: another image may confirm what the pair
  // showed.
  void TryAgain(const View& earlier);

 private:
  struct Remembered {
    View view;
    std::vector<DescribedKeypoint> corners;
    std::uint64_t tried = 0;  // number of the call that paired it last
  };
  void Remember(Remembered image);
  std::vector<Remembered*> Choose(Timestamp now, const Rigid3& camera_from_map);
  std::optional<Pair> Match(const Remembered& earlier, const CameraImage& image,
                            const Rigid3& camera_from_map,
                            const std::vector<DescribedKeypoint>& corners) const;

  std::vector<Remembered> images_;  // in the order of time
  std::uint64_t calls_ = 0;
  std::uint64_t remembered_every_ = 1;  // call
  Timestamp again_{};                   // time of the image that comes first
  int calls_again_ = 0;                 // for so many calls
};

}  // namespace docent::engine
