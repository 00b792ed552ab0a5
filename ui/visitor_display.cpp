// SPDX-License-Identifier: Apache-2.0
#include "ui/visitor_display.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>

#include "ui/figures.h"
#include "ui/label_board.h"
#include "ui/letterbox.h"
#include "ui/theme.h"
#include "ui/visitor_layout.h"

namespace docent::ui {

namespace {

constexpr Color kBoard = theme::kHeadsUp, kTitle = theme::kText;
constexpr double kLowestStop = 0.76;  // Ratio of the height; sentences are below.
constexpr Color kWay{1.0f, 0.84f, 0.45f, 1.0f};

struct CornerStyle {
  double size_px;
  bool bold;
  bool at_right;
};

// A line in the upper corner where lines begin, as the place, which stays while the visitor is there.
struct CornerLine {
  std::string text;
  TextStyle style;
  Eigen::AlignedBox2d board;
  Eigen::Vector2d corner = Eigen::Vector2d::Zero();  // Of the text.
};

CornerLine LineInCorner(const std::string& text, double top, const CornerStyle& look, double unit,
                        Canvas* canvas) {
  CornerLine line;
  line.text = text;
  line.style.size_px = look.size_px;
  line.style.bold = look.bold;
  // Beside a wide line is room for other things; above an image in an upright window is nothing else.
  const double share = canvas->width_px() > canvas->height_px() ? 0.6 : 0.9;
  line.style.max_width_px = std::max(40, static_cast<int>(share * canvas->width_px()));
  line.style.max_height_px = static_cast<int>(56 * unit);  // Two lines, as the end of a tour in German needs.
  line.style.color = kTitle;
  const Eigen::Vector2d size = canvas->Measure(text, line.style);
  const Eigen::Vector2d padding(12 * unit, 7 * unit);
  const double left =
      look.at_right ? canvas->width_px() - 1 - 10 * unit - size.x() - 2 * padding.x() : 10 * unit;
  const Eigen::Vector2d corner(left, top);
  line.board = {corner, corner + size + 2 * padding};
  line.corner = corner + padding;
  return line;
}

// The place and how far the tour has come, below each other.
std::vector<CornerLine> LinesInCorner(const VisitorDisplay& visitor, double unit, Canvas* canvas) {
  std::vector<CornerLine> lines;
  double top = 10 * unit;
  const auto add = [&](const std::string& text, const CornerStyle& look) {
    if (text.empty()) return;
    lines.push_back(LineInCorner(text, top, look, unit, canvas));
    top = lines.back().board.max().y() + 6 * unit;
  };
  add(visitor.place, {18 * unit, true, visitor.is_right_to_left});
  // The announcement of a place can be as wide as the image, and is not drawn over other words.
  if (visitor.arrival <= 0) add(visitor.route_line, {16 * unit, false, visitor.is_right_to_left});
  return lines;
}

// The name of a place in large letters, above what usually stands in the middle of the image. The texts of
// labels are not seen through its ground.
void DrawArrival(const std::string& place, double opacity, double unit, Canvas* canvas) {
  if (place.empty() || opacity <= 0) return;
  TextStyle style;
  style.size_px = 40 * unit;
  style.bold = true;
  style.centered = true;
  style.max_width_px = std::max(40, static_cast<int>(0.8 * canvas->width_px()));
  style.max_height_px = std::max(20, static_cast<int>(0.4 * canvas->height_px()));
  style.color = Faded(kTitle, opacity);
  const Eigen::Vector2d size = canvas->Measure(place, style), padding(24 * unit, 14 * unit);
  const Eigen::Vector2d middle(0.5 * (canvas->width_px() - 1), 0.2 * canvas->height_px());
  canvas->Box(middle - 0.5 * size - padding, middle + 0.5 * size + padding, 14 * unit,
              Faded(theme::kPanel, opacity));
  canvas->Text(place, style, {middle.x(), middle.y() - 0.5 * size.y()}, 0.5);
}

// The names that are listed: the known places of who is lost, or the stops of the tour on demand.
const std::vector<std::string>& ListedStops(const VisitorDisplay& visitor) {
  static const std::vector<std::string> kNone;
  if (!visitor.stops.empty()) return visitor.stops;
  return visitor.lists_route ? visitor.route_stops : kNone;
}

// The boards of the signposts in view, with a narrow margin.
std::vector<Eigen::AlignedBox2d> SignsInWindow(const View& view, const Letterbox& box, double unit) {
  const Eigen::Vector2d margin = Eigen::Vector2d::Constant(4 * unit);
  std::vector<Eigen::AlignedBox2d> signs;
  if (view.scene == nullptr || view.tracked == nullptr || !engine::HasPose(view.tracked->state)) return signs;
  for (const Eigen::AlignedBox2d& sign : SignBoards(*view.scene, *view.camera, view.tracked->camera_from_map))
    signs.emplace_back(box.WindowFromImage(sign.min()) - margin, box.WindowFromImage(sign.max()) + margin);
  return signs;
}

constexpr double kWayTail = 44, kWayHead = 16;  // Length of an arrow and half its width, in units.

double CommonArea(const Eigen::AlignedBox2d& a, const Eigen::AlignedBox2d& b) {
  const Eigen::AlignedBox2d both = a.intersection(b);
  return both.isEmpty() ? 0.0 : both.volume();
}

// An arrow at the edge of the image as it is drawn, in pixels of the canvas.
struct DrawnArrow {
  Eigen::Vector2d tip, tail;
  Eigen::AlignedBox2d box;  // Around it.
};

// Moved aside as far as it takes to cover no signpost, if the image has room for that.
DrawnArrow ArrowOf(const EdgeArrow& arrow, const Letterbox& box,
                   const std::vector<Eigen::AlignedBox2d>& signs, double unit) {
  constexpr double kStep = 6, kFarthest = 180;  // Units; a signpost is seldom higher in the image.
  const Eigen::Vector2d ahead = arrow.direction, aside(-ahead.y(), ahead.x());
  const Eigen::AlignedBox2d image(Eigen::Vector2d(box.x, box.y),
                                  Eigen::Vector2d(box.x + box.width - 1, box.y + box.height - 1));
  const auto at = [&](double shift) {
    DrawnArrow drawn;
    drawn.tip = box.WindowFromImage(arrow.tip) + shift * aside;
    drawn.tail = drawn.tip - kWayTail * unit * ahead;
    const Eigen::Vector2d head = kWayHead * unit * aside.cwiseAbs();
    drawn.box = {drawn.tip.cwiseMin(drawn.tail) - head, drawn.tip.cwiseMax(drawn.tail) + head};
    return drawn;
  };
  const auto is_free = [&](const DrawnArrow& drawn) {
    return std::none_of(signs.begin(), signs.end(),
                        [&](const Eigen::AlignedBox2d& sign) { return CommonArea(drawn.box, sign) > 0; });
  };
  const DrawnArrow wanted = at(0);
  if (is_free(wanted)) return wanted;
  for (double shift = kStep; shift <= kFarthest; shift += kStep) {
    for (const double side : {-1.0, 1.0}) {
      const DrawnArrow moved = at(side * shift * unit);
      if (image.contains(moved.box) && is_free(moved)) return moved;
    }
  }
  return wanted;
}

// The text of an arrow at the edge of the image.
struct WayLabel {
  TextStyle style;
  Eigen::AlignedBox2d board;
  Eigen::Vector2d corner = Eigen::Vector2d::Zero();  // Of the text.
};

// Behind the arrow, to one of its sides, or above or below a signpost: where it covers the least of signposts
// and of the arrow, inside the window.
WayLabel LabelOf(const WayOn& way, const DrawnArrow& arrow, const std::vector<Eigen::AlignedBox2d>& signs,
                 double unit, Canvas* canvas) {
  const Eigen::Vector2d ahead = way.arrow.direction, aside(-ahead.y(), ahead.x());
  WayLabel label;
  label.style.size_px = 18 * unit;
  label.style.max_width_px = std::max(40, static_cast<int>(0.4 * canvas->width_px()));
  label.style.max_height_px = static_cast<int>(60 * unit);
  label.style.color = kTitle;
  const Eigen::Vector2d size = canvas->Measure(way.text, label.style), padding(10 * unit, 5 * unit);
  const Eigen::Vector2d half = 0.5 * size + padding;
  const Eigen::Vector2d last(canvas->width_px() - 1, canvas->height_px() - 1);
  const auto at = [&](const Eigen::Vector2d& wanted) {
    const Eigen::Vector2d middle = wanted.cwiseMin(last - half).cwiseMax(half);
    return Eigen::AlignedBox2d(middle - half, middle + half);
  };
  const double gap = 10 * unit;
  const Eigen::Vector2d behind = arrow.tail - (gap + half.cwiseProduct(ahead).norm()) * ahead;
  const double reach = gap + kWayHead * unit + half.cwiseProduct(aside).norm();
  std::vector<Eigen::AlignedBox2d> places = {at(behind), at(arrow.box.center() - reach * aside),
                                             at(arrow.box.center() + reach * aside)};
  for (const Eigen::AlignedBox2d& sign : signs) {
    places.push_back(at({behind.x(), sign.min().y() - gap - half.y()}));
    places.push_back(at({behind.x(), sign.max().y() + gap + half.y()}));
  }
  double least = std::numeric_limits<double>::infinity();
  for (const Eigen::AlignedBox2d& place : places) {
    double covered = CommonArea(place, arrow.box);
    for (const Eigen::AlignedBox2d& sign : signs) covered += CommonArea(place, sign);
    if (covered >= least) continue;
    least = covered;
    label.board = place;
  }
  label.corner = label.board.center() - 0.5 * size;
  return label;
}

// An arrow at the edge of the image, and its text beside it.
struct DrawnWay {
  DrawnArrow arrow;
  std::optional<WayLabel> label;
};

// Empty where the visitor is led nowhere, or reads a list or a menu, behind which an arrow would be seen in
// part.
std::optional<DrawnWay> WayIn(const View& view, double unit, Canvas* canvas) {
  const VisitorDisplay& visitor = *view.overlay.visitor;
  if (!visitor.way_on || view.camera == nullptr || !visitor.menu.empty() || !ListedStops(visitor).empty())
    return std::nullopt;
  const Letterbox box =
      FitImage(view.camera->width_px(), view.camera->height_px(), canvas->width_px(), canvas->height_px());
  const std::vector<Eigen::AlignedBox2d> signs = SignsInWindow(view, box, unit);
  DrawnWay way{ArrowOf(visitor.way_on->arrow, box, signs, unit), std::nullopt};
  if (!visitor.way_on->text.empty()) way.label = LabelOf(*visitor.way_on, way.arrow, signs, unit, canvas);
  return way;
}

void DrawWayOn(const View& view, double unit, Canvas* canvas) {
  const std::optional<DrawnWay> way = WayIn(view, unit, canvas);
  if (!way) return;
  const WayOn& told = *view.overlay.visitor->way_on;
  const Eigen::Vector2d ahead = told.arrow.direction, aside(-ahead.y(), ahead.x()), tip = way->arrow.tip;
  for (const auto& [width, color] : {std::pair(12 * unit, kBoard), std::pair(7 * unit, kWay)}) {
    canvas->Line(way->arrow.tail, tip, width, color);
    for (const double side : {-1.0, 1.0})
      canvas->Line(tip, tip - 18 * unit * ahead + side * kWayHead * unit * aside, width, color);
  }
  if (!way->label) return;
  canvas->Box(way->label->board.min(), way->label->board.max(), 8 * unit, kBoard);
  canvas->Text(told.text, way->label->style, way->label->corner);
}

// Corners around what the one button opens.
void DrawMark(const CardTarget& target, const engine::CameraModel& camera, double unit, Canvas* canvas) {
  const Letterbox box =
      FitImage(camera.width_px(), camera.height_px(), canvas->width_px(), canvas->height_px());
  const Eigen::Vector2d margin = Eigen::Vector2d::Constant(5 * unit);
  const Eigen::Vector2d last(canvas->width_px() - 1, canvas->height_px() - 1);
  const Eigen::Vector2d low = (box.WindowFromImage(target.low) - margin).cwiseMax(margin),
                        high = (box.WindowFromImage(target.high) + margin).cwiseMin(last - margin);
  const Eigen::Vector2d leg = (0.25 * (high - low)).cwiseMin(22 * unit).cwiseMax(6 * unit);
  for (const auto& [width, color] : {std::pair(5 * unit, kBoard), std::pair(2.5 * unit, kWay)}) {
    for (const Eigen::Vector2d& side :
         {Eigen::Vector2d(1, 1), Eigen::Vector2d(-1, 1), Eigen::Vector2d(1, -1), Eigen::Vector2d(-1, -1)}) {
      const Eigen::Vector2d corner(side.x() > 0 ? low.x() : high.x(), side.y() > 0 ? low.y() : high.y());
      canvas->Line(corner, corner + Eigen::Vector2d(side.x() * leg.x(), 0), width, color);
      canvas->Line(corner, corner + Eigen::Vector2d(0, side.y() * leg.y()), width, color);
    }
  }
}

// The ground of the choices of an open menu; empty while it is closed.
Eigen::AlignedBox2d MenuPanel(const MenuLayout& layout, double unit) {
  if (layout.choices.empty()) return {};
  const Area &first = layout.choices.front(), &last = layout.choices.back();
  const double margin = 12 * unit;
  return {Eigen::Vector2d(first.x - margin, first.y - margin),
          Eigen::Vector2d(last.right() + margin, last.bottom() + margin)};
}

// The button of the menu, and its choices while it is open.
void DrawMenu(const VisitorDisplay& visitor, const HeadsUpStyle& style, Canvas* canvas) {
  const MenuLayout layout = LayOutMenu(visitor, canvas->width_px(), canvas->height_px(), style);
  const double unit = style.unit_px;
  const Area& button = layout.button;
  if (button.width > 0 && layout.choices.empty()) {
    canvas->Box({button.x, button.y}, {button.right(), button.bottom()}, 8 * unit, kBoard);
    for (const double share : {0.32, 0.5, 0.68})
      canvas->Line({button.x + 0.28 * button.width, button.y + share * button.height},
                   {button.x + 0.72 * button.width, button.y + share * button.height}, 2.5 * unit, kTitle);
  }
  if (!layout.choices.empty()) {
    // What is behind the choices would be read between them.
    const Eigen::AlignedBox2d panel = MenuPanel(layout, unit);
    canvas->Box(panel.min(), panel.max(), 16 * unit, theme::kPanel);
  }
  for (std::size_t i = 0; i < layout.choices.size(); ++i) {
    const Area& area = layout.choices[i];
    canvas->Box({area.x, area.y}, {area.right(), area.bottom()}, 10 * unit,
                i == visitor.chosen ? theme::kButton : theme::kPanel);
    canvas->Box({area.x, area.y}, {area.right(), area.bottom()}, 10 * unit,
                i == visitor.chosen ? kWay : theme::kBorder, 2 * unit);
    TextStyle text;
    text.size_px = 20 * unit;
    text.max_width_px = std::max(40, static_cast<int>(area.width - 20 * unit));
    text.max_height_px = std::max(20, static_cast<int>(area.height));
    text.color = kTitle;
    const double height = canvas->Measure(visitor.menu[i], text).y();
    canvas->Text(visitor.menu[i], text, {area.x + 0.5 * area.width, area.y + 0.5 * (area.height - height)},
                 0.5);
  }
}

// Names below each other above the sentences, at least as low as `highest`. The last line says if some do not
// fit.
void DrawStops(const std::vector<std::string>& stops, double highest, bool at_right, double unit,
               Canvas* canvas) {
  if (stops.empty()) return;
  TextStyle style;
  style.size_px = 20 * unit;
  style.max_width_px = std::max(40, static_cast<int>(0.7 * canvas->width_px()));
  style.max_height_px = static_cast<int>(34 * unit);
  style.color = kTitle;
  const double line = 30 * unit, top = std::max(0.12 * canvas->height_px(), highest + 10 * unit);
  const auto most = static_cast<std::size_t>(std::max(1.0, (kLowestStop * canvas->height_px() - top) / line));
  std::vector<std::string> lines(stops.begin(), stops.begin() + std::min(most, stops.size()));
  if (stops.size() > most) lines.back() = "…";
  double width = 0;
  for (const std::string& text : lines) width = std::max(width, canvas->Measure(text, style).x());
  const double left = 0.5 * (canvas->width_px() - 1 - width),
               height = line * static_cast<double>(lines.size());
  canvas->Box({left - 18 * unit, top - 10 * unit}, {left + width + 18 * unit, top + height + 6 * unit},
              12 * unit, theme::kPanel);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const double indent = at_right ? width - canvas->Measure(lines[i], style).x() : 0;
    canvas->Text(lines[i], style, {left + indent, top + line * static_cast<double>(i)});
  }
}

// The names of the places below their images.
void DrawNamesOfViews(const VisitorDisplay& visitor, const engine::CameraModel& camera, double unit,
                      Canvas* canvas) {
  const Letterbox box =
      FitImage(camera.width_px(), camera.height_px(), canvas->width_px(), canvas->height_px());
  const std::vector<Inset> areas = PlaceViews(visitor, camera.width_px(), camera.height_px());
  for (std::size_t i = 0; i < areas.size(); ++i) {
    if (visitor.views[i].name.empty()) continue;
    const Eigen::Vector2d below =
        box.WindowFromImage({areas[i].x + 0.5 * (areas[i].width - 1), areas[i].y + areas[i].height + 0.0});
    const Eigen::Vector2d padding(8 * unit, 3 * unit);
    TextStyle style;
    style.size_px = 16 * unit;
    style.centered = true;
    style.max_width_px = std::max(40, static_cast<int>(box.scale * areas[i].width - 2 * padding.x()));
    style.max_height_px = static_cast<int>(56 * unit);
    style.color = kTitle;
    const Eigen::Vector2d size = canvas->Measure(visitor.views[i].name, style);
    const Eigen::Vector2d corner(below.x() - 0.5 * size.x() - padding.x(), below.y() + 4 * unit);
    canvas->Box(corner, corner + size + 2 * padding, 6 * unit, kBoard);
    canvas->Text(visitor.views[i].name, style, {below.x(), corner.y() + padding.y()}, 0.5);
  }
}

}  // namespace

std::vector<Inset> PlaceViews(const VisitorDisplay& visitor, int width_px, int height_px) {
  constexpr double kWidth = 0.27, kGap = 0.03, kTop = 0.14;  // Ratios of the image's width or height.
  std::vector<Inset> areas;
  const auto count = static_cast<double>(visitor.views.size());
  double left = 0.5 * (1 - count * kWidth - (count - 1) * kGap);
  for (const KnownView& known : visitor.views) {
    const cv::Mat& view = known.image;
    Inset area;
    area.x = std::max(0, static_cast<int>(left * width_px));
    area.y = static_cast<int>(kTop * height_px);
    area.width = std::max(1, static_cast<int>(kWidth * width_px));
    area.height = std::clamp(area.width * view.rows / std::max(1, view.cols), 1, height_px / 2);
    areas.push_back(area);
    left += kWidth + kGap;
  }
  return areas;
}

std::vector<Eigen::AlignedBox2d> TakenByVisitorDisplay(const View& view, const HeadsUpStyle& style,
                                                       Canvas* canvas) {
  const VisitorDisplay& visitor = *view.overlay.visitor;
  const double unit = style.unit_px;
  std::vector<Eigen::AlignedBox2d> taken;
  for (const CornerLine& line : LinesInCorner(visitor, unit, canvas)) taken.push_back(line.board);
  const MenuLayout menu = LayOutMenu(visitor, canvas->width_px(), canvas->height_px(), style);
  const Area& button = menu.button;
  if (const Eigen::AlignedBox2d panel = MenuPanel(menu, unit); !panel.isEmpty()) taken.push_back(panel);
  if (button.width > 0)
    taken.emplace_back(Eigen::Vector2d(button.x, button.y), Eigen::Vector2d(button.right(), button.bottom()));
  if (const std::optional<DrawnWay> way = WayIn(view, unit, canvas)) {
    taken.push_back(way->arrow.box);
    if (way->label) taken.push_back(way->label->board);
  }
  double bottom = canvas->height_px() - 12 * unit - style.bottom_px;
  for (const auto& [text, units] : {std::pair(&view.overlay.message, 15.0), {&visitor.sentence, 20.0}}) {
    const Eigen::AlignedBox2d panel = SentencePanel(*text, units, bottom, unit, canvas);
    if (panel.isEmpty()) continue;
    taken.push_back(panel);
    bottom = panel.min().y() - 6 * unit;
  }
  return taken;
}

void DrawVisitorDisplay(const View& view, const HeadsUpStyle& style, Canvas* canvas) {
  const VisitorDisplay& visitor = *view.overlay.visitor;
  const double unit = style.unit_px;
  const double lowest = canvas->height_px() - 12 * unit - style.bottom_px;
  const std::vector<std::string>& listed = ListedStops(visitor);
  if (visitor.is_searching && listed.empty()) {
    const double radius = 0.1 * std::min(canvas->width_px(), canvas->height_px());
    const Eigen::Vector2d middle(0.5 * (canvas->width_px() - 1),
                                 (visitor.views.empty() ? 0.5 : 0.66) * canvas->height_px());
    DrawSearchFigure(middle, radius, view.animation_seconds, canvas);
  }
  if (view.camera != nullptr) DrawNamesOfViews(visitor, *view.camera, unit, canvas);
  if (visitor.menu.empty() && visitor.marked && *visitor.marked < visitor.targets.size() &&
      view.camera != nullptr)
    DrawMark(visitor.targets[*visitor.marked], *view.camera, unit, canvas);
  if (visitor.dwell) {
    const Eigen::Vector2d middle(0.5 * (canvas->width_px() - 1), 0.5 * (canvas->height_px() - 1));
    DrawProgressRing(middle, 16 * unit, *visitor.dwell, canvas);
  }
  DrawWayOn(view, unit, canvas);
  double below = 10 * unit;
  for (const CornerLine& line : LinesInCorner(visitor, unit, canvas)) {
    canvas->Box(line.board.min(), line.board.max(), 9 * unit, kBoard);
    canvas->Text(line.text, line.style, line.corner);
    below = line.board.max().y() + 6 * unit;
  }
  DrawStops(listed, below, visitor.is_right_to_left, unit, canvas);
  if (listed.empty() && visitor.menu.empty()) DrawArrival(visitor.place, visitor.arrival, unit, canvas);
  const double bottom = DrawSentence(view.overlay.message, 15, lowest, unit, canvas) - 6 * unit;
  DrawSentence(visitor.sentence, 20, bottom, unit, canvas);
  DrawMenu(visitor, style, canvas);
}

}  // namespace docent::ui
