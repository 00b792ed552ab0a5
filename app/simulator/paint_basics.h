// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core.hpp>

#include "engine/base/random.h"

// Strokes from which the painted textures of the simulator are put together. All images are CV_8UC3 in BGR,
// all chance comes from the generator that is handed in.
namespace docent::app {

// Colour from hue (turns, any number), saturation and brightness in [0, 1].
cv::Scalar ColorFromHue(double hue, double saturation, double brightness);
// A colour with these bounds on its brightness.
cv::Scalar RandomColor(Random* random, double low_brightness = 0.15, double high_brightness = 0.95);

// Sum of smooth value noise over `octaves` scales, the coarsest with cells_x by cells_y cells, each finer one
// with twice the cells and `persistence` times the amplitude; CV_32FC1 around zero, nearly all within [-1,
// 1].
cv::Mat NoiseField(cv::Size size, int cells_x, int cells_y, int octaves, double persistence, Random* random);

// Adds `strength` times the field (CV_32FC1, grey levels at 1) to all channels, times the tint of each.
void AddField(const cv::Mat& field, double strength, cv::Mat* image, const cv::Scalar& tint = {1, 1, 1});
// Blends from color a (field at or below -1) to color b (at or above 1) into a new image.
cv::Mat ColorsAlong(const cv::Mat& field, const cv::Scalar& a, const cv::Scalar& b);

// Lines of word-like groups of letter-like strokes that fill the area; letters are letter_px high.
void DrawWriting(const cv::Rect& area, int letter_px, const cv::Scalar& color, Random* random,
                 cv::Mat* image);
// A polygon, star, disc, ring, or bar of about this radius; filled, or an outline.
void DrawShape(cv::Point2d center, double radius, const cv::Scalar& color, Random* random, cv::Mat* image);
// Scratches, specks and stains, as things in use have them; `amount` about 1.
void Weather(double amount, Random* random, cv::Mat* image);

}  // namespace docent::app
