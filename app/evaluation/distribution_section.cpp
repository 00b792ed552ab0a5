// SPDX-License-Identifier: Apache-2.0
#include "app/evaluation/distribution_section.h"

#include <algorithm>
#include <cstdio>
#include <functional>
#include <vector>

#include "app/evaluation/svg_plot.h"

namespace docent::app {

namespace {

std::string Cell(const std::string& text) {
  return "<td>" + EscapeHtml(text) + "</td>";
}

std::string Cell(const Figure& figure, const std::optional<double>& value) {
  return Cell(FormatValue(figure, value));
}

std::string SpreadTable(const RunDistribution& distribution) {
  std::string html =
      "<table><tr><th>figure</th><th>minimum</th><th>median</th><th>maximum</th><th>runs with this "
      "figure</th>"
      "<th>worst run</th></tr>\n";
  for (const Figure& figure : Figures()) {
    html += "<tr><th>" + EscapeHtml(figure.title) + "</th>";
    if (const std::optional<Spread> spread = SpreadOf(figure, distribution.rows)) {
      const bool alike = spread->min == spread->max;
      html += Cell(figure, spread->min) + Cell(figure, spread->median) + Cell(figure, spread->max) +
              Cell(std::to_string(spread->runs)) +
              Cell(alike ? "all equal" : NameOf(distribution.rows[spread->worst].key, distribution));
    } else {
      html += "<td>-</td><td>-</td><td>-</td><td>0</td><td></td>";
    }
    html += "</tr>\n";
  }
  return html + "</table>\n";
}

std::string InitializationsText(const RunRow& row) {
  std::string text;
  for (const InitializationResult& start : row.initializations) {
    char line[160];
    std::snprintf(line, sizeof line, "frame %zu: %s%s (error %.1f cm of %.1f cm)", start.frame,
                  ToString(start.outcome), start.discarded ? ", discarded" : "", start.error_m * 100,
                  start.path_m * 100);
    text += (text.empty() ? "" : "; ") + std::string(line);
  }
  return text;
}

std::string RunTable(const RunDistribution& distribution) {
  std::string html = "<h3>Runs</h3><table><tr><th>run</th>";
  for (const Figure& figure : Figures()) html += "<th>" + EscapeHtml(figure.title) + "</th>";
  html += "<th>initializations</th></tr>\n";
  for (const RunRow& row : distribution.rows) {
    html += "<tr>" + Cell(NameOf(row.key, distribution));
    for (const Figure& figure : Figures()) html += Cell(figure, figure.value(row));
    html += Cell(InitializationsText(row)) + "</tr>\n";
  }
  return html + "</table>\n";
}

}  // namespace

std::string SortedPlot(const RunDistribution& distribution, const Figure& figure) {
  std::vector<double> values;
  for (const RunRow& row : distribution.rows) {
    if (const std::optional<double> value = figure.value(row)) values.push_back(*value * figure.factor);
  }
  if (values.empty()) return {};
  if (figure.more_is_better) {
    std::sort(values.begin(), values.end());
  } else {
    std::sort(values.begin(), values.end(), std::greater<>());
  }
  std::vector<SvgPlot::Point> points;
  for (const double value : values) points.push_back({static_cast<double>(points.size() + 1), value});
  SvgPlot plot(std::string(figure.title) + " of each run, sorted", "run, worst first",
               std::string(figure.title) + figure.unit);
  plot.SetHeight(200);
  plot.Include({0, 0});
  if (figure.factor == 100 && figure.more_is_better) plot.Include({0, 100});  // A ratio in percent.
  plot.AddStems(points, "#9db8d6", "");
  plot.AddDots(points, "#2b6cb0", "", 3);
  return plot.Finish();
}

std::string DistributionSection(const RunDistribution& distribution) {
  std::string html = "<section><h2>" + EscapeHtml(distribution.name) +
                     (distribution.engine.empty() ? "" : ", " + EscapeHtml(distribution.engine)) + "</h2>\n";
  html += "<p>" + std::to_string(distribution.rows.size()) + " runs: " + std::to_string(distribution.seeds) +
          " seeds, " + std::to_string(distribution.starts) + " starts.";
  if (!distribution.rows.empty()) {
    html += " Worst run: " +
            EscapeHtml(NameOf(distribution.rows[WorstRun(distribution.rows)].key, distribution)) + ".";
  }
  html += "</p>\n" + SpreadTable(distribution);
  constexpr std::size_t kPlotted =
      4;  // The remaining figures are counts, which are easier to read in the table.
  for (const Figure& figure : Figures().first(kPlotted)) html += SortedPlot(distribution, figure);
  return html + RunTable(distribution) + "</section>\n";
}

}  // namespace docent::app
