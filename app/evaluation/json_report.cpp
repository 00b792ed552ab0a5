// SPDX-License-Identifier: Apache-2.0
#include "app/evaluation/json_report.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "app/files/text_file.h"

namespace docent::app {

namespace {

using Json = nlohmann::ordered_json;

template <typename Value>
Json OrNull(const std::optional<Value>& value) {
  return value ? Json(*value) : Json(nullptr);
}

Json ToJson(const MapResult& map) {
  return {{"name", map.name},
          {"discarded", map.discarded},
          {"joined_into", map.joined_into},
          {"frames", map.frames},
          {"compared_frames", map.compared_frames},
          {"ate_rmse_m", OrNull(map.ate_rmse_m)},
          {"keyframe_ate_rmse_m", OrNull(map.keyframe_ate_rmse_m)},
          {"rotation_rmse_deg", OrNull(map.rotation_rmse_deg)},
          {"rotation_drift_deg", OrNull(map.rotation_drift_deg)},
          {"turn_error_deg", OrNull(map.axis_drift_deg)},
          {"scale", OrNull(map.scale)},
          {"rolling_shutter_ms", map.readout_s ? Json(1000 * map.readout_s->y()) : Json()},
          {"rolling_shutter_columns_ms", map.readout_s ? Json(1000 * map.readout_s->x()) : Json()}};
}

Json ToJson(const SegmentResult& segment) {
  return {{"label", segment.label},
          {"frames", segment.frames},
          {"tracked", segment.tracked},
          {"tracked_ratio", segment.tracked_ratio},
          {"ate_rmse_m", OrNull(segment.ate_rmse_m)}};
}

Json ToJson(const SequenceReport& report) {
  Json json = {
      {"name", report.name},
      {"engine", report.engine.empty() ? Json(nullptr) : Json(report.engine)},
      {"frames", report.frames},
      {"tracked", report.tracked},
      {"tracked_ratio", report.tracked_ratio},
      {"first_tracked_frame", OrNull(report.first_tracked_frame)},
      {"last_tracked_frame", OrNull(report.last_tracked_frame)},
      {"relocalizations", report.relocalizations},
      {"compared_frames", report.has_truth ? Json(report.compared_frames) : Json(nullptr)},
      {"ate_rmse_m", OrNull(report.ate_rmse_m)},
      {"rotation_rmse_deg", OrNull(report.rotation_rmse_deg)},
      {"rotation_drift_deg", OrNull(report.rotation_drift_deg)},
      {"turn_error_deg", OrNull(report.axis_drift_deg)},
      {"scale", OrNull(report.scale)},
      {"keyframes",
       {{"sixdof", report.keyframes.sixdof},
        {"panorama", report.keyframes.panorama},
        {"localized", report.keyframes.localized}}},
      {"points",
       {{"finite", report.points.finite},
        {"infinite", report.points.infinite},
        {"converted", report.points.converted}}},
      {"tracking_ms",
       {{"median", report.tracking_median_ms},
        {"p95", report.tracking_p95_ms},
        {"max", report.tracking_max_ms}}},
      {"mapping_s",
       {{"bundle_adjustment", report.mapping.bundle_adjustment_s},
        {"panorama_localization", report.mapping.panorama_localization_s},
        {"infinite_triangulation", report.mapping.infinite_triangulation_s},
        {"loop_closing", report.mapping.loop_closing_s},
        {"other", report.mapping.other_s}}},
      {"loops_closed", report.mapping.loops_closed},
      {"keyframe_queue_latency_ms", 1e3 * report.mapping.max_queue_latency_s},
      {"wall_s", report.wall_s},
      {"peak_memory_mb", report.peak_memory_mb},
      {"discarded_frames", report.discarded_frames},
      {"directions_only_frames", report.directions_only_frames},
      {"maps", Json::array()},
      {"segments", Json::array()},
      {"lens_residuals", Json::array()},
  };
  for (const MapResult& map : report.maps) json["maps"].push_back(ToJson(map));
  for (const SegmentResult& segment : report.segments) json["segments"].push_back(ToJson(segment));
  if (report.lens) {
    json["lens"] = {{"focal_px", report.lens->focal_px},
                    {"k1", report.lens->k1},
                    {"focal_sigma_percent", report.lens->focal_sigma_percent},
                    {"fixed", report.lens->fixed}};
  }
  for (const LensRing& ring : report.lens_rings) {
    json["lens_residuals"].push_back(
        {{"samples", ring.samples}, {"mean_px", ring.mean_px}, {"sigma_px", ring.sigma_px}});
  }
  return json;
}

Json ToJson(const InitializationResult& start) {
  return {{"frame", start.frame},
          {"outcome", ToString(start.outcome)},
          {"discarded", start.discarded},
          {"window_s", start.window_s},
          {"centers", start.centers},
          {"depth_points", start.depth_points},
          {"depth_error", OrNull(start.depth_error)},
          {"error_m", start.error_m},
          {"path_m", start.path_m},
          {"true_path_m", start.true_path_m},
          {"depth_m", OrNull(start.depth_m)},
          {"least_depth_m", OrNull(start.min_depth_m)},
          {"most_depth_m", OrNull(start.max_depth_m)}};
}

Json ToJson(const RunRow& row) {
  Json json = {{"seed", row.key.seed},
               {"start", row.key.start},
               {"first_frame", row.key.first_frame},
               {"frames", row.frames},
               {"tracked", row.tracked},
               {"tracked_share", row.tracked_share},
               {"compared_frames", row.compared_frames},
               {"ate_rmse_m", OrNull(row.ate_m)},
               {"rotation_rmse_deg", OrNull(row.rotation_deg)},
               {"first_3d_pose_s", OrNull(row.first_3d_pose_s)},
               {"false_starts", OrNull(row.false_starts)},
               {"noticed_false_starts", OrNull(row.noticed)},
               {"maps", row.maps},
               {"discarded_maps", row.discarded_maps},
               {"tracking_median_ms", row.tracking_median_ms},
               {"starts", Json::array()}};
  for (const InitializationResult& start : row.initializations) json["starts"].push_back(ToJson(start));
  return json;
}

Json KeyOf(const RunRow& row) {
  return {{"seed", row.key.seed}, {"start", row.key.start}};
}

Json ToJson(const RunDistribution& distribution) {
  Json figures = Json::object();
  for (const Figure& figure : Figures()) {
    const std::optional<Spread> spread = SpreadOf(figure, distribution.rows);
    figures[figure.name] = nullptr;
    if (!spread) continue;
    figures[figure.name] = {{"runs", spread->runs},
                            {"min", spread->min},
                            {"median", spread->median},
                            {"max", spread->max},
                            {"worst", KeyOf(distribution.rows[spread->worst])}};
  }
  Json inner = {{"seeds", distribution.seeds}, {"starts", distribution.starts}};
  inner["window_s"] = distribution.window_s > 0 ? Json(distribution.window_s) : Json(nullptr);
  inner["figures"] = std::move(figures);
  inner["worst"] =
      distribution.rows.empty() ? Json(nullptr) : KeyOf(distribution.rows[WorstRun(distribution.rows)]);
  inner["runs"] = Json::array();
  for (const RunRow& row : distribution.rows) inner["runs"].push_back(ToJson(row));
  return {{"name", distribution.name},
          {"engine", distribution.engine.empty() ? Json(nullptr) : Json(distribution.engine)},
          {"distribution", std::move(inner)}};
}

// A folder's name need not be UTF-8. Invalid bytes are replaced, because otherwise no report could be
// written.
template <typename Report>
std::string FormatAll(const std::vector<Report>& reports, const std::vector<Report>& compared) {
  Json json = {{"sequences", Json::array()}};
  for (const Report& report : reports) json["sequences"].push_back(ToJson(report));
  for (const Report& report : compared) json["compared"].push_back(ToJson(report));
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string Format(const char* format, double value) {
  char text[64];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

}  // namespace

std::string FormatJsonReport(const std::vector<SequenceReport>& reports,
                             const std::vector<SequenceReport>& compared) {
  return FormatAll(reports, compared);
}

std::string FormatJsonReport(const std::vector<RunDistribution>& distributions,
                             const std::vector<RunDistribution>& compared) {
  return FormatAll(distributions, compared);
}

void WriteJsonReport(const std::filesystem::path& path, const std::vector<SequenceReport>& reports,
                     const std::vector<SequenceReport>& compared) {
  WriteTextFile(path, FormatJsonReport(reports, compared));
}

void WriteJsonReport(const std::filesystem::path& path, const std::vector<RunDistribution>& distributions,
                     const std::vector<RunDistribution>& compared) {
  WriteTextFile(path, FormatJsonReport(distributions, compared));
}

std::string FormatSummary(const SequenceReport& report) {
  std::string text = report.name + ": ";
  if (!report.first_tracked_frame) {
    text += "never tracked in " + std::to_string(report.frames) + " frames";
  } else {
    text += Format("%.1f %%", report.tracked_ratio * 100) + " tracked from frame " +
            std::to_string(*report.first_tracked_frame) + " of " + std::to_string(report.frames) + " on";
  }
  if (report.ate_rmse_m) text += ", ATE " + Format("%.1f cm", *report.ate_rmse_m * 100);
  if (report.rotation_rmse_deg) text += ", rotation " + Format("%.2f deg", *report.rotation_rmse_deg);
  const auto kept_maps = std::count_if(report.maps.begin(), report.maps.end(),
                                       [](const MapResult& map) { return !map.discarded && map.frames > 0; });
  if ((report.ate_rmse_m || report.rotation_rmse_deg) && kept_maps > 1)
    text += " (of the largest of " + std::to_string(kept_maps) + " maps)";
  text += ", " + Format("%.1f ms", report.tracking_median_ms) +
          " per frame (95 %: " + Format("%.1f ms", report.tracking_p95_ms) + ")";
  if (report.discarded_frames > 0) {
    text +=
        "; " + std::to_string(report.discarded_frames) + " frames in maps discarded later count as untracked";
  }
  if (report.has_truth) {
    if (const std::string warning = CoverageWarning(report.compared_frames, report.tracked); !warning.empty())
      text += "; " + warning;
  }
  return text;
}

}  // namespace docent::app
