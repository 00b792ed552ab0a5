// SPDX-License-Identifier: Apache-2.0
#include "app/evaluation/svg_plot.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "app/files/text_file.h"

namespace docent::app {

namespace {

constexpr int kWidthPx = 900, kLeftPx = 64, kRightPx = 12, kTopPx = 28, kBottomPx = 40;
constexpr std::size_t kMaxDots = 6000;

bool IsFinite(const SvgPlot::Point& p) {
  return std::isfinite(p.x) && std::isfinite(p.y);
}
std::string Px(double value) {
  return FormatNumber(std::round(value * 10) / 10, 7);
}

std::string Text(double x, double y, const char* anchor, const std::string& text, const char* more = "") {
  return "<text x=\"" + Px(x) + "\" y=\"" + Px(y) + "\" text-anchor=\"" + anchor + "\"" + more + ">" +
         EscapeHtml(text) + "</text>";
}

// Reduces the number of points and keeps the outline: of every `run` points the first, lowest, highest and
// last one remain, in their order.
std::vector<SvgPlot::Point> Decimate(const std::vector<SvgPlot::Point>& points, std::size_t run) {
  if (run < 5) return points;
  std::vector<SvgPlot::Point> result;
  for (std::size_t begin = 0; begin < points.size(); begin += run) {
    const std::size_t end = std::min(points.size(), begin + run);
    const auto by_y = [&](std::size_t a, std::size_t b) { return points[a].y < points[b].y; };
    std::vector<std::size_t> all;
    for (std::size_t i = begin; i < end; ++i) all.push_back(i);
    const auto [low, high] = std::minmax_element(all.begin(), all.end(), by_y);
    std::vector<std::size_t> kept = {begin, *low, *high, end - 1};
    std::sort(kept.begin(), kept.end());
    kept.erase(std::unique(kept.begin(), kept.end()), kept.end());
    for (const std::size_t i : kept) result.push_back(points[i]);
  }
  return result;
}

}  // namespace

// Range of the data and its position in the image.
struct SvgPlot::Frame {
  double x_low = 0, x_high = 1, y_low = 0, y_high = 1;
  double bottom_px = 0;
  double X(double x) const {
    return kLeftPx + (x - x_low) / (x_high - x_low) * (kWidthPx - kLeftPx - kRightPx);
  }
  double Y(double y) const { return bottom_px - (y - y_low) / (y_high - y_low) * (bottom_px - kTopPx); }
};

SvgPlot::SvgPlot(std::string title, std::string x_label, std::string y_label)
    : title_(std::move(title)), x_label_(std::move(x_label)), y_label_(std::move(y_label)) {}

void SvgPlot::AddLine(std::vector<Point> points, const std::string& color, const std::string& label) {
  if (!label.empty()) AddLegend(color, label);
  series_.push_back({std::move(points), color, 0, false});
}

void SvgPlot::AddDots(std::vector<Point> points, const std::string& color, const std::string& label,
                      double radius_px) {
  if (!label.empty()) AddLegend(color, label);
  series_.push_back({std::move(points), color, radius_px, false});
}

void SvgPlot::AddStems(std::vector<Point> points, const std::string& color, const std::string& label) {
  if (!label.empty()) AddLegend(color, label);
  if (!points.empty()) Include({points.front().x, 0});
  series_.push_back({std::move(points), color, 0, true});
}

void SvgPlot::AddBand(double begin, double end, const std::string& color) {
  if (!bands_.empty() && bands_.back().color == color && bands_.back().end == begin) {
    bands_.back().end = end;
  } else {
    bands_.push_back({begin, end, color});
  }
}

void SvgPlot::AddLegend(const std::string& color, const std::string& label) {
  legend_.emplace_back(color, label);
}

SvgPlot::Frame SvgPlot::FitFrame() const {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Frame frame{kInfinity, -kInfinity, kInfinity, -kInfinity, static_cast<double>(height_px_ - kBottomPx)};
  const auto fit = [&frame](const Point& point) {
    if (!IsFinite(point)) return;
    frame.x_low = std::min(frame.x_low, point.x), frame.x_high = std::max(frame.x_high, point.x);
    frame.y_low = std::min(frame.y_low, point.y), frame.y_high = std::max(frame.y_high, point.y);
  };
  for (const Series& series : series_) std::for_each(series.points.begin(), series.points.end(), fit);
  std::for_each(included_.begin(), included_.end(), fit);
  for (const Band& band : bands_) {
    frame.x_low = std::min(frame.x_low, band.begin), frame.x_high = std::max(frame.x_high, band.end);
  }
  if (!(frame.x_high >= frame.x_low)) frame.x_low = 0, frame.x_high = 1;
  if (!(frame.y_high >= frame.y_low)) frame.y_low = 0, frame.y_high = 1;
  if (!keep_aspect_ && frame.y_low > 0) frame.y_low = 0;
  if (frame.x_high == frame.x_low) frame.x_low -= 0.5, frame.x_high += 0.5;
  if (frame.y_high == frame.y_low) frame.y_high += 1;
  if (keep_aspect_) {
    const double width_px = kWidthPx - kLeftPx - kRightPx, height_px = frame.bottom_px - kTopPx;
    const double unit =
        1.05 * std::max((frame.x_high - frame.x_low) / width_px, (frame.y_high - frame.y_low) / height_px);
    const double x = (frame.x_low + frame.x_high) / 2, y = (frame.y_low + frame.y_high) / 2;
    frame.x_low = x - unit * width_px / 2, frame.x_high = x + unit * width_px / 2;
    frame.y_low = y - unit * height_px / 2, frame.y_high = y + unit * height_px / 2;
  }
  return frame;
}

std::string SvgPlot::DrawAxes(const Frame& frame) const {
  std::string svg;
  for (const double x : RoundTicks(frame.x_low, frame.x_high, 10)) {
    svg += "<path class=\"grid\" d=\"M" + Px(frame.X(x)) + " " + Px(kTopPx) + "V" + Px(frame.bottom_px) +
           "\"/>" + Text(frame.X(x), frame.bottom_px + 14, "middle", FormatNumber(x, 6));
  }
  if (!hide_y_axis_) {
    for (const double y : RoundTicks(frame.y_low, frame.y_high, 5)) {
      svg += "<path class=\"grid\" d=\"M" + Px(kLeftPx) + " " + Px(frame.Y(y)) + "H" +
             Px(kWidthPx - kRightPx) + "\"/>" + Text(kLeftPx - 6, frame.Y(y) + 4, "end", FormatNumber(y, 6));
    }
    const double middle = (kTopPx + frame.bottom_px) / 2;
    const std::string rotated = " transform=\"rotate(-90 12 " + Px(middle) + ")\"";
    svg += Text(12, middle, "middle", y_label_, rotated.c_str());
  }
  return svg + Text((kLeftPx + kWidthPx - kRightPx) / 2.0, frame.bottom_px + 32, "middle", x_label_);
}

std::string SvgPlot::DrawSeries(const Frame& frame, const Series& series) const {
  std::string svg;
  if (series.radius_px > 0) {
    const std::size_t step = series.points.size() / kMaxDots + 1;
    svg += "<g fill=\"" + EscapeHtml(series.color) + "\">";
    for (std::size_t i = 0; i < series.points.size(); i += step) {
      if (!IsFinite(series.points[i])) continue;
      svg += "<circle cx=\"" + Px(frame.X(series.points[i].x)) + "\" cy=\"" +
             Px(frame.Y(series.points[i].y)) + "\" r=\"" + FormatNumber(series.radius_px, 3) + "\"/>";
    }
    return svg + "</g>";
  }
  if (series.stems) {
    for (const Point& point : series.points) {
      if (!IsFinite(point) || point.y == 0) continue;
      svg += "M" + Px(frame.X(point.x)) + " " + Px(frame.Y(0)) + "V" + Px(frame.Y(point.y));
    }
    if (svg.empty()) return svg;
    return "<path fill=\"none\" stroke=\"" + EscapeHtml(series.color) + "\" stroke-width=\"1.3\" d=\"" + svg +
           "\"/>";
  }
  // Decimation assumes increasing x, which does not hold for views from above.
  const std::size_t run = keep_aspect_ ? 0 : series.points.size() / (kWidthPx / 2);
  bool pen_down = false;
  for (const Point& point : Decimate(series.points, run)) {
    if (!IsFinite(point)) {
      pen_down = false;
      continue;
    }
    svg += (pen_down ? "L" : "M") + Px(frame.X(point.x)) + " " + Px(frame.Y(point.y));
    pen_down = true;
  }
  return "<path fill=\"none\" stroke=\"" + EscapeHtml(series.color) + "\" stroke-width=\"1.3\" d=\"" + svg +
         "\"/>";
}

std::string SvgPlot::DrawLegend() const {
  std::string svg;
  double x = kWidthPx - kRightPx;
  for (auto entry = legend_.rbegin(); entry != legend_.rend(); ++entry) {
    const double width =
        22 +
        7.8 * static_cast<double>(entry->second.size());  // Of a wide font, per letter at a size of 12 px.
    x -= width;
    svg += "<rect x=\"" + Px(x) + "\" y=\"9\" width=\"10\" height=\"10\" fill=\"" + EscapeHtml(entry->first) +
           "\"/>" + Text(x + 14, 18, "start", entry->second);
  }
  return svg;
}

std::string SvgPlot::Finish() const {
  const Frame frame = FitFrame();
  std::string svg = "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 " + std::to_string(kWidthPx) +
                    " " + std::to_string(height_px_) + "\" role=\"img\" aria-label=\"" + EscapeHtml(title_) +
                    "\">";
  for (const Band& band : bands_) {
    const double width = std::max(0.3, frame.X(band.end) - frame.X(band.begin));
    svg += "<rect x=\"" + Px(frame.X(band.begin)) + "\" y=\"" + Px(kTopPx) + "\" width=\"" + Px(width) +
           "\" height=\"" + Px(frame.bottom_px - kTopPx) + "\" fill=\"" + EscapeHtml(band.color) + "\"/>";
  }
  svg += DrawAxes(frame);
  for (const Series& series : series_) svg += DrawSeries(frame, series);
  return svg + DrawLegend() + Text(kLeftPx, 18, "start", title_, " class=\"title\"") + "</svg>";
}

std::string EscapeHtml(const std::string& text) {
  std::string result;
  for (const char c : text) {
    switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '"':
        result += "&quot;";
        break;
      case '\'':
        result += "&#39;";
        break;
      default:
        result += c;
    }
  }
  return result;
}

std::vector<double> RoundTicks(double low, double high, int count) {
  std::vector<double> ticks;
  if (!(high > low) || !std::isfinite(high - low) || count < 1) return ticks;
  const double raw = (high - low) / count;
  const double power = std::pow(10, std::floor(std::log10(raw)));
  double step = 10 * power;
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= raw * 0.999) {
      step = factor * power;
      break;
    }
  }
  const double first = std::ceil(low / step - 1e-9), last = std::floor(high / step + 1e-9);
  for (double i = first; i <= last; ++i) ticks.push_back(i * step);
  return ticks;
}

}  // namespace docent::app
