// SPDX-License-Identifier: Apache-2.0
#include "app/evaluation/html_report.h"

#include <algorithm>
#include <cstdio>
#include <optional>

#include "app/evaluation/distribution_section.h"
#include "app/evaluation/run_plots.h"
#include "app/evaluation/svg_plot.h"
#include "app/files/text_file.h"
#include "engine/base/base64.h"

namespace docent::app {

namespace {

std::string Fixed(double value, int decimals) {
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", decimals, value);
  return text;
}

std::string Fixed(const std::optional<double>& value, int decimals, const char* unit) {
  return value ? Fixed(*value, decimals) + unit : "unknown";
}

std::string Row(const std::string& name, const std::string& value) {
  return "<tr><th>" + EscapeHtml(name) + "</th><td>" + EscapeHtml(value) + "</td></tr>\n";
}

std::string FigureTable(const SequenceReport& r) {
  const std::string first = r.first_tracked_frame ? std::to_string(*r.first_tracked_frame) : "never";
  std::string html = "<table>";
  html += Row("frames", std::to_string(r.frames));
  html += Row("tracked, from the first tracked frame on", Fixed(r.tracked_ratio * 100, 1) + " %");
  html += Row("first tracked frame", first);
  html += Row("last tracked frame", r.last_tracked_frame ? std::to_string(*r.last_tracked_frame) : "never");
  html += Row("relocalizations", std::to_string(r.relocalizations));
  html += Row("compared with the ground truth",
              r.has_truth ? std::to_string(r.compared_frames) + " frames" : "no ground truth");
  html += Row("ATE RMSE", Fixed(r.ate_rmse_m ? std::optional(*r.ate_rmse_m * 100) : std::nullopt, 2, " cm"));
  html += Row("rotation RMSE", Fixed(r.rotation_rmse_deg, 3, "°"));
  html += Row("rotation error, first to last frame", Fixed(r.rotation_drift_deg, 3, "°"));
  html += Row("rotation error about the true axis", Fixed(r.axis_drift_deg, 3, "°"));
  html += Row("scale", Fixed(r.scale, 4, ""));
  html += Row("keyframes", std::to_string(r.keyframes.sixdof) + " sixdof, " +
                               std::to_string(r.keyframes.panorama) + " panorama, " +
                               std::to_string(r.keyframes.localized) + " localized");
  html += Row("points", std::to_string(r.points.finite) + " finite, " + std::to_string(r.points.infinite) +
                            " infinite, " + std::to_string(r.points.converted) + " converted");
  html += Row("tracking", Fixed(r.tracking_median_ms, 2) + " ms median, " + Fixed(r.tracking_p95_ms, 2) +
                              " ms at 95 %, " + Fixed(r.tracking_max_ms, 2) + " ms maximum");
  html += Row("mapping", Fixed(r.mapping.bundle_adjustment_s, 2) + " s bundle adjustment, " +
                             Fixed(r.mapping.panorama_localization_s, 2) + " s panorama localization, " +
                             Fixed(r.mapping.infinite_triangulation_s, 2) + " s infinite triangulation, " +
                             Fixed(r.mapping.loop_closing_s, 2) + " s loop closing, " +
                             Fixed(r.mapping.other_s, 2) + " s other");
  if (r.lens) {
    html += Row("estimated focal length", Fixed(r.lens->focal_px, 1) + " px +-" +
                                              Fixed(r.lens->focal_sigma_percent, 2) + " %, k1 " +
                                              Fixed(r.lens->k1, 4) + (r.lens->fixed ? "" : ", not final"));
  }
  html += Row("loops closed", std::to_string(r.mapping.loops_closed));
  html += Row("wall time", Fixed(r.wall_s, 1) + " s");
  html += Row("peak memory", Fixed(r.peak_memory_mb, 0) + " MB");
  return html + "</table>\n";
}

std::string Centimetres(const std::optional<double>& metres) {
  return metres ? Fixed(*metres * 100, 2) + " cm" : "unknown";
}

std::string ShutterText(const std::optional<Eigen::Vector2d>& readout_s) {
  if (!readout_s) return "-";
  const bool columns = readout_s->x() != 0;
  const double milliseconds = 1000 * (columns ? readout_s->x() : readout_s->y());
  return milliseconds == 0 ? "none" : Fixed(milliseconds, 1, columns ? " ms, columns" : " ms, rows");
}

std::string MapTable(const SequenceReport& r) {
  std::string html =
      "<h3>Maps</h3><table><tr><th>map</th><th>frames</th><th>ATE RMSE</th><th>ATE RMSE of "
      "keyframes</th><th>rotation RMSE</th><th>rolling shutter</th></tr>\n";
  for (const MapResult& map : r.maps) {
    std::string name = map.name;
    if (map.discarded) name += " (discarded)";
    if (!map.joined_into.empty()) name += " (joined into " + map.joined_into + ")";
    html += "<tr><td>" + EscapeHtml(name) + "</td><td>" + std::to_string(map.frames) + "</td><td>" +
            Centimetres(map.ate_rmse_m) + "</td><td>" + Centimetres(map.keyframe_ate_rmse_m) + "</td><td>" +
            Fixed(map.rotation_rmse_deg, 3, "°") + "</td><td>" + ShutterText(map.readout_s) + "</td></tr>\n";
  }
  html += "</table>\n<p>The figures above are those of the largest map.";
  if (r.discarded_frames > 0) {
    html += " " + std::to_string(r.discarded_frames) +
            " frames had a pose in a map that was discarded later; they count as untracked.";
  }
  if (r.directions_only_frames > 0) {
    html += " " + std::to_string(r.directions_only_frames) +
            " frames were tracked in a map that had only infinite points; they have a rotation but no "
            "position, and "
            "are not included in the ATE.";
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

std::string PanoramaImages(const EvaluatedRun& run) {
  if (run.panoramas.empty()) return {};
  std::string html = "<h3>Panorama maps</h3>\n";
  for (const ShownPanorama& panorama : run.panoramas) {
    html += "<figure><img alt=\"" + EscapeHtml(panorama.caption) + "\" src=\"data:image/png;base64," +
            EncodeBase64(panorama.png) + "\"><figcaption>" + EscapeHtml(panorama.caption) +
            "</figcaption></figure>\n";
  }
  return html;
}

const MapRecord* LargestMap(const EvaluatedRun& run) {
  if (!run.report.largest_map) return nullptr;
  for (const MapRecord& map : run.run.maps) {
    if (map.key == run.report.maps[*run.report.largest_map].key) return &map;
  }
  return nullptr;
}

// Draws the run and, beside it, the same sequence with the other engine.
template <typename Draw>
std::string SideBySide(const EvaluatedRun& run, const Draw& draw) {
  const auto drawn = [&draw](const EvaluatedRun& one) {
    return one.run.frames.empty() ? std::string() : draw(one);
  };
  if (!run.compared) return drawn(run);
  const auto column = [&](const EvaluatedRun& one) {
    return "<div><h4>" + EscapeHtml(one.run.engine) + "</h4>" + drawn(one) + "</div>";
  };
  return "<div class=\"pair\">" + column(run) + column(*run.compared) + "</div>\n";
}

std::string RunPlots(const EvaluatedRun& run) {
  const PlotRanges ranges = run.compared ? Both(RangesOf(run), RangesOf(*run.compared)) : RangesOf(run);
  const auto with_ranges = [&ranges](auto plot) {
    return [&ranges, plot](const EvaluatedRun& one) { return plot(one, ranges); };
  };
  const auto of_map = [](auto plot) {
    return [plot](const EvaluatedRun& one) {
      const MapRecord* map = LargestMap(one);
      return map ? plot(one, *map) : std::string();
    };
  };
  std::string html = SideBySide(run, StatePlot) + SideBySide(run, with_ranges(KeyFramePlot)) +
                     SideBySide(run, with_ranges(PointPlot)) + SideBySide(run, with_ranges(FinitePointPlot)) +
                     SideBySide(run, with_ranges(MappingPlot)) +
                     SideBySide(run, with_ranges(TrackingTimePlot));
  if (!run.truth.empty()) html += SideBySide(run, AlignedTrajectoryPlot) + SideBySide(run, ErrorPlots);
  return html + SideBySide(run, of_map(PointViewPlot)) + SideBySide(run, of_map(PlaceViewPlot)) +
         SideBySide(run, PanoramaImages);
}

std::string Tables(const EvaluatedRun& run) {
  return (run.report.maps.empty() ? std::string() : MapTable(run.report)) + SegmentTable(run.report);
}

std::string Section(const EvaluatedRun& run) {
  std::string html = "<section><h2>" + EscapeHtml(run.report.name) + "</h2>\n";
  html += SideBySide(run, [](const EvaluatedRun& one) { return FigureTable(one.report); });
  html += RunPlots(run) + SideBySide(run, Tables);
  return html + "</section>\n";
}

// Rotation error about the true axis up to the last compared frame of the largest map. That frame is named
// when it is not the last frame of the sequence.
std::string AxisDrift(const SequenceReport& r) {
  if (!r.axis_drift_deg) return "unknown";
  const std::string drift = Fixed(*r.axis_drift_deg, 3) + "°";
  if (!r.largest_map) return drift;
  const std::optional<std::size_t>& last = r.maps[*r.largest_map].last_compared_frame;
  const bool to_the_end = !last || *last + 1 == static_cast<std::size_t>(r.frames);
  return to_the_end ? drift : drift + " at frame " + std::to_string(*last);
}

std::string SummaryRow(const SequenceReport& r, const std::string& name) {
  return "<tr><td>" + EscapeHtml(name) + "</td><td>" + EscapeHtml(r.engine) + "</td><td>" +
         Fixed(r.tracked_ratio * 100, 1) + " %</td><td>" + Centimetres(r.ate_rmse_m) + "</td><td>" +
         Fixed(r.rotation_rmse_deg, 3, "°") + "</td><td>" + AxisDrift(r) + "</td><td>" +
         Fixed(r.tracking_median_ms, 2) + "</td></tr>\n";
}

std::string PageHead() {
  return "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>Docent: "
         "evaluation</title>\n<style>\n"
         "body{font:15px/1.45 system-ui,sans-serif;max-width:960px;margin:2em auto;padding:0 "
         "1em;color:#222}\n"
         "table{border-collapse:collapse;margin:1em 0}th,td{padding:.15em .8em;text-align:left;"
         "border-bottom:1px solid #ddd;font-variant-numeric:tabular-nums}th{font-weight:600}\n"
         "svg{width:100%;height:auto;margin:.6em 0;font:12px system-ui,sans-serif}svg .title{font-weight:600;"
         "font-size:13px}svg .grid{stroke:#e3e3e3;fill:none}\n"
         "body.wide{max-width:1800px}.pair{display:grid;grid-template-columns:1fr 1fr;gap:0 "
         "2em}.pair>div{min-width:0}"
         "h4{margin:.4em 0 0}figure{margin:1em 0}img{max-width:100%}\n</style></head>";
}

}  // namespace

std::string FormatHtmlReport(const std::vector<EvaluatedRun>& runs) {
  std::string html = PageHead();
  const bool wide =
      std::any_of(runs.begin(), runs.end(), [](const EvaluatedRun& run) { return run.compared != nullptr; });
  html += std::string(wide ? "<body class=\"wide\">" : "<body>") + "\n<h1>Docent: evaluation</h1>\n";
  html +=
      "<table><tr><th>sequence</th><th>engine</th><th>tracked</th><th>ATE RMSE</th><th>rotation RMSE</th>"
      "<th>Rotation error, first to last frame</th><th>ms per frame</th></tr>\n";
  for (const EvaluatedRun& run : runs) {
    html += SummaryRow(run.report, run.report.name);
    if (run.compared) html += SummaryRow(run.compared->report, run.report.name);
  }
  html += "</table>\n";
  for (const EvaluatedRun& run : runs) html += Section(run);
  return html + "</body></html>\n";
}

void WriteHtmlReport(const std::filesystem::path& path, const std::vector<EvaluatedRun>& runs) {
  WriteTextFile(path, FormatHtmlReport(runs));
}

std::string FormatHtmlReport(const std::vector<RunDistribution>& distributions) {
  std::string html = PageHead() + "<body>\n<h1>Docent: evaluation of many runs</h1>\n";
  for (const RunDistribution& distribution : distributions) html += DistributionSection(distribution);
  return html + "</body></html>\n";
}

void WriteHtmlReport(const std::filesystem::path& path, const std::vector<RunDistribution>& distributions) {
  WriteTextFile(path, FormatHtmlReport(distributions));
}

}  // namespace docent::app
