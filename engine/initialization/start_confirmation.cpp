// SPDX-License-Identifier: Apache-2.0
#include "engine/initialization/start_confirmation.h"

#include <algorithm>
#include <cmath>

#include "engine/base/median.h"
#include "engine/base/option_check.h"

namespace docent::engine {

std::optional<std::string> StartConfirmationOptions::Validate() const {
  return OptionCheck()
      .AtLeast(min_growth, 0, "growth of the parallax to the third view")
      .Positive(max_depth_spread, "spread of two depths")
      .AtLeast(min_shared, 1, "number of points of both estimates")
      .fault();
}

void StartConfirmation::Store(Timestamp first_view, std::span<const std::uint32_t> ids,
                              const TwoViewResult& geometry) {
  first_view_ = first_view;
  parallax_deg_ = geometry.median_parallax_deg;
  ids_.clear();
  depths_.clear();
  for (std::size_t i = 0; i < ids.size(); ++i) {
    if (!geometry.inlier[i]) continue;
    ids_.push_back(ids[i]);
    depths_.push_back(geometry.points_in_a[i].norm());
  }
}

double StartConfirmation::GrowthProgress(const TwoViewResult& geometry) const {
  if (ids_.empty() || !(parallax_deg_ > 0)) return 0;
  const double needed = std::max((options_.min_growth - 1) * parallax_deg_, 1e-9);
  return std::clamp((geometry.median_parallax_deg - parallax_deg_) / needed, 0.0, 1.0);
}

bool StartConfirmation::Confirm(Timestamp first_view, std::span<const std::uint32_t> ids,
                                const TwoViewResult& geometry) {
  if (ids_.empty() || first_view != first_view_) {
    Store(first_view, ids, geometry);
    return false;
  }
  if (geometry.median_parallax_deg < options_.min_growth * parallax_deg_) return false;
  std::vector<double> ratios;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    if (!geometry.inlier[i]) continue;
    const auto known = std::lower_bound(ids_.begin(), ids_.end(), ids[i]);
    if (known == ids_.end() || *known != ids[i]) continue;
    ratios.push_back(
        std::log(geometry.points_in_a[i].norm() / depths_[static_cast<std::size_t>(known - ids_.begin())]));
  }
  bool agree = static_cast<int>(ratios.size()) >= options_.min_shared;
  if (agree) {
    const double middle = Median(ratios);
    for (double& ratio : ratios) ratio = std::abs(ratio - middle);
    constexpr double kSigmaFromMedian = 1.4826;  // for absolute deviations of a normal distribution
    agree = kSigmaFromMedian * Median(ratios) <= options_.max_depth_spread;
  }
  if (!agree) Store(first_view, ids, geometry);
  return agree;
}

}  // namespace docent::engine
