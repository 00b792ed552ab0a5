// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "app/calibration/board.h"
#include "engine/geometry/camera_model.h"
#include "engine/geometry/rigid3.h"

// A lens from views of a flat board, by least squares on the reprojection error through the very camera
// models that the tracker uses (Zhang 2000, with Ceres).
namespace docent::app {

// How many numbers a lens model has, focal lengths and principal point among them.
int IntrinsicCount(engine::LensModel lens);

struct LensSolution {
  engine::CameraModel camera;
  std::vector<engine::Rigid3> camera_from_board;  // by view
  std::vector<double> view_rms_px;                // by view: root mean square of the distances
  double rms_px = 0;
  // Of the intrinsics (fx fy cx cy and the distortion), by how far the residuals of this many corners can
  // move them: standard deviations.
  Eigen::VectorXd sigma;
  // What each view alone says of the intrinsics, its pose being unknown; by view.
  std::vector<Eigen::MatrixXd> information;

  // The larger of both focal lengths' standard deviations, as a part of it.
  double FocalSigma() const;
};

// From no guess at all. Empty when no lens of this model explains the views (too few, all from the same side,
// or another kind of lens). Views need four corners each; two views at least.
std::optional<LensSolution> SolveLens(engine::LensModel lens, int width_px, int height_px,
                                      const std::vector<BoardView>& views);
// From a solution of other views of the same camera.
std::optional<LensSolution> RefineLens(const engine::CameraModel& start, const std::vector<BoardView>& views);

// Where the lens puts each corner, minus where it was seen, pixels; by view and corner. The views are those
// of the solution, in its order.
std::vector<std::vector<Eigen::Vector2d>> Residuals(const LensSolution& solution,
                                                    const std::vector<BoardView>& views);

// The board's pose in one view through a known lens, and the root mean square of what remains, pixels. Empty
// when there is none.
struct BoardPose {
  engine::Rigid3 camera_from_board;
  double rms_px = 0;
};
std::optional<BoardPose> SolvePose(const engine::CameraModel& camera, const BoardView& view);

}  // namespace docent::app
