// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "app/evaluation/evaluated_run.h"

// The figures of a run as inline SVG, after those of hybrid-slam §6.
namespace docent::app {

// How far the vertical axes reach, so that the figures of two engines can be compared at a glance.
struct PlotRanges {
  double keyframes = 0, points = 0, tracking_ms = 0, mapping_ms = 0;
};
PlotRanges RangesOf(const EvaluatedRun& run);
PlotRanges Both(const PlotRanges& a, const PlotRanges& b);

// Over time; the run has at least one frame.
std::string StatePlot(const EvaluatedRun& run);                                  // Fig. 5
std::string KeyFramePlot(const EvaluatedRun& run, const PlotRanges& ranges);     // Fig. 7
std::string PointPlot(const EvaluatedRun& run, const PlotRanges& ranges);        // Fig. 8 (a), (b)
std::string FinitePointPlot(const EvaluatedRun& run, const PlotRanges& ranges);  // Fig. 8 (c)
std::string MappingPlot(const EvaluatedRun& run, const PlotRanges& ranges);      // Fig. 11
std::string TrackingTimePlot(const EvaluatedRun& run, const PlotRanges& ranges);
std::string ErrorPlots(const EvaluatedRun& run);  // needs truth

// From the side and from above.
std::string PointViewPlot(const EvaluatedRun& run, const MapRecord& map);  // Fig. 9
std::string PlaceViewPlot(const EvaluatedRun& run, const MapRecord& map);  // Fig. 10
std::string AlignedTrajectoryPlot(const EvaluatedRun& run);                // needs truth

}  // namespace docent::app
