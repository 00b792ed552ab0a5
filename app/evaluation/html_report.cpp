// SPDX-License-Identifier: Apache-2.0
#include "app/evaluation/html_report.h"

#include <Eigen/Eigenvalues>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>

#include "app/evaluation/svg_plot.h"
#include "app/files/checked_file.h"
#include "app/files/text_file.h"

namespace docent::app {

namespace {

constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();

struct StateColor {
  engine::TrackingState state;
  const char* color;
};
constexpr std::array<StateColor, 7> kStateColors = {{
    {engine::TrackingState::kInitializing, "#d9d9d9"},
    {engine::TrackingState::kSixDof, "#2c8a4b"},
    {engine::TrackingState::kHybrid, "#8cc26b"},
    {engine::TrackingState::kPanorama, "#4a90c2"},
    {engine::TrackingState::kRelocalized, "#f2b134"},
    {engine::TrackingState::kLost, "#c8413c"},
    {engine::TrackingState::kDropped, "#7a5aa6"},
}};
constexpr std::array<const char*, 6> kMapColors = {"#2c8a4b", "#4a90c2", "#c8413c",
                                                   "#f2b134", "#7a5aa6", "#3aa6a0"};

std::string Fixed(double value, int decimals) {
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", decimals, value);
  return text;
}

std::string Fixed(const std::optional<double>& value, int decimals, const char* unit) {
  return value ? Fixed(*value, decimals) + unit : "unknown";
}

double SecondsFromStart(const EvaluatedRun& run, std::size_t frame) {
  return ToSeconds(run.run.frames[frame].time - run.run.frames.front().time);
}

template <typename Value>
std::vector<SvgPlot::Point> OverTime(const EvaluatedRun& run, const Value& value) {
  std::vector<SvgPlot::Point> points;
  for (std::size_t i = 0; i < run.run.frames.size(); ++i)
    points.push_back({SecondsFromStart(run, i), static_cast<double>(value(i))});
  return points;
}

std::string StatePlot(const EvaluatedRun& run) {
  SvgPlot plot("Tracking by state", "seconds", "");
  plot.HideYAxis();
  plot.SetHeight(120);
  const std::size_t count = run.run.frames.size();
  for (const StateColor& entry : kStateColors) {
    bool used = false;
    for (const FrameRecord& frame : run.run.frames) used = used || frame.state == entry.state;
    if (used) plot.AddLegend(entry.color, engine::ToString(entry.state));
  }
  for (std::size_t i = 0; i < count; ++i) {
    const double begin = SecondsFromStart(run, i);
    const double end = i + 1 < count ? SecondsFromStart(run, i + 1) : begin;
    for (const StateColor& entry : kStateColors) {
      if (entry.state == run.run.frames[i].state) plot.AddBand(begin, end, entry.color);
    }
  }
  return plot.Finish();
}

std::string KeyFramePlot(const EvaluatedRun& run) {
  const auto& frames = run.run.frames;
  SvgPlot plot("Keyframes of the current map", "seconds", "keyframes");
  plot.AddLine(OverTime(run, [&](std::size_t i) { return frames[i].map_keyframes.sixdof; }), "#2c8a4b",
               "sixdof");
  plot.AddLine(OverTime(run, [&](std::size_t i) { return frames[i].map_keyframes.panorama; }), "#4a90c2",
               "panorama");
  return plot.Finish();
}

std::string PointPlot(const EvaluatedRun& run) {
  const auto& frames = run.run.frames;
  SvgPlot plot("Points of the current map, and those found in the frame", "seconds", "points");
  plot.AddLine(OverTime(run, [&](std::size_t i) { return frames[i].map_points.finite; }), "#2c8a4b",
               "finite");
  plot.AddLine(OverTime(run, [&](std::size_t i) { return frames[i].map_points.infinite; }), "#4a90c2",
               "infinite");
  plot.AddLine(
      OverTime(run, [&](std::size_t i) { return frames[i].finite_points + frames[i].infinite_points; }),
      "#f2b134", "found");
  return plot.Finish();
}

std::string TrackingTimePlot(const EvaluatedRun& run) {
  SvgPlot plot("Time of tracking", "seconds", "ms a frame");
  plot.AddLine(OverTime(run,
                        [&](std::size_t i) {
                          const FrameRecord& frame = run.run.frames[i];
                          return frame.state == engine::TrackingState::kDropped ? kNothing
                                                                                : frame.tracking_ms;
                        }),
               "#4a90c2", "");
  return plot.Finish();
}

// The plane that shows most of these positions: their mean and their two longest axes. For a camera that is
// carried about, that is the view from above, whichever way the truth's axes point.
struct View {
  Eigen::Vector3d center = Eigen::Vector3d::Zero(), right = Eigen::Vector3d::UnitX(),
                  up = Eigen::Vector3d::UnitZ();
  SvgPlot::Point Look(const Eigen::Vector3d& x) const { return {right.dot(x - center), up.dot(x - center)}; }
};

View FitView(const std::vector<Eigen::Vector3d>& positions) {
  View view;
  if (positions.size() < 3) return view;
  for (const Eigen::Vector3d& x : positions) view.center += x / static_cast<double>(positions.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& x : positions) spread += (x - view.center) * (x - view.center).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(spread);  // by ascending eigenvalue
  view.right = axes.eigenvectors().col(2);
  view.up = axes.eigenvectors().col(1);
  return view;
}

std::string AlignedTrajectoryPlot(const EvaluatedRun& run) {
  std::vector<Eigen::Vector3d> truth;
  for (const TimedPose& pose : run.truth) truth.push_back(pose.truth_from_camera.translation);
  const View view = FitView(truth);
  SvgPlot plot("Trajectory from above, each map aligned with the truth", "metres", "metres");
  plot.KeepAspect();
  plot.SetHeight(520);
  std::vector<SvgPlot::Point> line;
  for (const Eigen::Vector3d& x : truth) line.push_back(view.Look(x));
  plot.AddLine(std::move(line), "#9a9a9a", "truth");
  for (std::size_t m = 0; m < run.report.maps.size(); ++m) {
    const MapResult& map = run.report.maps[m];
    if (!map.ate_rmse_m) continue;
    std::vector<SvgPlot::Point> points;
    for (std::size_t i = 0; i < run.run.frames.size(); ++i) {
      const auto& position = run.report.frame_results[i].position_in_truth;
      const bool here = position && run.run.frames[i].map_key == map.key;
      points.push_back(here ? view.Look(*position) : SvgPlot::Point{kNothing, kNothing});
    }
    plot.AddLine(std::move(points), kMapColors[m % kMapColors.size()], map.name);
  }
  return plot.Finish();
}

// The map as the engine sees it, in its own frame and scale: camera centres and finite points.
std::string MapPlot(const EvaluatedRun& run, const MapRecord& map) {
  std::vector<Eigen::Vector3d> centers;
  for (std::size_t i = 0; i < run.run.frames.size(); ++i) {
    const FrameRecord& frame = run.run.frames[i];
    if (frame.map_key == map.key && engine::HasPose(frame.state) && !InMapOfDirections(frame)) {
      centers.push_back(frame.camera_from_map.OriginInSource());
    }
  }
  std::vector<Eigen::Vector3d> everything = centers;
  everything.insert(everything.end(), map.positions.begin(), map.positions.end());
  const View view = FitView(everything);
  SvgPlot plot("The map '" + map.name + "' from its broad side", "map metres", "map metres");
  plot.KeepAspect();
  plot.SetHeight(420);
  std::vector<SvgPlot::Point> dots, line;
  for (const Eigen::Vector3d& x : map.positions) dots.push_back(view.Look(x));
  for (const Eigen::Vector3d& x : centers) line.push_back(view.Look(x));
  plot.AddDots(std::move(dots), "#2c8a4b", "finite points");
  plot.AddDots(std::move(line), "#c8413c", "camera", 1.0);
  return plot.Finish();
}

std::string ErrorPlots(const EvaluatedRun& run) {
  const auto& results = run.report.frame_results;
  SvgPlot position("Error of the position", "seconds", "centimetres");
  position.AddLine(
      OverTime(run, [&](std::size_t i) { return results[i].position_error_m.value_or(kNothing) * 100; }),
      "#c8413c", "");
  SvgPlot rotation("Error of the rotation", "seconds", "degrees");
  rotation.AddLine(
      OverTime(run, [&](std::size_t i) { return results[i].rotation_error_deg.value_or(kNothing); }),
      "#c8413c", "");
  return position.Finish() + rotation.Finish();
}

std::string Row(const std::string& name, const std::string& value) {
  return "<tr><th>" + EscapeHtml(name) + "</th><td>" + EscapeHtml(value) + "</td></tr>\n";
}

std::string FigureTable(const SequenceReport& r) {
  const std::string first = r.first_tracked_frame ? std::to_string(*r.first_tracked_frame) : "never";
  std::string html = "<table>";
  html += Row("frames", std::to_string(r.frames));
  html += Row("tracked after the first tracked frame", Fixed(r.tracked_ratio * 100, 1) + " %");
  html += Row("first tracked frame", first);
  html += Row("relocalizations", std::to_string(r.relocalizations));
  html += Row("ATE RMSE", Fixed(r.ate_rmse_m ? std::optional(*r.ate_rmse_m * 100) : std::nullopt, 2, " cm"));
  html += Row("rotation RMSE", Fixed(r.rotation_rmse_deg, 3, "°"));
  html += Row("rotation drift, last frame against first", Fixed(r.rotation_drift_deg, 3, "°"));
  html += Row("of it about the axis of the true turn", Fixed(r.turn_error_deg, 3, "°"));
  html += Row("scale", Fixed(r.scale, 4, ""));
  html += Row("keyframes", std::to_string(r.keyframes.sixdof) + " sixdof, " +
                               std::to_string(r.keyframes.panorama) + " panorama, " +
                               std::to_string(r.keyframes.localized) + " localized");
  html += Row("points", std::to_string(r.points.finite) + " finite, " + std::to_string(r.points.infinite) +
                            " infinite, " + std::to_string(r.points.converted) + " converted");
  html += Row("tracking", Fixed(r.tracking_median_ms, 2) + " ms median, " + Fixed(r.tracking_p95_ms, 2) +
                              " ms at 95 %, " + Fixed(r.tracking_max_ms, 2) + " ms at most");
  html += Row("mapping", Fixed(r.mapping.bundle_adjustment_s, 2) + " s bundle adjustment, " +
                             Fixed(r.mapping.panorama_localization_s, 2) + " s panorama localization, " +
                             Fixed(r.mapping.infinite_triangulation_s, 2) + " s infinite triangulation, " +
                             Fixed(r.mapping.other_s, 2) + " s other");
  html += Row("wall time", Fixed(r.wall_s, 1) + " s");
  html += Row("peak memory", Fixed(r.peak_memory_mb, 0) + " MB");
  return html + "</table>\n";
}

std::string Centimetres(const std::optional<double>& metres) {
  return metres ? Fixed(*metres * 100, 2) + " cm" : "unknown";
}

std::string MapTable(const SequenceReport& r) {
  std::string html =
      "<h3>Maps</h3><table><tr><th>map</th><th>frames</th><th>ATE RMSE</th><th>rotation</th></tr>\n";
  for (const MapResult& map : r.maps) {
    html += "<tr><td>" + EscapeHtml(map.name) + (map.discarded ? " (given up)" : "") + "</td><td>" +
            std::to_string(map.frames) + "</td><td>" + Centimetres(map.ate_rmse_m) + "</td><td>" +
            Fixed(map.rotation_rmse_deg, 3, "°") + "</td></tr>\n";
  }
  html += "</table>\n<p>The figures above are those of the largest map.";
  if (r.discarded_frames > 0) {
    html += " " + std::to_string(r.discarded_frames) +
            " frames had a pose in a map that was given up later; they count as untracked.";
  }
  if (r.directions_only_frames > 0) {
    html += " " + std::to_string(r.directions_only_frames) +
            " frames were tracked while their map held directions alone; they have a rotation but no "
            "position, and "
            "the ATE is without them.";
  }
  return html + "</p>\n";
}

std::string SegmentTable(const SequenceReport& r) {
  if (r.segments.empty()) return {};
  std::string html =
      "<h3>Segments</h3><table><tr><th>label</th><th>frames</th><th>tracked</th><th>ATE RMSE</th></tr>\n";
  for (const SegmentResult& segment : r.segments) {
    html += "<tr><td>" + EscapeHtml(segment.label) + "</td><td>" + std::to_string(segment.frames) +
            "</td><td>" + Fixed(segment.tracked_ratio * 100, 1) + " %</td><td>" +
            Centimetres(segment.ate_rmse_m) + "</td></tr>\n";
  }
  return html + "</table>\n";
}

std::string Section(const EvaluatedRun& run) {
  std::string html = "<section><h2>" + EscapeHtml(run.report.name) + "</h2>\n" + FigureTable(run.report);
  if (!run.run.frames.empty()) {
    html += StatePlot(run) + KeyFramePlot(run) + PointPlot(run) + TrackingTimePlot(run);
    if (!run.truth.empty()) html += AlignedTrajectoryPlot(run) + ErrorPlots(run);
    if (run.report.largest_map) {
      for (const MapRecord& map : run.run.maps) {
        if (map.key == run.report.maps[*run.report.largest_map].key) html += MapPlot(run, map);
      }
    }
  }
  if (!run.report.maps.empty()) html += MapTable(run.report);
  return html + SegmentTable(run.report) + "</section>\n";
}

}  // namespace

std::string FormatHtmlReport(const std::vector<EvaluatedRun>& runs) {
  std::string html =
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>Docent: "
      "evaluation</title>\n<style>\n"
      "body{font:15px/1.45 system-ui,sans-serif;max-width:960px;margin:2em auto;padding:0 1em;color:#222}\n"
      "table{border-collapse:collapse;margin:1em 0}th,td{padding:.15em .8em;text-align:left;"
      "border-bottom:1px solid #ddd;font-variant-numeric:tabular-nums}th{font-weight:600}\n"
      "svg{width:100%;height:auto;margin:.6em 0;font:12px system-ui,sans-serif}svg .title{font-weight:600;"
      "font-size:13px}svg .grid{stroke:#e3e3e3;fill:none}\n</style></head><body>\n<h1>Docent: "
      "evaluation</h1>\n";
  html +=
      "<table><tr><th>sequence</th><th>tracked</th><th>ATE RMSE</th><th>rotation</th><th>turn, last against "
      "first</th>"
      "<th>ms a frame</th></tr>\n";
  for (const EvaluatedRun& run : runs) {
    const SequenceReport& r = run.report;
    html += "<tr><td>" + EscapeHtml(r.name) + "</td><td>" + Fixed(r.tracked_ratio * 100, 1) + " %</td><td>" +
            Centimetres(r.ate_rmse_m) + "</td><td>" + Fixed(r.rotation_rmse_deg, 3, "°") + "</td><td>" +
            Fixed(r.turn_error_deg, 3, "°") + "</td><td>" + Fixed(r.tracking_median_ms, 2) + "</td></tr>\n";
  }
  html += "</table>\n";
  for (const EvaluatedRun& run : runs) html += Section(run);
  return html + "</body></html>\n";
}

void WriteHtmlReport(const std::filesystem::path& path, const std::vector<EvaluatedRun>& runs) {
  CheckedFile file(path);
  file.Write(FormatHtmlReport(runs));
  file.Close();
}

}  // namespace docent::app
