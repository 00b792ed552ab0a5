// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "engine/vision/image_pyramid.h"

namespace docent::engine {

// FAST corners (Rosten and Drummond, "Machine learning for high-speed corner detection", ECCV 2006): pixels
// with nine in a row of the sixteen about them all brighter, or all darker, by more than `threshold`; of
// neighbouring ones the strongest alone. Finds what cv::FAST (TYPE_9_16, with suppression) finds, in the same
// order, but scores sixteen pixels at a time and fills the row index on the way.
//   image: CV_8UC1. border: no corner is nearer to the edge than this many pixels; at least 4.
//   corners: by row, then column. row_begin: see ImageFeatures.
// Allocates only where the vectors, or a memory that each thread keeps, must grow.
void DetectFastCorners(const cv::Mat& image, int threshold, int border, std::vector<Corner>* corners,
                       std::vector<int>* row_begin);

}  // namespace docent::engine
