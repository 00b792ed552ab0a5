// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

// The flat boards that a camera is calibrated with: what they look like on paper, and where their corners are
// in an image. Board frame: metres, x right and y down on the printed sheet, z into it, origin at the first
// inner corner of a checkerboard and at the outer upper left corner of a ChArUco board.
namespace docent::app {

struct BoardSpec {
  enum class Kind { kCheckerboard, kCharuco } kind = Kind::kCheckerboard;
  int columns = 9, rows = 6;  // inner corners of a checkerboard, squares of a ChArUco board
  double square_m = 0.025;

  int SquareColumns() const { return kind == Kind::kCheckerboard ? columns + 1 : columns; }
  int SquareRows() const { return kind == Kind::kCheckerboard ? rows + 1 : rows; }
  bool operator==(const BoardSpec&) const = default;
};

// "checkerboard:9x6:25" (inner corners, millimetres) or "charuco:8x6:30" (squares). Throws Error otherwise,
// and for a checkerboard that looks the same after half a turn only where that would make corners ambiguous
// to a person: OpenCV finds either end, which does not matter to a lens.
BoardSpec ParseBoard(const std::string& text);
std::string FormatBoard(const BoardSpec& board);

// A black rectangle of the sheet, metres from the sheet's upper left corner.
struct InkRectangle {
  double x = 0, y = 0, width = 0, height = 0;
};
// What is printed: the squares, and the cells of a ChArUco board's markers.
std::vector<InkRectangle> InkOf(const BoardSpec& board);
// The sheet's size without margins, metres.
Eigen::Vector2d SheetSize(const BoardSpec& board);
// An image of the sheet with a white border of one square, CV_8UC1.
cv::Mat PaintBoard(const BoardSpec& board, int pixels_per_square);
// Writes a PDF of the board at its true size, on a page with the board in its middle and a scale to check the
// printer with. Throws Error where the file cannot be written.
void PrintBoard(const BoardSpec& board, const std::filesystem::path& path);

// Corners of a board in one image.
struct BoardView {
  std::vector<Eigen::Vector2d> points_on_board;  // metres
  std::vector<Eigen::Vector2d> pixels;
};

// Finds the board's corners to a fraction of a pixel: of a checkerboard when all of it is in the image, of
// a ChArUco board those that can be seen. Empty views have no points. Any thread.
class BoardDetector {
 public:
  explicit BoardDetector(const BoardSpec& board);
  // image: CV_8UC1 or CV_8UC3. thorough: where a quick search finds no checkerboard, a slow one is made
  // too; a person before a live image would rather have the next one.
  BoardView Detect(const cv::Mat& image, bool thorough = true) const;

 private:
  BoardView DetectCheckerboard(const cv::Mat& grey, bool thorough) const;
  BoardView DetectCharuco(const cv::Mat& grey) const;
  // guesses: row by row, empty where a corner was not seen.
  BoardView Refine(const cv::Mat& grey, const std::vector<std::optional<Eigen::Vector2d>>& guesses,
                   int columns, double clear_share) const;

  BoardSpec board_;
};

}  // namespace docent::app
