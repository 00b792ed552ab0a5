// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core.hpp>

#include "engine/base/random.h"

// Drawing primitives of the procedural textures. All images are CV_8UC3 in BGR; all randomness comes from the
// generator passed in.
namespace docent::app {

// Colour from hue (in full circles; only the fractional part counts), saturation and brightness in [0, 1].
cv::Scalar ColorFromHue(double hue, double saturation, double brightness);
// A random colour with brightness in the given range.
cv::Scalar RandomColor(Random* random, double low_brightness = 0.15, double high_brightness = 0.95);

// Sum of smooth value noise over `octaves` scales: the coarsest has cells_x by cells_y cells, each finer one
// has twice the cells and `persistence` times the amplitude. CV_32FC1 with mean 0; nearly all values are in
// [-1, 1].
cv::Mat NoiseField(cv::Size size, int cells_x, int cells_y, int octaves, double persistence, Random* random);

// Adds the field (CV_32FC1) times `strength` (grey levels) times the channel's tint to each channel.
void AddField(const cv::Mat& field, double strength, cv::Mat* image, const cv::Scalar& tint = {1, 1, 1});
// Returns a new image that blends from color a (field at or below -1) to color b (field at or above 1).
cv::Mat ColorsAlong(const cv::Mat& field, const cv::Scalar& a, const cv::Scalar& b);

// Fills the area with lines of pseudo-text; letters are letter_px high.
void DrawWriting(const cv::Rect& area, int letter_px, const cv::Scalar& color, Random* random,
                 cv::Mat* image);
// A polygon, star, disc, ring or bar of about this radius, filled or as outline.
void DrawShape(cv::Point2d center, double radius, const cv::Scalar& color, Random* random, cv::Mat* image);
// Adds scratches, specks and stains; `amount` is about 1.
void Weather(double amount, Random* random, cv::Mat* image);

}  // namespace docent::app
