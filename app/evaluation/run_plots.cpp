// SPDX-License-Identifier: Apache-2.0
#include "app/evaluation/run_plots.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "app/evaluation/svg_plot.h"

namespace docent::app {

namespace {

constexpr double kNoValue = std::numeric_limits<double>::quiet_NaN();

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
constexpr const char* kSixDofColor = "#2c8a4b";
constexpr const char* kPanoramaColor = "#4a90c2";
constexpr const char* kLocalizedColor = "#f2b134";
constexpr const char* kConvertedColor = "#8e44ad";

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

// The plane of the two principal axes with the largest variance, through the mean of the positions. For a
// hand-held camera this is approximately the view from above, whatever the axes of the ground truth are.
struct View {
  Eigen::Vector3d center = Eigen::Vector3d::Zero(), right = Eigen::Vector3d::UnitX(),
                  up = Eigen::Vector3d::UnitZ();
  SvgPlot::Point Project(const Eigen::Vector3d& x) const {
    return {right.dot(x - center), up.dot(x - center)};
  }
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

// Projection of a map onto two axes: in metres when the scale is known from the ground truth, else in map
// units.
class MapView {
 public:
  MapView(const EvaluatedRun& run, const MapRecord& map, const Eigen::Vector3d& right,
          const Eigen::Vector3d& up)
      : right_(right), up_(up) {
    for (const MapResult& result : run.report.maps) {
      if (result.key == map.key && result.scale) scale_ = result.scale;
    }
  }
  SvgPlot::Point Project(const Eigen::Vector3d& x) const {
    const double scale = scale_.value_or(1);
    return {scale * right_.dot(x), scale * up_.dot(x)};
  }
  std::vector<SvgPlot::Point> Project(const std::vector<Eigen::Vector3d>& positions) const {
    std::vector<SvgPlot::Point> points;
    for (const Eigen::Vector3d& x : positions) points.push_back(Project(x));
    return points;
  }
  const char* unit() const { return scale_ ? "metres" : "map units"; }

 private:
  Eigen::Vector3d right_, up_;
  std::optional<double> scale_;
};

// Removes far points, which would make everything else small: those more than 0.75 times the range between
// the 5 % and 95 % quantiles outside of that range. Returns the number of removed points.
std::size_t RemoveFarPoints(std::vector<SvgPlot::Point>* points) {
  if (points->size() < 20) return 0;
  const auto range = [&](double SvgPlot::Point::*axis) {
    std::vector<double> values;
    for (const SvgPlot::Point& point : *points) values.push_back(point.*axis);
    const double low = Quantile(values, 0.05), high = Quantile(values, 0.95);
    return std::pair(low - 0.75 * (high - low), high + 0.75 * (high - low));
  };
  const auto x = range(&SvgPlot::Point::x), y = range(&SvgPlot::Point::y);
  return std::erase_if(*points, [&](const SvgPlot::Point& point) {
    return point.x < x.first || point.x > x.second || point.y < y.first || point.y > y.second;
  });
}

std::string RemovedNote(std::size_t count) {
  return count > 0 ? " (" + std::to_string(count) + " further points not shown)" : "";
}

}  // namespace

PlotRanges RangesOf(const EvaluatedRun& run) {
  PlotRanges ranges;
  const FrameRecord* before = nullptr;
  for (const FrameRecord& frame : run.run.frames) {
    const KeyFrameCounts& keyframes = frame.map_keyframes;
    const PointCounts& points = frame.map_points;
    ranges.keyframes = std::max<double>(
        ranges.keyframes, std::max({keyframes.sixdof, keyframes.panorama, keyframes.localized}));
    ranges.points = std::max<double>(ranges.points, std::max(points.finite, points.infinite));
    if (frame.state != engine::TrackingState::kDropped)
      ranges.tracking_ms = std::max(ranges.tracking_ms, frame.tracking_ms);
    const MappingTimes& now = frame.mapping;
    const MappingTimes last = before ? before->mapping : MappingTimes();
    ranges.mapping_ms =
        std::max({ranges.mapping_ms, (now.bundle_adjustment_s - last.bundle_adjustment_s) * 1e3,
                  (now.panorama_localization_s - last.panorama_localization_s) * 1e3,
                  (now.infinite_triangulation_s - last.infinite_triangulation_s) * 1e3});
    before = &frame;
  }
  return ranges;
}

PlotRanges Both(const PlotRanges& a, const PlotRanges& b) {
  return {std::max(a.keyframes, b.keyframes), std::max(a.points, b.points),
          std::max(a.tracking_ms, b.tracking_ms), std::max(a.mapping_ms, b.mapping_ms)};
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

std::string KeyFramePlot(const EvaluatedRun& run, const PlotRanges& ranges) {
  const auto& frames = run.run.frames;
  SvgPlot plot("Keyframes of the current map", "seconds", "keyframes");
  plot.Include({0, ranges.keyframes});
  plot.AddLine(OverTime(run, [&](std::size_t i) { return frames[i].map_keyframes.sixdof; }), kSixDofColor,
               "sixdof");
  plot.AddLine(OverTime(run, [&](std::size_t i) { return frames[i].map_keyframes.panorama; }), kPanoramaColor,
               "panorama");
  plot.AddLine(OverTime(run, [&](std::size_t i) { return frames[i].map_keyframes.localized; }),
               kLocalizedColor, "localized panorama");
  return plot.Finish();
}

std::string PointPlot(const EvaluatedRun& run, const PlotRanges& ranges) {
  const auto& frames = run.run.frames;
  SvgPlot plot("Points of the current map and points found in the frame", "seconds", "points");
  plot.Include({0, ranges.points});
  plot.AddLine(OverTime(run, [&](std::size_t i) { return frames[i].map_points.finite; }), kSixDofColor,
               "finite");
  plot.AddLine(OverTime(run, [&](std::size_t i) { return frames[i].map_points.infinite; }), kPanoramaColor,
               "infinite");
  plot.AddLine(
      OverTime(run, [&](std::size_t i) { return frames[i].finite_points + frames[i].infinite_points; }),
      kLocalizedColor, "found");
  return plot.Finish();
}

std::string FinitePointPlot(const EvaluatedRun& run, const PlotRanges& ranges) {
  const auto& frames = run.run.frames;
  SvgPlot plot("Finite points of the current map by origin", "seconds", "points");
  plot.Include({0, ranges.points});
  plot.AddLine(
      OverTime(run,
               [&](std::size_t i) { return frames[i].map_points.finite - frames[i].map_points.converted; }),
      kSixDofColor, "triangulated directly");
  plot.AddLine(OverTime(run, [&](std::size_t i) { return frames[i].map_points.converted; }), kConvertedColor,
               "converted from infinite points");
  return plot.Finish();
}

// Mapping time between each frame and the previous one.
std::string MappingPlot(const EvaluatedRun& run, const PlotRanges& ranges) {
  const auto& frames = run.run.frames;
  SvgPlot plot("Mapping time", "seconds", "ms since the previous frame");
  plot.Include({0, ranges.mapping_ms});
  const auto spent_ms = [&](double MappingTimes::*task) {
    return OverTime(run, [&](std::size_t i) {
      return (frames[i].mapping.*task - (i > 0 ? frames[i - 1].mapping.*task : 0)) * 1e3;
    });
  };
  plot.AddStems(spent_ms(&MappingTimes::bundle_adjustment_s), kSixDofColor, "bundle adjustment");
  plot.AddStems(spent_ms(&MappingTimes::infinite_triangulation_s), kConvertedColor, "infinite triangulation");
  plot.AddStems(spent_ms(&MappingTimes::panorama_localization_s), kPanoramaColor, "panorama localization");
  return plot.Finish();
}

std::string TrackingTimePlot(const EvaluatedRun& run, const PlotRanges& ranges) {
  SvgPlot plot("Tracking time", "seconds", "ms per frame");
  plot.Include({0, ranges.tracking_ms});
  plot.AddLine(OverTime(run,
                        [&](std::size_t i) {
                          const FrameRecord& frame = run.run.frames[i];
                          return frame.state == engine::TrackingState::kDropped ? kNoValue
                                                                                : frame.tracking_ms;
                        }),
               "#4a90c2", "");
  return plot.Finish();
}

std::string AlignedTrajectoryPlot(const EvaluatedRun& run) {
  std::vector<Eigen::Vector3d> truth;
  for (const TimedPose& pose : run.truth) truth.push_back(pose.truth_from_camera.translation);
  const View view = FitView(truth);
  SvgPlot plot("Trajectory from above, each map aligned with the ground truth", "metres", "metres");
  plot.KeepAspect();
  plot.SetHeight(520);
  std::vector<SvgPlot::Point> line;
  for (const Eigen::Vector3d& x : truth) line.push_back(view.Project(x));
  plot.AddLine(std::move(line), "#9a9a9a", "ground truth");
  for (std::size_t m = 0; m < run.report.maps.size(); ++m) {
    const MapResult& map = run.report.maps[m];
    if (!map.ate_rmse_m) continue;
    std::vector<SvgPlot::Point> points;
    for (std::size_t i = 0; i < run.run.frames.size(); ++i) {
      const auto& position = run.report.frame_results[i].position_in_truth;
      const bool here = position && run.run.frames[i].map_key == map.key;
      points.push_back(here ? view.Project(*position) : SvgPlot::Point{kNoValue, kNoValue});
    }
    plot.AddLine(std::move(points), kMapColors[m % kMapColors.size()], map.name);
  }
  return plot.Finish();
}

std::string PointViewPlot(const EvaluatedRun& run, const MapRecord& map) {
  const MapView view(run, map, map.forward.cross(map.up), map.up);
  std::vector<SvgPlot::Point> general, converted;
  for (std::size_t i = 0; i < map.positions.size(); ++i) {
    const bool was_direction = i < map.converted.size() && map.converted[i];
    (was_direction ? converted : general).push_back(view.Project(map.positions[i]));
  }
  const std::size_t removed = RemoveFarPoints(&general) + RemoveFarPoints(&converted);
  SvgPlot plot("Points of the map '" + map.name + "' from the front" + RemovedNote(removed), view.unit(),
               view.unit());
  plot.KeepAspect();
  plot.SetHeight(520);
  plot.AddDots(std::move(general), "#333333", "triangulated directly");
  plot.AddDots(std::move(converted), kConvertedColor, "converted from infinite points");
  return plot.Finish();
}

std::string PlaceViewPlot(const EvaluatedRun& run, const MapRecord& map) {
  const MapView view(run, map, map.forward.cross(map.up), map.forward);
  std::vector<SvgPlot::Point> trajectory;
  for (const FrameRecord& frame : run.run.frames) {
    const bool here = frame.map_key == map.key && engine::HasPose(frame.state) && !InMapWithoutDepth(frame);
    trajectory.push_back(here ? view.Project(frame.camera_from_map.OriginInSource())
                              : SvgPlot::Point{kNoValue, kNoValue});
  }
  SvgPlot plot("Trajectory and keyframes in the map '" + map.name + "', from above", view.unit(),
               view.unit());
  plot.KeepAspect();
  plot.SetHeight(520);
  plot.AddDots(view.Project(map.panorama_centers), "rgba(74,144,194,0.35)", "panorama map", 9);
  plot.AddLine(std::move(trajectory), "#9a9a9a", "trajectory");
  plot.AddDots(view.Project(map.sixdof_centers), kSixDofColor, "sixdof", 3);
  plot.AddDots(view.Project(map.localized_centers), kLocalizedColor, "localized panorama", 3);
  return plot.Finish();
}

std::string ErrorPlots(const EvaluatedRun& run) {
  const auto& results = run.report.frame_results;
  SvgPlot position("Position error", "seconds", "centimetres");
  position.AddLine(
      OverTime(run, [&](std::size_t i) { return results[i].position_error_m.value_or(kNoValue) * 100; }),
      "#c8413c", "");
  SvgPlot rotation("Rotation error", "seconds", "degrees");
  rotation.AddLine(
      OverTime(run, [&](std::size_t i) { return results[i].rotation_error_deg.value_or(kNoValue); }),
      "#c8413c", "");
  return position.Finish() + rotation.Finish();
}

}  // namespace docent::app
