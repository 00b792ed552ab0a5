// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "app/calibration/board.h"
#include "engine/geometry/camera_model.h"
#include "engine/geometry/rigid3.h"

// Estimates the lens from views of a planar board by minimizing the reprojection error (Zhang 2000) with
// Ceres. It uses the same camera models as the tracker.
namespace docent::app {

// Number of intrinsic parameters of a lens model, including focal lengths and principal point.
int IntrinsicCount(engine::LensModel lens);

struct LensSolution {
  engine::CameraModel camera;
  std::vector<engine::Rigid3> camera_from_board;  // By view.
  std::vector<double> view_rms_px;                // By view: RMS reprojection error.
  double rms_px = 0;
  // Standard deviations of the intrinsics (fx fy cx cy and the distortion), from their covariance scaled by
  // the residual variance.
  Eigen::VectorXd sigma;
  // By view: information matrix of the intrinsics with the view's pose eliminated (Schur complement).
  std::vector<Eigen::MatrixXd> information;

  // The larger of the relative standard deviations of fx and fy.
  double FocalSigma() const;
};

// Estimates the lens without an initial guess. Needs at least two views with four corners each. Empty when no
// lens of this model fits: too few views, all from the same direction, or another kind of lens.
std::optional<LensSolution> SolveLens(engine::LensModel lens, int width_px, int height_px,
                                      const std::vector<BoardView>& views);
// Estimates the lens, starting from a solution for other views of the same camera.
std::optional<LensSolution> RefineLens(const engine::CameraModel& start, const std::vector<BoardView>& views);

// Residuals, predicted minus detected corner in pixels, by view and corner. The views are those of the
// solution, in the same order.
std::vector<std::vector<Eigen::Vector2d>> Residuals(const LensSolution& solution,
                                                    const std::vector<BoardView>& views);

// Estimates the board's pose in one view with a known lens, and the RMS reprojection error in pixels. Empty
// on failure.
struct BoardPose {
  engine::Rigid3 camera_from_board;
  double rms_px = 0;
};
std::optional<BoardPose> SolvePose(const engine::CameraModel& camera, const BoardView& view);

}  // namespace docent::app
