// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <opencv2/core/mat.hpp>

#include "ui/gl_objects.h"
#include "ui/inset.h"
#include "ui/letterbox.h"

namespace docent::ui {

// The finished image on the graphics card. Framebuffer row 0 is the top of the image. Single thread, single
// context.
class ImageTarget {
 public:
  ImageTarget();
  // Resizes the target and binds it for drawing. Its contents are lost when the size changes.
  RenderTarget& Bind(int width_px, int height_px);
  // Fills the bound target with a video image (CV_8UC3 BGR or CV_8UC1) of any size; an empty image gives a
  // dark background. An image of the target's size keeps its exact pixel values.
  void DrawVideo(const cv::Mat& image);
  // Fills the bound target with black.
  void DrawBlack();
  // Copies the image of another target, which is as large as the `inset` rectangle, to that place, and binds
  // this one for drawing.
  void CopyInto(const ImageTarget& other, const Inset& inset);
  // Draws a second image into the `inset` rectangle of the target; an empty image draws nothing.
  void DrawInset(const cv::Mat& image, const Inset& inset);
  // Copies the target to *image as CV_8UC3 (BGR) and reuses its memory if it fits. *image is empty before the
  // first Bind.
  void ReadBack(cv::Mat* image) const;
  // Makes this target a copy of another one's image and binds it for drawing. Without an image in the other
  // one, nothing happens.
  void CopyFrom(const ImageTarget& other);
  // Copies the target to a part of the default framebuffer, centred and as large as fits; the rest of the
  // part becomes black. (x, y) is the part's upper left corner in a window of this height.
  // `smooth`: pixels are interpolated, which costs more.
  void Present(int x, int y, int width_px, int height_px, int window_height_px, bool smooth = true) const;
  // The texture of the image that was drawn last, whose colours are in the order of its bytes; 0 for none.
  GLuint video() const { return video_width_px_ > 0 ? video_.name() : 0; }
  bool empty() const { return target_ == nullptr; }
  // Zero before the first Bind.
  int width_px() const { return target_ == nullptr ? 0 : target_->width_px(); }
  int height_px() const { return target_ == nullptr ? 0 : target_->height_px(); }

 private:
  // Draws a CV_8UC3 or CV_8UC1 image into the current viewport, which is `area`.
  void DrawImage(const cv::Mat& image, const Inset& area);

  std::unique_ptr<RenderTarget> target_;
  GlProgram video_program_;
  GlVertexArray empty_vertex_array_;
  GlTexture video_;
  int video_width_px_ = 0, video_height_px_ = 0, video_channels_ = 0;
};

}  // namespace docent::ui
