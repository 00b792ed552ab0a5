// SPDX-License-Identifier: Apache-2.0
#include "app/calibration/board.h"

#include <cairo/cairo-pdf.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <opencv2/aruco/charuco.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "app/calibration/corner_refinement.h"
#include "app/files/text_file.h"
#include "engine/base/error.h"

namespace docent::app {

namespace {

constexpr double kMarkerRatio = 0.74;  // Marker side over square side.
constexpr int kMarkerCells = 5 + 2;    // Five data cells and the black border.

cv::Ptr<cv::aruco::Dictionary> Markers() {
  return cv::aruco::getPredefinedDictionary(cv::aruco::DICT_5X5_250);
}

cv::Ptr<cv::aruco::CharucoBoard> CharucoOf(const BoardSpec& board) {
  const auto side = static_cast<float>(board.square_m);
  return cv::aruco::CharucoBoard::create(board.columns, board.rows, side,
                                         static_cast<float>(kMarkerRatio) * side, Markers());
}

// The y axis of OpenCV's ChArUco boards points up, that of the board frame down.
double Flipped(const BoardSpec& board, double y) {
  return board.rows * board.square_m - y;
}

void AddMarker(const BoardSpec& board, const std::vector<cv::Point3f>& corners, int id,
               std::vector<InkRectangle>* ink) {
  double left = corners[0].x, top = Flipped(board, corners[0].y);
  for (const cv::Point3f& corner : corners) {
    left = std::min<double>(left, corner.x);
    top = std::min(top, Flipped(board, corner.y));
  }
  const double cell = kMarkerRatio * board.square_m / kMarkerCells;
  cv::Mat bits;
  Markers()->drawMarker(id, kMarkerCells, bits, 1);
  for (int row = 0; row < kMarkerCells; ++row) {
    // Adjacent cells of a row become one rectangle, so that no seam between them is printed.
    for (int begin = 0; begin < kMarkerCells;) {
      int end = begin;
      while (end < kMarkerCells && bits.at<uchar>(row, end) == 0) ++end;
      if (end > begin) ink->push_back({left + begin * cell, top + row * cell, (end - begin) * cell, cell});
      begin = std::max(end, begin + 1);
    }
  }
}

struct DestroySurface {
  void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
};
struct DestroyContext {
  void operator()(cairo_t* context) const { cairo_destroy(context); }
};

}  // namespace

BoardSpec ParseBoard(const std::string& text) {
  const auto fail = [&]() -> BoardSpec {
    throw Error("'" + text +
                "' is not a calibration board; use checkerboard:9x6:25 (inner corners, square size in "
                "millimetres) or "
                "charuco:8x6:30 (squares, square size in millimetres).");
  };
  const std::string_view whole = text;
  const std::size_t first = whole.find(':'), second = whole.rfind(':');
  if (first == std::string_view::npos || second == first) return fail();
  BoardSpec board;
  const std::string_view kind = whole.substr(0, first);
  if (kind == "charuco") {
    board.kind = BoardSpec::Kind::kCharuco;
  } else if (kind != "checkerboard") {
    return fail();
  }
  const std::string_view size = whole.substr(first + 1, second - first - 1);
  const std::size_t cross = size.find('x');
  if (cross == std::string_view::npos) return fail();
  const auto columns = ParseInteger(size.substr(0, cross)), rows = ParseInteger(size.substr(cross + 1));
  const auto square_mm = ParseNumber(whole.substr(second + 1));
  if (!columns || !rows || !square_mm) return fail();
  // A larger ChArUco board needs more markers than the dictionary has (250).
  if (*columns < 3 || *rows < 3 || *columns > 22 || *rows > 22) return fail();
  if (!(*square_mm >= 1 && *square_mm <= 1000)) return fail();
  board.columns = static_cast<int>(*columns);
  board.rows = static_cast<int>(*rows);
  board.square_m = *square_mm / 1000;
  return board;
}

std::string FormatBoard(const BoardSpec& board) {
  return std::string(board.kind == BoardSpec::Kind::kCharuco ? "charuco:" : "checkerboard:") +
         std::to_string(board.columns) + "x" + std::to_string(board.rows) + ":" +
         FormatNumber(board.square_m * 1000, 6);
}

Eigen::Vector2d SheetSize(const BoardSpec& board) {
  return board.square_m * Eigen::Vector2d(board.SquareColumns(), board.SquareRows());
}

std::vector<InkRectangle> InkOf(const BoardSpec& board) {
  std::vector<InkRectangle> ink;
  const double side = board.square_m;
  std::vector<std::vector<bool>> has_marker(board.SquareRows(),
                                            std::vector<bool>(board.SquareColumns(), false));
  if (board.kind == BoardSpec::Kind::kCharuco) {
    const auto charuco = CharucoOf(board);
    for (std::size_t i = 0; i < charuco->ids.size(); ++i) {
      const auto& corners = charuco->objPoints[i];
      const double x = (corners[0].x + corners[2].x) / 2,
                   y = Flipped(board, (corners[0].y + corners[2].y) / 2.0);
      has_marker[static_cast<std::size_t>(y / side)][static_cast<std::size_t>(x / side)] = true;
      AddMarker(board, corners, charuco->ids[i], &ink);
    }
  }
  for (int row = 0; row < board.SquareRows(); ++row) {
    for (int column = 0; column < board.SquareColumns(); ++column) {
      const bool black =
          board.kind == BoardSpec::Kind::kCharuco ? !has_marker[row][column] : (row + column) % 2 == 0;
      if (black) ink.push_back({column * side, row * side, side, side});
    }
  }
  return ink;
}

cv::Mat PaintBoard(const BoardSpec& board, int pixels_per_square) {
  // The edges of marker cells do not fall on whole pixels, so the board is drawn four times finer and
  // averaged.
  constexpr int kFiner = 4;
  const double scale = kFiner * pixels_per_square / board.square_m;
  const Eigen::Vector2d size = SheetSize(board) * scale;
  const int border = kFiner * pixels_per_square;
  cv::Mat fine(static_cast<int>(std::lround(size.y())) + 2 * border,
               static_cast<int>(std::lround(size.x())) + 2 * border, CV_8UC1, cv::Scalar(255));
  for (const InkRectangle& ink : InkOf(board)) {
    const auto at = [&](double length) { return border + static_cast<int>(std::lround(length * scale)); };
    fine(cv::Range(at(ink.y), at(ink.y + ink.height)), cv::Range(at(ink.x), at(ink.x + ink.width))).setTo(0);
  }
  cv::Mat image;
  cv::resize(fine, image, {fine.cols / kFiner, fine.rows / kFiner}, 0, 0, cv::INTER_AREA);
  return image;
}

void PrintBoard(const BoardSpec& board, const std::filesystem::path& path) {
  constexpr double kPointsPerMetre = 72 / 0.0254, kMargin_m = 0.012;
  const Eigen::Vector2d sheet = SheetSize(board);
  // A4 in the orientation of the board, or a larger page if the board needs it.
  const double across = std::max(sheet.x() >= sheet.y() ? 0.297 : 0.210, sheet.x() + 2 * kMargin_m);
  const double down = std::max(sheet.x() >= sheet.y() ? 0.210 : 0.297, sheet.y() + 2 * kMargin_m + 0.01);
  const std::unique_ptr<cairo_surface_t, DestroySurface> surface(
      cairo_pdf_surface_create(path.c_str(), across * kPointsPerMetre, down * kPointsPerMetre));
  const std::unique_ptr<cairo_t, DestroyContext> context(cairo_create(surface.get()));
  cairo_t* const page = context.get();
  cairo_scale(page, kPointsPerMetre, kPointsPerMetre);
  const double left = (across - sheet.x()) / 2, top = (down - sheet.y()) / 2;
  cairo_set_source_rgb(page, 0, 0, 0);
  cairo_set_antialias(page, CAIRO_ANTIALIAS_NONE);
  for (const InkRectangle& ink : InkOf(board))
    cairo_rectangle(page, left + ink.x, top + ink.y, ink.width, ink.height);
  cairo_fill(page);
  cairo_set_font_size(page, 0.0035);
  cairo_move_to(page, kMargin_m / 2, down - 0.004);
  const std::string note = "Docent " + FormatBoard(board) + ": print at 100 %; a square is " +
                           FormatNumber(board.square_m * 1000, 6) + " mm. Glue it to a flat surface.";
  cairo_show_text(page, note.c_str());
  cairo_show_page(page);
  cairo_surface_finish(surface.get());
  if (cairo_surface_status(surface.get()) != CAIRO_STATUS_SUCCESS ||
      cairo_status(page) != CAIRO_STATUS_SUCCESS) {
    throw Error("Cannot write the board to '" + path.string() + "'; does its folder exist?");
  }
}

BoardDetector::BoardDetector(const BoardSpec& board) : board_(board) {}

BoardView BoardDetector::Detect(const cv::Mat& image, bool thorough) const {
  cv::Mat grey = image;
  if (image.channels() == 3) cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
  return board_.kind == BoardSpec::Kind::kCharuco ? DetectCharuco(grey) : DetectCheckerboard(grey, thorough);
}

BoardView BoardDetector::DetectCheckerboard(const cv::Mat& grey, bool thorough) const {
  const cv::Size size(board_.columns, board_.rows);
  std::vector<cv::Point2f> corners;
  // The sector-based search is fast and tolerates uneven lighting; the classic search detects smaller
  // squares.
  if (!cv::findChessboardCornersSB(grey, size, corners, cv::CALIB_CB_NORMALIZE_IMAGE) &&
      !(thorough && cv::findChessboardCorners(grey, size, corners,
                                              cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE |
                                                  cv::CALIB_CB_FAST_CHECK))) {
    return {};
  }
  std::vector<std::optional<Eigen::Vector2d>> guesses;
  for (const cv::Point2f& corner : corners) guesses.emplace_back(Eigen::Vector2d(corner.x, corner.y));
  constexpr double kWholeSquare = 0.5;
  BoardView view = Refine(grey, guesses, board_.columns, kWholeSquare);
  // Corners of a single row determine no pose; half of all corners never lie in one row.
  return 2 * view.pixels.size() < guesses.size() ? BoardView() : view;
}

BoardView BoardDetector::DetectCharuco(const cv::Mat& grey) const {
  const auto charuco = CharucoOf(board_);
  const auto parameters = cv::aruco::DetectorParameters::create();
  std::vector<std::vector<cv::Point2f>> markers;
  std::vector<int> ids;
  cv::aruco::detectMarkers(grey, Markers(), markers, ids, parameters);
  if (ids.size() < 4) return {};
  std::vector<cv::Point2f> corners;
  std::vector<int> corner_ids;
  cv::aruco::interpolateCornersCharuco(markers, ids, grey, charuco, corners, corner_ids);
  const int columns = board_.columns - 1, rows = board_.rows - 1;
  std::vector<std::optional<Eigen::Vector2d>> guesses(static_cast<std::size_t>(columns * rows));
  for (std::size_t i = 0; i < corners.size(); ++i) {
    // Depending on its version, OpenCV numbers the corners from the top or the bottom row, so rows and
    // columns are computed from the corner positions.
    const cv::Point3f& point = charuco->chessboardCorners[static_cast<std::size_t>(corner_ids[i])];
    const auto column = std::lround(point.x / board_.square_m) - 1;
    const auto row = std::lround(Flipped(board_, point.y) / board_.square_m) - 1;
    guesses[static_cast<std::size_t>(row * columns + column)] = Eigen::Vector2d(corners[i].x, corners[i].y);
  }
  // The distance from the square's edge to the marker, less a margin for the blur of the marker, as a ratio
  // of the square's side.
  constexpr double kClear = 0.5 * (1 - kMarkerRatio) - 0.03;
  constexpr std::size_t kMinCorners = 8;
  BoardView view = Refine(grey, guesses, columns, kClear);
  for (Eigen::Vector2d& point : view.points_on_board) point.array() += board_.square_m;
  return view.pixels.size() < kMinCorners ? BoardView() : view;
}

BoardView BoardDetector::Refine(const cv::Mat& grey,
                                const std::vector<std::optional<Eigen::Vector2d>>& guesses, int columns,
                                double clear_ratio) const {
  const int rows = static_cast<int>(guesses.size()) / columns;
  const auto at = [&](int column, int row) -> std::optional<Eigen::Vector2d> {
    if (column < 0 || row < 0 || column >= columns || row >= rows) return std::nullopt;
    return guesses[static_cast<std::size_t>(row * columns + column)];
  };
  // Extent of a square in the image: half the distance between both neighbours, or the distance to the only
  // one.
  const auto extent = [&](int column, int row, int right, int down) -> std::optional<Eigen::Vector2d> {
    const auto here = at(column, row), before = at(column - right, row - down),
               after = at(column + right, row + down);
    if (before && after) return 0.5 * (*after - *before);
    if (after) return *after - *here;
    if (before) return *here - *before;
    return std::nullopt;
  };
  BoardView view;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const auto guess = at(column, row);
      if (!guess) continue;
      const auto along_row = extent(column, row, 1, 0), along_column = extent(column, row, 0, 1);
      if (!along_row || !along_column) continue;
      const auto corner = RefineCorner(grey, {*guess, *along_row, *along_column}, clear_ratio);
      if (!corner) continue;
      view.points_on_board.emplace_back(board_.square_m * column, board_.square_m * row);
      view.pixels.push_back(*corner);
    }
  }
  return view;
}

}  // namespace docent::app
