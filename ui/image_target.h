// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <opencv2/core/mat.hpp>

#include "ui/gl_objects.h"
#include "ui/inset.h"
#include "ui/letterbox.h"

namespace docent::ui {

// The finished image on the graphics card: row 0 is its top. One thread, one context.
class ImageTarget {
 public:
  ImageTarget();
  // Of this size and bound for drawing; what it held is lost when the size changes.
  RenderTarget& Bind(int width_px, int height_px);
  // Fills the bound target with a video image, CV_8UC3 (BGR) or CV_8UC1, any size; an empty one gives a
  // dark plain. An image of the target's size keeps its exact values.
  void DrawVideo(const cv::Mat& image);
  // A second image, drawn small into a part of the target; an empty one draws nothing.
  void DrawInset(const cv::Mat& image, const Inset& inset);
  // CV_8UC3 (BGR); reuses the memory of *image when it fits. Empty before the first Bind.
  void ReadBack(cv::Mat* image) const;
  // Into the default framebuffer, as large as fits and in the middle, black around it.
  void Present(int width_px, int height_px) const;

 private:
  // CV_8UC3 or CV_8UC1 into the viewport that is set.
  void DrawImage(const cv::Mat& image, const Inset& area);

  std::unique_ptr<RenderTarget> target_;
  GlProgram video_program_;
  GlVertexArray empty_vertex_array_;
  GlTexture video_;
  int video_width_px_ = 0, video_height_px_ = 0, video_channels_ = 0;
};

}  // namespace docent::ui
