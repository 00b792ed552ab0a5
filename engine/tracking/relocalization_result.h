// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <tuple>

// The answer of a camera that is lost and has found places that its image resembles: a pose, or why there
// is none. A pose is believed by its geometry alone (ptamm §5.3, §6.3): enough points, well fitted, spread
// over the image, the best map clearly ahead of the others, and, in a map that it was not in before, for
// several frames. Plain values.
namespace docent::engine {

enum class RejectionReason : std::uint8_t {
  kNone,
  kFewPoints,   // too few of the points of any place are found
  kPoorFit,     // points are found, but no pose explains them
  kOneCorner,   // they are gathered in a part of the image
  kLookAlikes,  // another map, or another place in the same one, explains the image nearly as well
  kUnconfirmed  // it is right in this image, but not in several in a row yet
};

// What came nearest to a pose in one frame.
struct RelocalizationResult {
  RejectionReason doubt = RejectionReason::kNone;
  std::uint64_t map_key = 0,
                competitor_key = 0;  // the competitor is of kLookAlikes alone, and may be the same map
  int inliers = 0;                   // points that agree
  int frames = 0;                    // that agreed so far, of kUnconfirmed

  // Of all that speaks against a pose in one frame that is kept which came nearest.
  void Consider(const RelocalizationResult& other) {
    if (std::tie(other.doubt, other.inliers) > std::tie(doubt, inliers)) *this = other;
  }
};

}  // namespace docent::engine
