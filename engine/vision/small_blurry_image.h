// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core/mat.hpp>

namespace docent::engine {

// An image's thumbnail for recognising places and for estimating rotation between neighbours: subsampled
// and blurred, mean removed (ptamm §3.2). `pixels` is CV_32FC1, at most 80 wide; `scale` is image pixels a
// thumbnail pixel.
struct SmallBlurryImage {
  cv::Mat pixels;
  int scale = 8;
};

// gray: CV_8UC1. blur_sigma_px is in thumbnail pixels.
inline constexpr double kThumbnailBlurPx = 2.5;
SmallBlurryImage MakeSmallBlurryImage(const cv::Mat& gray, double blur_sigma_px = kThumbnailBlurPx);
// The same into *result, whose memory is used again when nobody else holds it.
void MakeSmallBlurryImage(const cv::Mat& gray, double blur_sigma_px, SmallBlurryImage* result);

// Mean squared difference of two thumbnails of equal size, zero-mean (grey values squared); infinite when
// the sizes differ.
double Difference(const SmallBlurryImage& a, const SmallBlurryImage& b);

}  // namespace docent::engine
