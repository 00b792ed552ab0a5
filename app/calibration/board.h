// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

// Planar calibration boards: printing them, and detecting their corners in an image. Board frame: metres, x
// right and y down on the printed sheet, z into it. The origin is the first inner corner of a checkerboard,
// and the outer upper left corner of a ChArUco board.
namespace docent::app {

struct BoardSpec {
  enum class Kind { kCheckerboard, kCharuco } kind = Kind::kCheckerboard;
  int columns = 9, rows = 6;  // Inner corners of a checkerboard, squares of a ChArUco board.
  double square_m = 0.025;

  int SquareColumns() const { return kind == Kind::kCheckerboard ? columns + 1 : columns; }
  int SquareRows() const { return kind == Kind::kCheckerboard ? rows + 1 : rows; }
  bool operator==(const BoardSpec&) const = default;
};

// Parses "checkerboard:9x6:25" (inner corners, square size in millimetres) or "charuco:8x6:30" (squares, size
// in millimetres). Throws Error for anything else. A checkerboard may be symmetric under rotation by 180
// degrees: OpenCV may then begin at either end, which does not affect the estimated lens.
BoardSpec ParseBoard(const std::string& text);
std::string FormatBoard(const BoardSpec& board);

// A black rectangle, in metres from the sheet's upper left corner.
struct InkRectangle {
  double x = 0, y = 0, width = 0, height = 0;
};
// The black areas of the board: the squares, and the cells of a ChArUco board's markers.
std::vector<InkRectangle> InkOf(const BoardSpec& board);
// Size of the sheet without margins, in metres.
Eigen::Vector2d SheetSize(const BoardSpec& board);
// Renders the sheet with a white border of one square, CV_8UC1.
cv::Mat PaintBoard(const BoardSpec& board, int pixels_per_square);
// Writes a PDF with the board at its true size in the centre of the page, and with a note of the square size
// so that the printed board can be checked. Throws Error when the file cannot be written.
void PrintBoard(const BoardSpec& board, const std::filesystem::path& path);

// The corners of a board detected in one image.
struct BoardView {
  std::vector<Eigen::Vector2d> points_on_board;  // Board frame, metres.
  std::vector<Eigen::Vector2d> pixels;
};

// Detects the board's corners with subpixel accuracy: a checkerboard only when all of it is in the image, a
// ChArUco board also when it is partly hidden. The view has no points when no board is found, or too few of
// its corners can be refined to determine the pose of the board. Any thread.
class BoardDetector {
 public:
  explicit BoardDetector(const BoardSpec& board);
  // image: CV_8UC1 or CV_8UC3. thorough: also tries a slow search when the fast one finds no checkerboard;
  // for a live camera it is better to go on to the next image.
  BoardView Detect(const cv::Mat& image, bool thorough = true) const;

 private:
  BoardView DetectCheckerboard(const cv::Mat& grey, bool thorough) const;
  BoardView DetectCharuco(const cv::Mat& grey) const;
  // guesses: initial corner positions row by row; empty for corners that were not detected. clear_ratio: see
  // RefineCorner.
  BoardView Refine(const cv::Mat& grey, const std::vector<std::optional<Eigen::Vector2d>>& guesses,
                   int columns, double clear_ratio) const;

  BoardSpec board_;
};

}  // namespace docent::app
