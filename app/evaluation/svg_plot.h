// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace docent::app {

// A plot as inline SVG: axes with round tick values, lines, dots and bands. Add all data, then call Finish
// once; the axes are fitted to the data. Values that are not finite are omitted and interrupt a line.
class SvgPlot {
 public:
  struct Point {
    double x = 0, y = 0;
  };

  SvgPlot(std::string title, std::string x_label, std::string y_label);

  // `color` is a CSS colour; a nonempty label is added to the legend.
  void AddLine(std::vector<Point> points, const std::string& color, const std::string& label);
  void AddDots(std::vector<Point> points, const std::string& color, const std::string& label,
               double radius_px = 1.2);
  // Adds a vertical line from zero to each point.
  void AddStems(std::vector<Point> points, const std::string& color, const std::string& label);
  // Extends the axes to include this point, so that two plots can have equal ranges.
  void Include(const Point& point) { included_.push_back(point); }
  // Adds a coloured strip over the whole height from x = begin to end.
  void AddBand(double begin, double end, const std::string& color);
  // Adds a legend entry, for bands.
  void AddLegend(const std::string& color, const std::string& label);
  // Gives both axes the same scale, for views from above.
  void KeepAspect() { keep_aspect_ = true; }
  // Hides the y axis, for plots with bands only.
  void HideYAxis() { hide_y_axis_ = true; }
  void SetHeight(int height_px) { height_px_ = height_px; }

  std::string Finish() const;

 private:
  struct Series {
    std::vector<Point> points;
    std::string color;
    double radius_px = 0;  // 0: a line
    bool stems = false;
  };
  struct Band {
    double begin = 0, end = 0;
    std::string color;
  };
  struct Frame;

  Frame FitFrame() const;
  std::string DrawAxes(const Frame& frame) const;
  std::string DrawSeries(const Frame& frame, const Series& series) const;
  std::string DrawLegend() const;

  std::string title_, x_label_, y_label_;
  std::vector<Series> series_;
  std::vector<Band> bands_;
  std::vector<Point> included_;
  std::vector<std::pair<std::string, std::string>> legend_;  // Colour and label.
  bool keep_aspect_ = false, hide_y_axis_ = false;
  int height_px_ = 260;
};

// Escapes & < > " ' for HTML and SVG.
std::string EscapeHtml(const std::string& text);
// About `count` round tick values in [low, high].
std::vector<double> RoundTicks(double low, double high, int count);

}  // namespace docent::app
