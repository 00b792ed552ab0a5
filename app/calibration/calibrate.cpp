// SPDX-License-Identifier: Apache-2.0
#include "app/calibration/calibrate.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "app/calibration/calibration_file.h"
#include "app/files/text_file.h"
#include "engine/base/error.h"

namespace docent::app {

namespace {

using engine::CameraModel;
using engine::LensModel;

std::vector<BoardView> Select(const std::vector<BoardView>& views, const std::vector<std::size_t>& indices) {
  std::vector<BoardView> selected;
  for (const std::size_t i : indices) selected.push_back(views[i]);
  return selected;
}

// Rejects views that no lens could fit, because corners were confused or the image is blurred by motion.
std::vector<BoardView> WithoutOutliers(const std::vector<BoardView>& views, const LensSolution& solution,
                                       double max_error_ratio) {
  std::vector<double> sorted = solution.view_rms_px;
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2),
                   sorted.end());
  const double median = sorted[sorted.size() / 2];
  std::vector<BoardView> kept;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (solution.view_rms_px[i] <= std::max(max_error_ratio * median, 0.05)) kept.push_back(views[i]);
  }
  return kept;
}

struct Fitted {
  LensSolution solution;
  std::vector<BoardView> views;
  double cross_validated_px = 0;
};

std::optional<Fitted> Fit(LensModel lens, int width_px, int height_px, const std::vector<BoardView>& views,
                          const CalibrationOptions& options) {
  auto solution = SolveLens(lens, width_px, height_px, views);
  if (!solution) return std::nullopt;
  Fitted fitted;
  fitted.views = WithoutOutliers(views, *solution, options.max_view_error_ratio);
  if (fitted.views.size() < options.min_views) return std::nullopt;
  if (fitted.views.size() < views.size()) {
    solution = RefineLens(solution->camera, fitted.views);
    if (!solution) return std::nullopt;
  }
  if (fitted.views.size() > options.max_views) {
    fitted.views = Select(fitted.views, ChooseViews(solution->information, options.max_views));
    solution = RefineLens(solution->camera, fitted.views);
    if (!solution) return std::nullopt;
  }
  const auto unseen = CrossValidate(lens, width_px, height_px, fitted.views, options.folds, solution->camera);
  if (!unseen) return std::nullopt;
  fitted.solution = std::move(*solution);
  fitted.cross_validated_px = *unseen;
  return fitted;
}

const char* LensName(LensModel lens) {
  switch (lens) {
    case LensModel::kRadialTangential:
      return "radial-tangential";
    case LensModel::kFov:
      return "field-of-view";
    case LensModel::kKannalaBrandt:
      return "Kannala-Brandt";
  }
  return "";
}

std::string Assess(const Calibration& calibration, int width_px) {
  // The error is compared relative to an image width of 640 pixels.
  const double error = calibration.cross_validated_px * 640 / width_px;
  std::string text = error < 0.35 && calibration.focal_sigma < 0.002  ? "Good"
                     : error < 0.8 && calibration.focal_sigma < 0.006 ? "Usable"
                                                                      : "Poor";
  text += ": the " + std::string(LensName(calibration.camera.lens())) + " lens has an error of " +
          FormatNumber(calibration.cross_validated_px, 3) +
          " px on views that were not used for the fit, and the focal length is accurate to " +
          FormatNumber(100 * calibration.focal_sigma, 2) + " %";
  if (calibration.coverage < 0.6) {
    text += "; the board covered only " + FormatNumber(std::round(100 * calibration.coverage), 3) +
            " % of the image, so the calibration is unreliable in the image corners";
  } else if (calibration.focal_sigma >= 0.002) {
    text += "; tilt the board more";
  } else if (error >= 0.8) {
    text += "; check that the board is flat and the images are sharp";
  }
  return text + ".";
}

}  // namespace

std::vector<std::size_t> ChooseViews(const std::vector<Eigen::MatrixXd>& information, std::size_t count) {
  std::vector<std::size_t> chosen;
  if (information.empty()) return chosen;
  const Eigen::Index size = information.front().rows();
  // Pixels and distortion coefficients differ by orders of magnitude, so each parameter is scaled by the
  // square root of its information from all views.
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(size, size);
  for (const Eigen::MatrixXd& view : information) all += view;
  const Eigen::VectorXd scale = all.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  Eigen::MatrixXd sum = 1e-9 * Eigen::MatrixXd::Identity(size, size);
  std::vector<bool> taken(information.size(), false);
  while (chosen.size() < std::min(count, information.size())) {
    double best = -std::numeric_limits<double>::max();
    std::size_t which = information.size();
    for (std::size_t i = 0; i < information.size(); ++i) {
      if (taken[i]) continue;
      const Eigen::MatrixXd with = sum + scale.asDiagonal() * information[i] * scale.asDiagonal();
      const double gain = with.ldlt().vectorD().cwiseMax(1e-300).array().log().sum();
      if (gain > best) {
        best = gain;
        which = i;
      }
    }
    if (which == information.size()) break;
    taken[which] = true;
    chosen.push_back(which);
    sum += scale.asDiagonal() * information[which] * scale.asDiagonal();
  }
  return chosen;
}

std::optional<double> CrossValidate(LensModel lens, int width_px, int height_px,
                                    const std::vector<BoardView>& views, std::size_t folds,
                                    const CameraModel& start) {
  double squares = 0, corners = 0;
  folds = std::min(folds, views.size());
  for (std::size_t fold = 0; fold < folds; ++fold) {
    std::vector<BoardView> others;
    for (std::size_t i = 0; i < views.size(); ++i) {
      if (i % folds != fold) others.push_back(views[i]);
    }
    auto solution = RefineLens(start, others);
    if (!solution) solution = SolveLens(lens, width_px, height_px, others);
    if (!solution) return std::nullopt;
    for (std::size_t i = fold; i < views.size(); i += folds) {
      const auto pose = SolvePose(solution->camera, views[i]);
      if (!pose) return std::nullopt;
      squares += pose->rms_px * pose->rms_px * static_cast<double>(views[i].pixels.size());
      corners += static_cast<double>(views[i].pixels.size());
    }
  }
  return std::sqrt(squares / corners);
}

Calibration Calibrate(const std::vector<BoardView>& views, int width_px, int height_px,
                      const CalibrationOptions& options) {
  if (views.size() < options.min_views) {
    throw Error("The board was found in only " + std::to_string(views.size()) +
                " images; a calibration needs " + std::to_string(options.min_views) +
                " different views, and twenty or more give a good result.");
  }
  std::vector<LensModel> models = {LensModel::kRadialTangential, LensModel::kFov, LensModel::kKannalaBrandt};
  if (options.lens) models = {*options.lens};
  std::optional<Fitted> best;
  for (const LensModel lens : models) {
    auto fitted = Fit(lens, width_px, height_px, views, options);
    // Among models with nearly equal errors the earlier one is preferred, because it is in wider use.
    if (fitted && (!best || fitted->cross_validated_px < 0.99 * best->cross_validated_px))
      best = std::move(fitted);
  }
  if (!best) {
    throw Error(
        "No lens model fits the views of the board; tilt the board in different directions, and check its "
        "number of squares.");
  }
  Calibration calibration;
  const LensSolution& solution = best->solution;
  calibration.camera = solution.camera;
  calibration.views_found = views.size();
  calibration.views_used = best->views.size();
  Coverage coverage(width_px, height_px);
  for (const BoardView& view : best->views) {
    calibration.corners += view.pixels.size();
    coverage.Add(view);
  }
  calibration.rms_px = solution.rms_px;
  calibration.cross_validated_px = best->cross_validated_px;
  calibration.focal_sigma = solution.FocalSigma();
  calibration.principal_sigma_px = std::max(solution.sigma[2], solution.sigma[3]);
  calibration.coverage = coverage.Ratio();
  calibration.assessment = Assess(calibration, width_px);
  calibration.views = std::move(best->views);
  return calibration;
}

std::string FormatCalibration(const Calibration& calibration, const BoardSpec& board) {
  std::string text = FormatCalibration(calibration.camera);
  text += "# How this calibration was made, and its quality.\n";
  text += "assessment: \"" + calibration.assessment + "\"\n";
  text += "board: \"" + FormatBoard(board) + "\"\n";
  text += "views: " + std::to_string(calibration.views_used) + "\n";
  text += "corners: " + std::to_string(calibration.corners) + "\n";
  text += "rms_px: " + FormatNumber(calibration.rms_px, 4) + "\n";
  text += "cross_validated_px: " + FormatNumber(calibration.cross_validated_px, 4) + "\n";
  text += "focal_sigma_percent: " + FormatNumber(100 * calibration.focal_sigma, 3) + "\n";
  text += "principal_point_sigma_px: " + FormatNumber(calibration.principal_sigma_px, 3) + "\n";
  text += "coverage_percent: " + FormatNumber(100 * calibration.coverage, 3) + "\n";
  return text;
}

void Coverage::Add(const BoardView& view) {
  for (const Eigen::Vector2d& pixel : view.pixels) {
    const int column = std::clamp(static_cast<int>(pixel.x() * kColumns / width_px_), 0, kColumns - 1);
    const int row = std::clamp(static_cast<int>(pixel.y() * kRows / height_px_), 0, kRows - 1);
    seen_[static_cast<std::size_t>(row * kColumns + column)] = true;
  }
}

double Coverage::Ratio() const {
  return static_cast<double>(std::count(seen_.begin(), seen_.end(), true)) /
         static_cast<double>(seen_.size());
}

std::string Coverage::Advice() const {
  // Finds the ninth of the image with the most missing cells.
  static constexpr const char* kRowNames[] = {"upper", "middle", "lower"};
  static constexpr const char* kColumnNames[] = {"left", "middle", "right"};
  std::array<std::array<int, 3>, 3> missing{};
  for (int row = 0; row < kRows; ++row) {
    for (int column = 0; column < kColumns; ++column)
      missing[static_cast<std::size_t>(row * 3 / kRows)][static_cast<std::size_t>(column * 3 / kColumns)] +=
          !IsSeen(column, row);
  }
  int most = 1, at_row = -1, at_column = -1;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      if (missing[row][column] <= most) continue;
      most = missing[row][column];
      at_row = row;
      at_column = column;
    }
  }
  if (at_row < 0) return {};
  if (at_row == 1 && at_column == 1) return "show the board in the centre";
  return std::string("show the board at the ") + kRowNames[at_row] + " " + kColumnNames[at_column];
}

double Movement(const BoardView& from, const BoardView& to) {
  double moved = 0;
  std::size_t shared = 0;
  for (std::size_t i = 0; i < to.pixels.size(); ++i) {
    for (std::size_t k = 0; k < from.pixels.size(); ++k) {
      constexpr double kSamePlace_m = 1e-4;
      if ((to.points_on_board[i] - from.points_on_board[k]).norm() > kSamePlace_m) continue;
      moved += (to.pixels[i] - from.pixels[k]).norm();
      ++shared;
    }
  }
  if (2 * shared < to.pixels.size() || shared == 0) return std::numeric_limits<double>::infinity();
  return moved / static_cast<double>(shared);
}

bool IsNewView(const BoardView& view, const std::vector<BoardView>& before, int width_px) {
  constexpr double kMinMovement = 1.0 / 30;  // Ratio of the image width.
  return std::none_of(before.begin(), before.end(), [&](const BoardView& other) {
    return Movement(other, view) < kMinMovement * width_px;
  });
}

}  // namespace docent::app
