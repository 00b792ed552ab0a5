// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "engine/vision/image_pyramid.h"

namespace docent::engine {

// FAST corners (Rosten and Drummond, "Machine learning for high-speed corner detection", ECCV 2006): pixels
// for which nine contiguous pixels of the surrounding circle of sixteen are all brighter, or all darker, by
// more than `threshold`, with non-maximum suppression. Returns the same corners in the same order as cv::FAST
// (TYPE_9_16), but scores sixteen pixels at a time and fills the row index as well.
//  image: CV_8UC1. border: minimum distance of a corner to the image border in pixels; at least 4.
//  corners: by row, then column. row_begin: see ImageFeatures.
// Allocates only to grow the vectors or the per-thread working memory.
void DetectFastCorners(const cv::Mat& image, int threshold, int border, std::vector<Corner>* corners,
                       std::vector<int>* row_begin);

}  // namespace docent::engine
