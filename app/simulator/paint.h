// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>

// Textures as rich as photographs, painted from a seed: corners at many scales, sharp edges, natural
// contrast. Each answers a CV_8UC3 image in BGR; the same size, arguments and seed give the same image to
// the byte.
namespace docent::app {

// Materials. `color` is the mean colour.
cv::Mat PaintPlaster(cv::Size size, const cv::Scalar& color, std::uint64_t seed);
cv::Mat PaintWood(cv::Size size, const cv::Scalar& color, int planks, std::uint64_t seed);
cv::Mat PaintBricks(cv::Size size, const cv::Scalar& color, int rows, std::uint64_t seed);
cv::Mat PaintTiles(cv::Size size, int tiles_across, std::uint64_t seed);
cv::Mat PaintStone(cv::Size size, const cv::Scalar& color, std::uint64_t seed);
cv::Mat PaintCarpet(cv::Size size, std::uint64_t seed);
// Fits to its own opposite border, so that it can be repeated.
cv::Mat PaintGrass(cv::Size size, std::uint64_t seed);

// Images and things.
cv::Mat PaintPoster(cv::Size size, std::uint64_t seed);
// Brush strokes that follow a landscape of colours, in a wooden frame.
cv::Mat PaintPainting(cv::Size size, std::uint64_t seed);
// Shapes that cover each other, their sizes spread by a power law: the statistics of photographs ("dead
// leaves", Lee, Mumford and Huang 2001).
cv::Mat PaintCollage(cv::Size size, std::uint64_t seed);
cv::Mat PaintBooks(cv::Size size, int shelves, std::uint64_t seed);
cv::Mat PaintPackage(cv::Size size, std::uint64_t seed);
cv::Mat PaintScreen(cv::Size size, std::uint64_t seed);
cv::Mat PaintPage(cv::Size size, std::uint64_t seed);
// A panelled front of a cabinet with drawers and handles.
cv::Mat PaintCabinet(cv::Size size, const cv::Scalar& color, std::uint64_t seed);

}  // namespace docent::app
