// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <tuple>

// The result of a relocalization attempt: a pose, or the reason why there is none. A pose is accepted by its
// geometry alone (ptamm §5.3, §6.3): enough inliers, small residuals, inliers spread over the image, a
// best-to-second ratio that excludes ambiguity and, in another map than before, agreement over several
// frames. Plain values.
namespace docent::engine {

// Why no pose was accepted, ordered by how close it came.
enum class RejectionReason : std::uint8_t {
  kNone,
  kFewPoints,     // too few map points of any candidate were found
  kPoorFit,       // points were found, but no pose fits them
  kClustered,     // the inliers are clustered in one part of the image
  kContradicted,  // most of the image shows something else than the map: some objects are in both places
  kAmbiguous,     // another map, or another place in the same map, explains the image about as well
  kUnconfirmed    // the hypothesis holds in this frame, but not yet in enough consecutive frames
};

// The hypothesis of one frame that came closest to acceptance.
struct RelocalizationResult {
  RejectionReason rejection =
      RejectionReason::kNone;        // kNone: a pose was accepted, or there was no hypothesis
  std::uint64_t map_key = 0;         // the map of the hypothesis
  std::uint64_t competitor_key = 0;  // of kAmbiguous only; may be the same map
  int inliers = 0;                   // of the hypothesis
  int frames = 0;                    // consecutive frames that agree so far, of kUnconfirmed

  // Keeps the result that came closer to acceptance.
  void Consider(const RelocalizationResult& other) {
    if (std::tie(other.rejection, other.inliers) > std::tie(rejection, inliers)) *this = other;
  }
};

}  // namespace docent::engine
