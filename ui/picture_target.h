// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <opencv2/core/mat.hpp>

#include "ui/gl_objects.h"
#include "ui/inset.h"
#include "ui/letterbox.h"

namespace docent::ui {

// The finished picture on the graphics card: row 0 is its top. One thread, one context.
class PictureTarget {
 public:
  PictureTarget();
  // Of this size and bound for drawing; what it held is lost when the size changes.
  RenderTarget& Bind(int width_px, int height_px);
  // Fills the bound target with a video picture, CV_8UC3 (BGR) or CV_8UC1, any size; an empty one gives a
  // dark plain. A picture of the target's size keeps its exact values.
  void DrawVideo(const cv::Mat& picture);
  // A second picture, drawn small into a part of the target; an empty one draws nothing.
  void DrawInset(const cv::Mat& picture, const Inset& inset);
  // CV_8UC3 (BGR); reuses the memory of *picture when it fits. Empty before the first Bind.
  void ReadBack(cv::Mat* picture) const;
  // Into the default framebuffer, as large as fits and in the middle, black around it.
  void Present(int width_px, int height_px) const;

 private:
  // CV_8UC3 or CV_8UC1 into the viewport that is set.
  void DrawPicture(const cv::Mat& picture, const Inset& area);

  std::unique_ptr<RenderTarget> target_;
  GlProgram video_program_;
  GlVertexArray empty_vertex_array_;
  GlTexture video_;
  int video_width_px_ = 0, video_height_px_ = 0, video_channels_ = 0;
};

}  // namespace docent::ui
