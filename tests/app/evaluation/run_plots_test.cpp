// SPDX-License-Identifier: Apache-2.0
#include "app/evaluation/run_plots.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <regex>
#include <string>
#include <vector>

#include "app/evaluation/html_report.h"
#include "app/evaluation/json_report.h"
#include "app/evaluation/svg_plot.h"
#include "app/files/text_file.h"

namespace docent::app {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

// The first error of a piece of XML, or empty: tags must nest, attributes must be quoted, and special
// characters must be escaped.
std::string XmlErrorOf(const std::string& xml) {
  static const std::regex tag(R"(^<(/?)([a-zA-Z][a-zA-Z0-9]*)((?:\s+[a-zA-Z:-]+="[^"<]*")*)\s*(/?)>)");
  static const std::regex entity(R"(^&(amp|lt|gt|quot|#39);)");
  std::vector<std::string> open;
  for (std::size_t i = 0; i < xml.size();) {
    const auto from = xml.begin() + static_cast<std::ptrdiff_t>(i);
    const std::string around = xml.substr(i, 60);
    std::smatch match;
    if (xml[i] == '<') {
      if (!std::regex_search(from, xml.end(), match, tag)) return "not a tag: " + around;
      if (match[1].length() > 0) {
        if (open.empty() || open.back() != match[2]) return "unmatched closing tag: " + around;
        open.pop_back();
      } else if (match[4].length() == 0) {
        open.push_back(match[2]);
      }
      i += static_cast<std::size_t>(match[0].length());
    } else if (xml[i] == '&') {
      if (!std::regex_search(from, xml.end(), match, entity)) return "unescaped &: " + around;
      i += static_cast<std::size_t>(match[0].length());
    } else {
      ++i;
    }
  }
  return open.empty() ? std::string() : "not closed: " + open.back();
}

int Count(const std::string& text, const std::string& part) {
  int count = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + part.size())) ++count;
  return count;
}

// The centres of the circles of one colour.
std::vector<SvgPlot::Point> Circles(const std::string& svg, const std::string& color) {
  const auto begin = svg.find("<g fill=\"" + color + "\">");
  if (begin == std::string::npos) return {};
  const std::string group = svg.substr(begin, svg.find("</g>", begin) - begin);
  static const std::regex circle(R"re(<circle cx="([^"]*)" cy="([^"]*)")re");
  std::vector<SvgPlot::Point> circles;
  for (auto it = std::sregex_iterator(group.begin(), group.end(), circle); it != std::sregex_iterator(); ++it)
    circles.push_back({std::stod((*it)[1]), std::stod((*it)[2])});
  return circles;
}

// A made-up run of a hundred frames: the map grows, and the mapper works at frames 20 and 60.
EvaluatedRun MadeUpRun(const std::string& engine, int keyframes) {
  EvaluatedRun evaluated;
  RunRecord& run = evaluated.run;
  run.name = "walk <1> & \"2\"";
  run.engine = engine;
  for (int i = 0; i < 100; ++i) {
    FrameRecord frame;
    frame.time = Timestamp(i * 33'000'000LL);
    frame.state = i < 5 ? engine::TrackingState::kInitializing : engine::TrackingState::kSixDof;
    frame.map_key = 1;
    frame.camera_from_map.translation.x() = -0.01 * i;
    frame.map_keyframes = {keyframes * i / 99, 3, 2};
    frame.map_points = {10 * i, 100, i};
    frame.tracking_ms = 3;
    frame.mapping.bundle_adjustment_s = i < 20 ? 0 : i < 60 ? 0.05 : 0.08;
    frame.mapping.panorama_localization_s = i < 60 ? 0 : 0.02;
    run.frames.push_back(frame);
    evaluated.truth.push_back({frame.time, {engine::Rotation3(), {0.01 * i, 0.001 * i * i, 0}}});
  }
  MapRecord map;
  map.key = 1;
  map.name = "map";
  for (int i = 0; i < 30; ++i) {
    map.positions.push_back({0.1 * i, 0.05 * (i % 7), 2});
    map.converted.push_back(i % 3 == 0);
  }
  map.sixdof_centers = {{0, 0, 0}, {1, 0, 0}, {0, 0, 1}};
  map.localized_centers = {{0.5, 0, 0}};
  map.panorama_centers = {{0.5, 0, 0}, {0, 0, 1}};
  run.maps.push_back(map);
  evaluated.report = EvaluateRun(run, evaluated.truth, {});
  return evaluated;
}

TEST(RunPlots, AreWellFormedXml) {
  const EvaluatedRun run = MadeUpRun("hybrid", 40);
  const PlotRanges ranges = RangesOf(run);
  MapRecord map = run.run.maps[0];
  map.name = "Desk & \"3\" <b>";
  for (const std::string& svg :
       {StatePlot(run), KeyFramePlot(run, ranges), PointPlot(run, ranges), FinitePointPlot(run, ranges),
        MappingPlot(run, ranges), TrackingTimePlot(run, ranges), ErrorPlots(run), PointViewPlot(run, map),
        PlaceViewPlot(run, map), AlignedTrajectoryPlot(run)}) {
    EXPECT_THAT(svg, HasSubstr("<svg "));
    EXPECT_THAT(XmlErrorOf(svg), IsEmpty());
    EXPECT_THAT(svg, Not(HasSubstr("nan")));
    EXPECT_THAT(svg, Not(HasSubstr("inf\"")));
  }
  // The checker itself must detect errors.
  for (const char* wrong : {"<svg><g></svg>", "<svg a=b/>", "<svg>a & b</svg>", "<svg>", "<svg x=\"<\"/>"})
    EXPECT_THAT(XmlErrorOf(wrong), Not(IsEmpty())) << wrong;
}

TEST(RunPlots, UseTheSameRangesForBothEngines) {
  const EvaluatedRun few = MadeUpRun("sixdof", 10), many = MadeUpRun("hybrid", 400);
  EXPECT_THAT(KeyFramePlot(few, RangesOf(few)), Not(HasSubstr(">400<")));
  EXPECT_THAT(KeyFramePlot(few, Both(RangesOf(few), RangesOf(many))), HasSubstr(">400<"));
  EXPECT_THAT(KeyFramePlot(many, RangesOf(many)), HasSubstr(">400<"));
}

TEST(RunPlots, ShowMappingTimeAtItsFrames) {
  const EvaluatedRun run = MadeUpRun("hybrid", 40);
  const PlotRanges ranges = RangesOf(run);
  EXPECT_NEAR(ranges.mapping_ms, 50, 1e-9);
  const std::string svg = MappingPlot(run, ranges);
  // One line for each task and frame with mapping time.
  const auto lines_of = [&svg](const std::string& color) {
    const std::regex path("stroke=\"" + color + "\" stroke-width=\"1.3\" d=\"([^\"]*)\"");
    std::smatch match;
    return std::regex_search(svg, match, path) ? match[1].str() : std::string();
  };
  const std::string adjustment = lines_of("#2c8a4b"), localization = lines_of("#4a90c2");
  EXPECT_EQ(Count(adjustment, "V"), 2);
  EXPECT_EQ(Count(localization, "V"), 1);
  EXPECT_EQ(lines_of("#8e44ad"), "") << "nothing was triangulated";
  // The 99 intervals span 824 pixels, starting at 64.
  const auto at = [](int frame) {
    return "M" + FormatNumber(std::round((64 + 824.0 * frame / 99) * 10) / 10, 7);
  };
  EXPECT_THAT(adjustment, AllOf(StartsWith(at(20)), HasSubstr(at(60))));
  EXPECT_THAT(localization, StartsWith(at(60)));
}

TEST(RunPlots, MarkConvertedInfinitePoints) {
  const EvaluatedRun run = MadeUpRun("hybrid", 40);
  const std::string svg = PointViewPlot(run, run.run.maps[0]);
  EXPECT_EQ(Circles(svg, "#8e44ad").size(), 10u);
  EXPECT_EQ(Circles(svg, "#333333").size(), 20u);
}

TEST(RunPlots, OmitDistantPointsThatWouldShrinkTheRest) {
  EvaluatedRun run = MadeUpRun("hybrid", 40);
  MapRecord& map = run.run.maps[0];
  map.positions.push_back({5000, 0, 2});
  map.converted.push_back(false);
  const std::string svg = PointViewPlot(run, map);
  EXPECT_EQ(Circles(svg, "#333333").size(), 20u);
  EXPECT_THAT(svg, HasSubstr("(1 further points not shown)"));
}

TEST(RunPlots, ShowTheMapFromAboveWithTheForwardDirectionUp) {
  const EvaluatedRun run = MadeUpRun("hybrid", 40);
  const std::string svg = PlaceViewPlot(run, run.run.maps[0]);
  // The centres are the origin, one to the right and one ahead. The map's y axis points down, as in a camera
  // frame.
  const auto centers = Circles(svg, "#2c8a4b");
  ASSERT_EQ(centers.size(), 3u);
  EXPECT_GT(centers[1].x, centers[0].x + 10);
  EXPECT_NEAR(centers[1].y, centers[0].y, 0.2);
  EXPECT_LT(centers[2].y, centers[0].y - 10);
  EXPECT_NEAR(centers[2].x, centers[0].x, 0.2);
  EXPECT_EQ(Circles(svg, "#f2b134").size(), 1u);
  const auto panoramas = Circles(svg, "rgba(74,144,194,0.35)");
  ASSERT_EQ(panoramas.size(), 2u);
  EXPECT_NEAR(panoramas[1].x, centers[2].x, 0.2);
  EXPECT_NEAR(panoramas[1].y, centers[2].y, 0.2);
}

TEST(ComparedReport, ShowsEveryPlotOfBothEngines) {
  EvaluatedRun run = MadeUpRun("hybrid", 40);
  run.compared = std::make_shared<EvaluatedRun>(MadeUpRun("sixdof", 10));
  const std::string html = FormatHtmlReport({run});
  for (const char* title :
       {">Tracking by state<", ">Keyframes of the current map<", ">Points of the current map and ",
        ">Finite points of the current map", ">Mapping time<", ">Points of the map ",
        ">Trajectory and keyframes in the map "}) {
    EXPECT_EQ(Count(html, title), 2) << title;
  }
  EXPECT_EQ(Count(html, "<h4>hybrid</h4>"), Count(html, "<h4>sixdof</h4>"));
  EXPECT_GT(Count(html, "<h4>hybrid</h4>"), 6);
  for (auto at = html.find("<svg "); at != std::string::npos; at = html.find("<svg ", at + 1))
    EXPECT_THAT(XmlErrorOf(html.substr(at, html.find("</svg>", at) + 6 - at)), IsEmpty());
  run.compared.reset();
  EXPECT_EQ(Count(FormatHtmlReport({run}), ">Mapping time<"), 1);
}

TEST(ComparedReport, SequencesContainTheRequestedEngineOnly) {
  const auto hybrid = MadeUpRun("hybrid", 40).report, sixdof = MadeUpRun("sixdof", 10).report;
  const auto json = nlohmann::json::parse(FormatJsonReport({hybrid}, {sixdof}));
  ASSERT_EQ(json.at("sequences").size(), 1u);
  EXPECT_EQ(json.at("sequences").at(0).at("engine"), "hybrid");
  ASSERT_EQ(json.at("compared").size(), 1u);
  EXPECT_EQ(json.at("compared").at(0).at("engine"), "sixdof");
  EXPECT_FALSE(nlohmann::json::parse(FormatJsonReport({hybrid})).contains("compared"));
}

TEST(ComparedReport, EmbedsItsPanoramas) {
  EvaluatedRun run = MadeUpRun("hybrid", 40);
  // The test vectors of RFC 4648; the bytes need not be a valid image.
  const auto bytes = [](const std::string& text) {
    return std::vector<std::uint8_t>(text.begin(), text.end());
  };
  run.panoramas = {
      {"one <&>", bytes("foobar")}, {"two", bytes("fooba")}, {"three", bytes("foob")}, {"four", {0xff}}};
  const std::string html = FormatHtmlReport({run});
  for (const char* data : {"Zm9vYmFy\"", "Zm9vYmE=\"", "Zm9vYg==\"", "/w==\""})
    EXPECT_THAT(html, HasSubstr(std::string("src=\"data:image/png;base64,") + data));
  EXPECT_EQ(Count(html, "src="), Count(html, "src=\"data:"));
  EXPECT_THAT(html, HasSubstr("one &lt;&amp;&gt;</figcaption>"));
}

TEST(MapRecords, ContainTheCentresOfKeyframesAndPanoramas) {
  engine::MapSnapshot map;
  const auto add = [&](engine::KeyFrameKind kind, engine::PanoramaId panorama,
                       const Eigen::Vector3d& center) {
    engine::KeyFrame keyframe;
    keyframe.id = static_cast<engine::KeyFrameId>(map.keyframes.size());
    keyframe.kind = kind;
    keyframe.panorama = panorama;
    keyframe.camera = std::make_shared<engine::CameraModel>(
        engine::CameraModel::WithReadout(std::make_shared<engine::CameraModel>(), {{0, 1, 0}, {0, 0.02}}));
    keyframe.camera_from_map = engine::Rigid3(engine::Rotation3(), -center);
    map.keyframes.push_back(keyframe);
  };
  add(engine::KeyFrameKind::kSixDof, engine::kNoId, {0, 0, 0});
  add(engine::KeyFrameKind::kSixDof, 4, {1, 0, 0});
  add(engine::KeyFrameKind::kPanorama, 4, {1, 0, 0});
  map.panoramas = {{4, 1}};
  for (const bool was_infinite : {false, true}) {
    engine::MapPoint point;
    point.point_in_map = {0, 0, was_infinite ? 5.0 : 2.0, 1};
    point.was_infinite = was_infinite;
    map.points.push_back(point);
  }
  map.points.push_back({});
  map.points.back().point_in_map = {0, 0, 1, 0};
  const MapRecord record = MakeMapRecord(3, "Hall", map);
  EXPECT_EQ(record.keyframes, (KeyFrameCounts{1, 1, 1}));
  EXPECT_EQ(record.points, (PointCounts{2, 1, 1}));
  EXPECT_EQ(record.readout_s, Eigen::Vector2d(0, 0.02));
  ASSERT_EQ(record.positions.size(), 2u);
  EXPECT_EQ(record.converted, (std::vector<bool>{false, true}));
  using Places = std::vector<Eigen::Vector3d>;
  EXPECT_EQ(record.sixdof_centers, (Places{{0, 0, 0}}));
  EXPECT_EQ(record.localized_centers, (Places{{1, 0, 0}}));
  EXPECT_EQ(record.panorama_centers, (Places{{1, 0, 0}}));
  EXPECT_LT((record.up + Eigen::Vector3d::UnitY()).norm(), 1e-9);
  EXPECT_LT((record.forward - Eigen::Vector3d::UnitZ()).norm(), 1e-9);
}

}  // namespace
}  // namespace docent::app
