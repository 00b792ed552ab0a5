// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/base/time.h"
#include "engine/initialization/two_view_geometry.h"

namespace docent::engine {

struct StartConfirmationOptions {
  // The third view must add evidence: the parallax must have grown by this factor since the second view. 0:
  // it need not have grown.
  double min_growth = 1.1;
  // Largest robust standard deviation of the logarithm of the ratio of the depths. Two estimates whose depths
  // each have a relative standard deviation of 0.2 (TwoViewOptions::max_relative_depth_sigma) differ by 0.28.
  double max_depth_spread = 0.28;
  int min_shared = 30;  // points that both estimates contain
  // While the readout time of the shutter is unknown, the third view too must have depth with each possible
  // one.
  bool with_any_readout = true;

  // Describes the first invalid option in one sentence, or empty.
  std::optional<std::string> Validate() const;
};

// Accepts the geometry of a first and a second view only if a third view, taken further away, confirms the
// depths. One object per source of keypoint tracks; one thread.
class StartConfirmation {
 public:
  explicit StartConfirmation(const StartConfirmationOptions& options) : options_(options) {}

  void Reset() { ids_.clear(); }
  // Whether a geometry of this first view waits to be confirmed.
  bool Awaits(Timestamp first_view) const { return !ids_.empty() && first_view == first_view_; }
  // How much of the growth of the parallax is there that a third view needs, 0 to 1; 0 without a second view.
  double GrowthProgress(const TwoViewResult& geometry) const;
  // ids: one per match of `geometry`, ascending; a point has the same id in every call with the same first
  // view. True if an earlier geometry of this first view agrees; otherwise this geometry is stored and waits
  // to be confirmed.
  bool Confirm(Timestamp first_view, std::span<const std::uint32_t> ids, const TwoViewResult& geometry);

 private:
  void Store(Timestamp first_view, std::span<const std::uint32_t> ids, const TwoViewResult& geometry);

  const StartConfirmationOptions options_;
  Timestamp first_view_{};
  std::vector<std::uint32_t> ids_;
  std::vector<double> depths_;  // one per id, with baseline 1
  double parallax_deg_ = 0;
};

}  // namespace docent::engine
