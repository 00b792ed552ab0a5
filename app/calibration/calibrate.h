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

// From many images of a board to a calibration that says how good it is.
namespace docent::app {

struct CalibrationOptions {
  std::optional<engine::LensModel> lens;  // empty: the model that predicts unseen views best
  std::size_t max_views = 30;             // chosen from all by what they say of the lens
  std::size_t min_views = 5;
  std::size_t folds = 5;          // of the cross-validation
  double max_outlier_sigmas = 4;  // views whose error is this much beyond the usual are left out
};

struct Calibration {
  engine::CameraModel camera;
  std::size_t views_found = 0, views_used = 0, corners = 0;
  double rms_px = 0;              // on the views it was made from
  double cross_validated_px = 0;  // on views it was not made from
  double focal_sigma = 0;         // part of the focal length
  double principal_sigma_px = 0;
  double coverage = 0;           // part of the image's cells in which corners were seen
  std::string verdict;           // one sentence
  std::vector<BoardView> views;  // used
};

// Throws Error with one sentence when the views do not make a calibration: too few, or no lens explains them.
Calibration Calibrate(const std::vector<BoardView>& views, int width_px, int height_px,
                      const CalibrationOptions& options = {});

// The views that together say most of the lens: one after the other, the one that raises the determinant of
// the intrinsics' information most (D-optimal design, Atkinson and Donev 1992). Indices, best first.
std::vector<std::size_t> ChooseViews(const std::vector<Eigen::MatrixXd>& information, std::size_t count);

// The mean error on views that a calibration has not seen: they are dealt into folds, and each fold's boards
// are placed by the lens of the others.
std::optional<double> CrossValidate(engine::LensModel lens, int width_px, int height_px,
                                    const std::vector<BoardView>& views, std::size_t folds,
                                    const engine::CameraModel& start);

// Docent's own YAML with what is known of its quality in further fields (`board`, `views`, `rms_px`,
// `cross_validated_px`, `verdict` …), which readers of cameras pass over.
std::string FormatCalibration(const Calibration& calibration, const BoardSpec& board);

// Which parts of an image the corners of views have been seen in, for whoever holds the board.
class Coverage {
 public:
  static constexpr int kColumns = 8, kRows = 6;
  Coverage(int width_px, int height_px) : width_px_(width_px), height_px_(height_px) {}
  void Add(const BoardView& view);
  double Share() const;  // of the cells
  bool IsSeen(int column, int row) const { return seen_[static_cast<std::size_t>(row * kColumns + column)]; }
  // "show the board at the lower left", or empty when little is missing.
  std::string Advice() const;

 private:
  int width_px_, height_px_;
  std::array<bool, kColumns * kRows> seen_{};
};

// How far the corners that both views show have moved on average, pixels; infinite when they share hardly
// any.
double Movement(const BoardView& from, const BoardView& to);
// Whether a view shows the board elsewhere than all before: corners moved by a thirtieth of the image's
// width on average.
bool IsNewView(const BoardView& view, const std::vector<BoardView>& before, int width_px);

}  // namespace docent::app
