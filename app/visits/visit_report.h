// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "app/visits/visit_record.h"

namespace docent::app {

// What the visits say about one map.
struct MapVisits {
  std::string map;
  std::size_t visits = 0;     // Those with a stay in the map.
  double median_s = 0;        // Of the time that they stayed, of those visits.
  double total_s = 0;         // Of all of them.
  std::size_t losses = 0;     // After the visitor was in the map.
  double longest_loss_s = 0;  // 0 without a loss.
  double LossesPerHour() const { return total_s > 0 ? 3600 * static_cast<double>(losses) / total_s : 0; }
};

// By descending losses per hour.
std::vector<MapVisits> MapsByCare(const std::vector<VisitRecord>& visits);

// A self-contained page for the operator of a museum: the days, the tours, where visitors are lost, and for
// each map where visitors were and where they were lost, from above. `title` stands at its top.
std::string FormatVisitReport(const std::vector<VisitRecord>& visits, const std::string& title);

}  // namespace docent::app
