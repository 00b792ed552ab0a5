// SPDX-License-Identifier: Apache-2.0
// A tour through five bays of a simulated museum, and what is true about the way.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "app/files/text_file.h"
#include "tests/end_to_end/mapped_museum.h"

namespace docent::app {

inline double AngleApart_deg(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180 / std::numbers::pi;
}

// The events of a kind in the order of time, without their times.
inline std::vector<std::string> EventsOf(const std::string& kind, const std::filesystem::path& file) {
  std::istringstream lines(ReadAll(file));
  std::vector<std::string> events;
  for (std::string line; std::getline(lines, line);) {
    const std::size_t begin = line.find(',');
    if (begin != std::string::npos && line.compare(begin + 1, kind.size() + 1, kind + ",") == 0)
      events.push_back(line.substr(begin + kind.size() + 2));
  }
  return events;
}

// The tour leads through five of six bays, with signposts in both directions. The camera's walk goes from Bay
// 4 through Bay 5 to Bay 3, across the hall to Bay 0, back to the first stop, past Bay 1, which has no map,
// and to Bay 5 again: a visitor who asks to see the first stop again and passes over Bay 2 completes the
// tour.
class FiveStopsMuseum {
 public:
  FiveStopsMuseum() {
    mapped_.Map({0, 2, 3, 4, 5});
    const TrueMuseum& museum = mapped_.museum();
    const std::vector<int> stops = {4, 5, 3, 0, 2};
    for (std::size_t i = 0; i < stops.size(); ++i) {
      const Eigen::Vector3d front = museum.FrontOf(stops[i]);
      if (i + 1 < stops.size()) mapped_.AddSign(stops[i], stops[i + 1], front);
      // The signpost back stands behind who looks at the bay.
      const Eigen::Vector3d behind = front + 2 * (museum.BeginOf(stops[i]) - front);
      if (i > 0) mapped_.AddSign(stops[i], stops[i - 1], {behind.x(), 0, behind.z()});
    }
    mapped_.Succeed({"maps", "tour", "create", name(), "--stops", "Bay 4", "Bay 5", "Bay 3", "Bay 0", "Bay 2",
                     "--library", mapped_.library()});
  }

  const MappedMuseum& mapped() const { return mapped_; }
  // Of the tour.
  static std::string name() { return "Five bays"; }
  // When the walk begins and ends, seconds from the first image of the museum.
  double from_s() const { return mapped_.museum().End("build4") - 2; }
  double until_s() const { return mapped_.museum().End("visit5"); }
  // What events.csv says of the tour when the visitor asks three times to be led back after Bay 0, and skips
  // the last stop after that.
  static std::vector<std::string> ToldOfTour() {
    return {"\"arrived at 'Bay 4', stop 1 of 5\"",    "\"arrived at 'Bay 5', stop 2 of 5\"",
            "\"arrived at 'Bay 3', stop 3 of 5\"",    "\"arrived at 'Bay 0', stop 4 of 5\"",
            "\"going back to 'Bay 3', stop 3 of 5\"", "\"going back to 'Bay 5', stop 2 of 5\"",
            "\"going back to 'Bay 4', stop 1 of 5\"", "\"arrived at 'Bay 4', stop 1 of 5\"",
            "\"skipped 'Bay 2', stop 5 of 5\"",       "finished; 4 of 5 stops seen"};
  }
  // How far the arrow of a row of guidance.csv is from the truth, degrees, where `walk` is that of the
  // camera.
  double ErrorOf_deg(const Row& row, const TrueMuseum& walk) const {
    const int bay = BayOf(row.at("map")), to = BayOf(row.at("to"));
    const engine::Rigid3 camera = walk.CameraAt(*ParseSeconds(row.at("timestamp")));
    const Eigen::Vector3d shown = camera.rotation * VectorIn(row, "x", "y", "z");
    const Eigen::Vector3d sign = mapped_.PlaceOfSign(bay, to);
    const Eigen::Vector3d board = sign - Eigen::Vector3d(0, 1.2 * 0.15, 0);
    return AngleApart_deg(shown, row.at("towards") == "direction" ? mapped_.museum().BeginOf(to) - sign
                                                                  : board - camera.translation);
  }

 private:
  static int BayOf(const std::string& name) { return name.empty() ? -1 : name.back() - '0'; }

  MappedMuseum mapped_{"museum:6,fps=8"};
};

}  // namespace docent::app
