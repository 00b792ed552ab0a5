// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/base/time.h"
#include "engine/mapping/two_view_geometry.h"

namespace docent::engine {

struct StartConfirmationOptions {
  // The third view must add evidence: the parallax has grown by this factor since the second view.
  double min_growth = 1.1;
  // Robust standard deviation of the logarithm of the depths' ratio. Two estimates whose depths are each
  // known to a relative standard deviation of 0.2 (TwoViewOptions::max_relative_depth_sigma) differ by 0.28.
  double max_depth_spread = 0.28;
  int min_shared = 30;  // points that both estimates have
};

// Accepts the geometry of a first and a second view only when a third view, taken further away, confirms the
// depths. One object for each source of keypoint tracks; one thread.
class StartConfirmation {
 public:
  explicit StartConfirmation(const StartConfirmationOptions& options) : options_(options) {}

  void Reset() { ids_.clear(); }
  // ids: one a match of `geometry`, ascending, the same for the same point in every call with the same first
  // view. True when an earlier geometry of this first view agrees; otherwise this one waits to be confirmed.
  bool Confirm(Timestamp first_view, std::span<const std::uint32_t> ids, const TwoViewResult& geometry);

 private:
  void Keep(Timestamp first_view, std::span<const std::uint32_t> ids, const TwoViewResult& geometry);

  const StartConfirmationOptions options_;
  Timestamp first_view_{};
  std::vector<std::uint32_t> ids_;
  std::vector<double> depths_;  // one an id, baseline 1
  double parallax_deg_ = 0;
};

}  // namespace docent::engine
