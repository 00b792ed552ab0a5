// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "app/evaluation/evaluated_run.h"

// Plots of a run as inline SVG, similar to those of hybrid-slam §6. Figure numbers refer to that paper.
namespace docent::app {

// Upper limits of the vertical axes, so that the plots of two engines have equal scales.
struct PlotRanges {
  double keyframes = 0, points = 0, tracking_ms = 0, mapping_ms = 0;
};
PlotRanges RangesOf(const EvaluatedRun& run);
PlotRanges Both(const PlotRanges& a, const PlotRanges& b);

// Plots over time; the run must have at least one frame.
std::string StatePlot(const EvaluatedRun& run);                                  // Fig. 5
std::string KeyFramePlot(const EvaluatedRun& run, const PlotRanges& ranges);     // Fig. 7
std::string PointPlot(const EvaluatedRun& run, const PlotRanges& ranges);        // Fig. 8 (a), (b)
std::string FinitePointPlot(const EvaluatedRun& run, const PlotRanges& ranges);  // Fig. 8 (c)
std::string MappingPlot(const EvaluatedRun& run, const PlotRanges& ranges);      // Fig. 11
std::string TrackingTimePlot(const EvaluatedRun& run, const PlotRanges& ranges);
std::string ErrorPlots(const EvaluatedRun& run);  // Needs ground truth.

// Views of the map from the front and from above.
std::string PointViewPlot(const EvaluatedRun& run, const MapRecord& map);  // Fig. 9
std::string PlaceViewPlot(const EvaluatedRun& run, const MapRecord& map);  // Fig. 10
std::string AlignedTrajectoryPlot(const EvaluatedRun& run);                // Needs ground truth.

}  // namespace docent::app
