// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <optional>

// Where four squares of a board meet, to a hundredth of a pixel: two blurred edges that cross are fitted to
// the image around a guess, by least squares on the brightness. Unlike a search for the point at which all
// gradients look, the fit may leave out what is printed inside the squares, and is not drawn to the side by a
// window that the lens bends. Pure functions, any thread.
namespace docent::app {

struct CornerGuess {
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  // How far a square reaches in the image along the board's rows and columns, pixels.
  Eigen::Vector2d along_row = Eigen::Vector2d::Zero(), along_column = Eigen::Vector2d::Zero();
};

// grey: CV_8UC1. clear_share: how much of a square beside its edges is of one colour; a half where nothing is
// printed in it. Empty where there is no such crossing within a third of a square of the guess: too small,
// cut off by the image's border, hidden, or without contrast.
std::optional<Eigen::Vector2d> RefineCorner(const cv::Mat& grey, const CornerGuess& guess,
                                            double clear_share);

}  // namespace docent::app
