// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/point_reports.h"

#include <algorithm>
#include <utility>

namespace docent::engine {

void PointReports::Add(std::span<const MapTracker::Attempt> attempts) {
  const auto earlier = [](const PointReport& a, const PointReport& b) { return a.point < b.point; };
  fresh_.clear();
  for (const MapTracker::Attempt& attempt : attempts) {
    const PointReport wanted{.point = attempt.point};
    const auto known = std::lower_bound(reports_.begin(), reports_.end(), wanted, earlier);
    // Each point is attempted once per frame, so new reports need no search for duplicates.
    PointReport& report =
        known != reports_.end() && known->point == attempt.point ? *known : fresh_.emplace_back(wanted);
    if (attempt.inlier) {
      ++report.inlier;
    } else if (attempt.found) {
      ++report.outlier;
    } else {
      ++report.not_found;
    }
  }
  std::sort(fresh_.begin(), fresh_.end(), earlier);
  // Merged from the back, in place: std::inplace_merge allocates.
  auto old = reports_.size(), fresh = fresh_.size();
  reports_.resize(old + fresh);
  for (auto to = reports_.size(); fresh > 0;) {
    const bool old_is_later = old > 0 && earlier(fresh_[fresh - 1], reports_[old - 1]);
    reports_[--to] = old_is_later ? reports_[--old] : fresh_[--fresh];
  }
}

std::vector<PointReport> PointReports::Take() {
  return std::exchange(reports_, {});
}

}  // namespace docent::engine
