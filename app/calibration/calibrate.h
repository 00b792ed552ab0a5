// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "app/calibration/board.h"
#include "app/calibration/lens_solver.h"
#include "engine/geometry/camera_model.h"

// Camera calibration from many views of a planar board, with an estimate of its quality.
namespace docent::app {

struct CalibrationOptions {
  std::optional<engine::LensModel> lens;  // Empty: the model with the smallest cross-validated error.
  std::size_t max_views = 30;             // Views used; they are chosen by ChooseViews.
  std::size_t min_views = 5;              // Fewer views are an Error.
  std::size_t folds = 5;                  // Folds of the cross-validation.
  double max_view_error_ratio = 4;  // Views whose RMS error is above this ratio of the median are rejected.
};

struct Calibration {
  engine::CameraModel camera;
  std::size_t views_found = 0, views_used = 0, corners = 0;
  double rms_px = 0;              // RMS reprojection error of the views used for the fit.
  double cross_validated_px = 0;  // RMS reprojection error of views left out of the fit.
  double focal_sigma = 0;         // Standard deviation of the focal length, as a ratio of it.
  double principal_sigma_px = 0;  // Standard deviation of the principal point.
  double coverage = 0;            // Ratio of image cells in which corners were detected.
  std::string assessment;         // One sentence about the quality, for people.
  std::vector<BoardView> views;   // The views used.
};

// Throws Error with one sentence when calibration fails: there are too few views, or no lens model fits them.
Calibration Calibrate(const std::vector<BoardView>& views, int width_px, int height_px,
                      const CalibrationOptions& options = {});

// Chooses the views that together carry most information about the lens: greedily adds the view that
// increases the determinant of the information matrix of the intrinsics most (D-optimal design, Atkinson and
// Donev 1992). Returns indices, best first.
std::vector<std::size_t> ChooseViews(const std::vector<Eigen::MatrixXd>& information, std::size_t count);

// Cross-validation: fits the lens to all folds but one, estimates the board poses of the remaining fold with
// it, and returns the RMS reprojection error over all folds, in pixels. Empty when a fit or a pose fails.
std::optional<double> CrossValidate(engine::LensModel lens, int width_px, int height_px,
                                    const std::vector<BoardView>& views, std::size_t folds,
                                    const engine::CameraModel& start);

// Formats Docent's own YAML with additional quality fields (`board`, `views`, `rms_px`, `cross_validated_px`
// …), which ReadCalibration ignores.
std::string FormatCalibration(const Calibration& calibration, const BoardSpec& board);

// Records in which cells of the image corners were detected, to guide the person who holds the board.
class Coverage {
 public:
  static constexpr int kColumns = 8, kRows = 6;
  Coverage(int width_px, int height_px) : width_px_(width_px), height_px_(height_px) {}
  void Add(const BoardView& view);
  double Ratio() const;  // Cells with corners over all cells.
  bool IsSeen(int column, int row) const { return seen_[static_cast<std::size_t>(row * kColumns + column)]; }
  // Says where to show the board next, for instance "show the board at the lower left". Empty when no ninth
  // of the image lacks more than one cell.
  std::string Advice() const;

 private:
  int width_px_, height_px_;
  std::array<bool, kColumns * kRows> seen_{};
};

// Mean distance in pixels between the corners that both views contain; infinite when they share fewer than
// half of the corners of `to`.
double Movement(const BoardView& from, const BoardView& to);
// Whether the board has moved since all earlier views: by at least 1/30 of the image width on average.
bool IsNewView(const BoardView& view, const std::vector<BoardView>& before, int width_px);

}  // namespace docent::app
