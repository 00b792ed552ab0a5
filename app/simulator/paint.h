// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>

// Procedural textures with image statistics similar to photographs: corners at many scales, sharp edges and
// natural contrast. Each function returns a CV_8UC3 image in BGR; equal arguments and seeds give
// byte-identical images.
namespace docent::app {

// Materials; `color` is the mean colour.
cv::Mat PaintPlaster(cv::Size size, const cv::Scalar& color, std::uint64_t seed);
cv::Mat PaintWood(cv::Size size, const cv::Scalar& color, int planks, std::uint64_t seed);
cv::Mat PaintBricks(cv::Size size, const cv::Scalar& color, int rows, std::uint64_t seed);
cv::Mat PaintTiles(cv::Size size, int tiles_across, std::uint64_t seed);
cv::Mat PaintStone(cv::Size size, const cv::Scalar& color, std::uint64_t seed);
cv::Mat PaintCarpet(cv::Size size, std::uint64_t seed);
// Tileable: opposite borders match.
cv::Mat PaintGrass(cv::Size size, std::uint64_t seed);

// Pictorial and object textures.
cv::Mat PaintPoster(cv::Size size, std::uint64_t seed);
// A framed painting: brush strokes coloured by a smooth random field.
cv::Mat PaintPainting(cv::Size size, std::uint64_t seed);
// Overlapping shapes with power-law sizes, which have the statistics of photographs ("dead leaves" model,
// Lee, Mumford and Huang 2001).
cv::Mat PaintCollage(cv::Size size, std::uint64_t seed);
cv::Mat PaintBooks(cv::Size size, int shelves, std::uint64_t seed);
cv::Mat PaintPackage(cv::Size size, std::uint64_t seed);
cv::Mat PaintScreen(cv::Size size, std::uint64_t seed);
cv::Mat PaintPage(cv::Size size, std::uint64_t seed);
// A panelled cabinet front with drawers and handles.
cv::Mat PaintCabinet(cv::Size size, const cv::Scalar& color, std::uint64_t seed);

}  // namespace docent::app
