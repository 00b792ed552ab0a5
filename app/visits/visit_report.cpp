// SPDX-License-Identifier: Apache-2.0
#include "app/visits/visit_report.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>

#include "app/evaluation/svg_plot.h"
#include "engine/base/median.h"

namespace docent::app {

namespace {

constexpr const char* kStyle =
    "body{font:16px/1.5 sans-serif;max-width:60em;margin:2em auto;padding:0 1em;color:#222}"
    "table{border-collapse:collapse;margin:1em 0}th,td{padding:.2em .9em;text-align:right;border-bottom:1px "
    "solid #ddd}"
    "th:first-child,td:first-child{text-align:left}figure{margin:1.5em 0}.note{color:#555}";

std::string Decimal(double value, int digits) {
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

// Minutes and seconds.
std::string Duration(double seconds) {
  const auto whole = std::llround(seconds);
  char text[64];
  std::snprintf(text, sizeof text, "%lld:%02lld", whole / 60, whole % 60);
  return text;
}

std::string DateOf(std::chrono::sys_seconds time) {
  const std::chrono::year_month_day date(std::chrono::floor<std::chrono::days>(time));
  char text[32];
  std::snprintf(text, sizeof text, "%04d-%02u-%02u", static_cast<int>(date.year()),
                static_cast<unsigned>(date.month()), static_cast<unsigned>(date.day()));
  return text;
}

std::string TableRow(const char* cell, const std::vector<std::string>& texts) {
  std::string row = "<tr>";
  for (const std::string& text : texts)
    row += std::string("<") + cell + ">" + EscapeHtml(text) + "</" + cell + ">";
  return row + "</tr>\n";
}

// Figures of some visits: those of a day, or of a tour.
struct VisitGroup {
  std::vector<double> durations_s;
  std::uint64_t images = 0, localized = 0;
  std::size_t losses = 0, finished = 0;
  double seen = 0;

  void Add(const VisitRecord& visit) {
    durations_s.push_back(visit.duration_s);
    images += visit.images;
    localized += visit.localized;
    losses += visit.losses.size();
    if (visit.stops == 0) return;
    finished += visit.seen == visit.stops;
    seen += static_cast<double>(visit.seen) / visit.stops;
  }
  std::string Visits() const { return std::to_string(durations_s.size()); }
  std::string MedianDuration() const { return Duration(Median(durations_s)); }
  std::string Localized() const {
    return images == 0
               ? ""
               : Decimal(100 * static_cast<double>(localized) / static_cast<double>(images), 1) + " %";
  }
  std::string Share(double count) const {
    return Decimal(100 * count / static_cast<double>(durations_s.size()), 0) + " %";
  }
};

std::string DayTable(const std::vector<VisitRecord>& visits) {
  std::map<std::string, VisitGroup> days;
  for (const VisitRecord& visit : visits) days[DateOf(visit.begin)].Add(visit);
  std::string html = "<h2>Days</h2>\n<table>" +
                     TableRow("th", {"day", "visits", "median length", "images with a pose", "times lost"});
  for (const auto& [day, group] : days)
    html += TableRow(
        "td", {day, group.Visits(), group.MedianDuration(), group.Localized(), std::to_string(group.losses)});
  return html + "</table>\n";
}

std::string TourTable(const std::vector<VisitRecord>& visits) {
  std::map<std::string, VisitGroup> tours;
  for (const VisitRecord& visit : visits) {
    if (!visit.tour.empty()) tours[visit.tour].Add(visit);
  }
  if (tours.empty()) return "";
  std::string html = "<h2>Tours</h2>\n<table>" +
                     TableRow("th", {"tour", "visits", "median length", "stops seen, mean", "saw all stops"});
  for (const auto& [tour, group] : tours)
    html += TableRow("td", {tour, group.Visits(), group.MedianDuration(), group.Share(group.seen),
                            group.Share(static_cast<double>(group.finished))});
  return html + "</table>\n";
}

std::string MapTable(const std::vector<MapVisits>& maps) {
  std::string html =
      "<h2>Where visitors are lost</h2>\n<p class=note>The maps are listed by how often visitors are lost in "
      "them. "
      "Visitors are lost where a map has too few views: extend it there.</p>\n<table>" +
      TableRow("th", {"map", "visits", "median stay", "times lost", "per hour", "longest"});
  for (const MapVisits& map : maps)
    html += TableRow("td",
                     {map.map, std::to_string(map.visits), Duration(map.median_s), std::to_string(map.losses),
                      Decimal(map.LossesPerHour(), 1), map.losses == 0 ? "" : Duration(map.longest_loss_s)});
  return html + "</table>\n";
}

// From above: in a map, x is to the right and z ahead of its first camera, which was held about level.
SvgPlot::Point FromAbove(const Eigen::Vector3d& place) {
  return {place.x(), place.z()};
}

std::string MapPlot(const std::vector<VisitRecord>& visits, const std::string& map) {
  std::vector<SvgPlot::Point> path, lost;
  for (const VisitRecord& visit : visits) {
    for (const VisitRecord::Step& step : visit.path) {
      if (visit.stays[step.stay].map == map) path.push_back(FromAbove(step.place));
    }
    for (const VisitRecord::Loss& loss : visit.losses) {
      if (loss.map == map) lost.push_back(FromAbove(loss.place));
    }
  }
  if (path.empty()) return "";
  SvgPlot plot(map + " from above", "right (map units)", "ahead (map units)");
  plot.KeepAspect();
  plot.SetHeight(320);
  // Places where many were are darker.
  plot.AddDots(std::move(path), "rgba(40,90,160,0.25)", "visitors, once a second", 2.5);
  if (!lost.empty()) plot.AddDots(std::move(lost), "#c0261b", "lost", 4);
  return "<figure>" + plot.Finish() + "</figure>\n";
}

}  // namespace

std::vector<MapVisits> MapsByCare(const std::vector<VisitRecord>& visits) {
  std::map<std::string, MapVisits> maps;
  std::map<std::string, std::vector<double>> stays;
  for (const VisitRecord& visit : visits) {
    std::map<std::string, double> stayed;
    for (const VisitRecord::Stay& stay : visit.stays) stayed[stay.map] += stay.duration_s;
    for (const auto& [map, seconds] : stayed) {
      maps[map].total_s += seconds;
      stays[map].push_back(seconds);
    }
    for (const VisitRecord::Loss& loss : visit.losses) {
      MapVisits& map = maps[loss.map];
      ++map.losses;
      map.longest_loss_s = std::max(map.longest_loss_s, loss.duration_s);
    }
  }
  std::vector<MapVisits> sorted;
  for (auto& [name, map] : maps) {
    map.map = name;
    map.visits = stays[name].size();
    if (map.visits > 0) map.median_s = Median(stays[name]);
    sorted.push_back(map);
  }
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const auto& a, const auto& b) { return a.LossesPerHour() > b.LossesPerHour(); });
  return sorted;
}

std::string FormatVisitReport(const std::vector<VisitRecord>& visits, const std::string& title) {
  const std::vector<MapVisits> maps = MapsByCare(visits);
  std::string html = "<!DOCTYPE html>\n<html lang=en><head><meta charset=utf-8><title>" + EscapeHtml(title) +
                     "</title><style>" + kStyle + "</style></head><body>\n<h1>" + EscapeHtml(title) +
                     "</h1>\n";
  if (visits.empty()) return html + "<p>There were no visits.</p>\n</body></html>\n";
  html += "<p>" + std::to_string(visits.size()) + " visits, " + DateOf(visits.front().begin) + " to " +
          DateOf(visits.back().begin) + " (UTC).</p>\n";
  html += DayTable(visits) + TourTable(visits) + MapTable(maps) + "<h2>Where visitors were</h2>\n";
  for (const MapVisits& map : maps) html += MapPlot(visits, map.map);
  return html + "</body></html>\n";
}

}  // namespace docent::app
