// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core/mat.hpp>

namespace docent::engine {

// The thumbnail of an image for place recognition and for estimating the rotation between similar views:
// subsampled, blurred, mean removed (ptamm §3.2). `pixels` is CV_32FC1, at most 80 wide; `scale` is in image
// pixels per thumbnail pixel.
struct SmallBlurryImage {
  cv::Mat pixels;
  int scale = 8;
};

// gray: CV_8UC1. blur_sigma_px: standard deviation of the blur in thumbnail pixels.
inline constexpr double kThumbnailBlurPx = 2.5;
SmallBlurryImage MakeSmallBlurryImage(const cv::Mat& gray, double blur_sigma_px = kThumbnailBlurPx);
// The same into *result, whose memory is reused if it has no other owner.
void MakeSmallBlurryImage(const cv::Mat& gray, double blur_sigma_px, SmallBlurryImage* result);

// Mean squared difference of two zero-mean thumbnails of equal size (grey values squared); infinite if the
// sizes differ.
double Difference(const SmallBlurryImage& a, const SmallBlurryImage& b);

}  // namespace docent::engine
