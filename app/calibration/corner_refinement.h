// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <optional>

// Refines the corner where four squares of a board meet to about a hundredth of a pixel: a model of two
// crossing blurred edges is fitted to the brightness around an initial guess by least squares. Unlike
// cv::cornerSubPix, which searches the point that all gradients are perpendicular to, the fit can exclude
// what is printed inside the squares, and lens distortion within the window does not bias it. Pure functions,
// any thread.
namespace docent::app {

struct CornerGuess {
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  // Extent of a square in the image along the board's rows and columns, in pixels.
  Eigen::Vector2d along_row = Eigen::Vector2d::Zero(), along_column = Eigen::Vector2d::Zero();
};

// grey: CV_8UC1. clear_ratio: width of the border of a square that has one colour, as a ratio of its side;
// 0.5 when nothing is printed in the square. Empty when no corner is found within a third of a square of the
// guess, because the squares are too small, cut off by the image border, hidden, or have too little contrast.
std::optional<Eigen::Vector2d> RefineCorner(const cv::Mat& grey, const CornerGuess& guess,
                                            double clear_ratio);

}  // namespace docent::app
