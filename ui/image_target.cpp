// SPDX-License-Identifier: Apache-2.0
#include "ui/image_target.h"

#include "ui/shaders.h"

namespace docent::ui {

ImageTarget::ImageTarget() : video_program_("video", kFullScreenVertexShader, kVideoFragmentShader) {
  video_program_.AssignTextureUnits({"video"});
}

RenderTarget& ImageTarget::Bind(int width_px, int height_px) {
  if (target_ == nullptr || target_->width_px() != width_px || target_->height_px() != height_px)
    target_ = std::make_unique<RenderTarget>(width_px, height_px, 1, false);
  target_->BindForDrawing();
  return *target_;
}

namespace {

bool IsUsable(const cv::Mat& image) {
  return !image.empty() && (image.type() == CV_8UC3 || image.type() == CV_8UC1);
}

}  // namespace

void ImageTarget::DrawVideo(const cv::Mat& image) {
  if (!IsUsable(image)) {
    glClearColor(0.08f, 0.09f, 0.11f, 1.0f);
    glClear(GL_COLOR_BUFFER_BIT);
    return;
  }
  DrawImage(image, {0, 0, target_->width_px(), target_->height_px()});
}

void ImageTarget::DrawBlack() {
  glClearColor(0.0f, 0.0f, 0.0f, 1.0f);
  glClear(GL_COLOR_BUFFER_BIT);
}

void ImageTarget::CopyInto(const ImageTarget& other, const Inset& inset) {
  if (target_ == nullptr || other.target_ == nullptr) return;
  target_->BindForDrawing();
  glBindFramebuffer(GL_READ_FRAMEBUFFER, other.target_->readable_framebuffer());
  // Row 0 of both is the top.
  glBlitFramebuffer(0, 0, inset.width, inset.height, inset.x, inset.y, inset.x + inset.width,
                    inset.y + inset.height, GL_COLOR_BUFFER_BIT, GL_NEAREST);
  target_->BindForDrawing();
}

void ImageTarget::DrawInset(const cv::Mat& image, const Inset& inset) {
  if (target_ == nullptr || !IsUsable(image)) return;
  target_->BindForDrawing();
  glViewport(inset.x, inset.y, inset.width, inset.height);
  DrawImage(image, inset);
  glViewport(0, 0, target_->width_px(), target_->height_px());
}

void ImageTarget::DrawImage(const cv::Mat& image, const Inset& area) {
  const int channels = image.channels();
  // OpenGL's row length is a whole number of pixels, so an image whose row step is not (which is rare) is
  // copied first.
  const cv::Mat source = image.step % image.elemSize() == 0 ? image : image.clone();
  glActiveTexture(GL_TEXTURE0);
  glBindTexture(GL_TEXTURE_2D, video_.name());
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glPixelStorei(GL_UNPACK_ROW_LENGTH, static_cast<GLint>(source.step / source.elemSize()));
  // The bytes stay in BGR order: the shader swaps the channels, which costs less than a conversion in the
  // driver.
  const GLenum format = channels == 3 ? GL_RGB : GL_RED;
  if (video_width_px_ == source.cols && video_height_px_ == source.rows && video_channels_ == channels) {
    glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, source.cols, source.rows, format, GL_UNSIGNED_BYTE, source.data);
  } else {
    glTexImage2D(GL_TEXTURE_2D, 0, channels == 3 ? GL_RGB8 : GL_R8, source.cols, source.rows, 0, format,
                 GL_UNSIGNED_BYTE, source.data);
    for (const GLenum filter : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER})
      glTexParameteri(GL_TEXTURE_2D, filter, GL_LINEAR);
    for (const GLenum direction : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T})
      glTexParameteri(GL_TEXTURE_2D, direction, GL_CLAMP_TO_EDGE);
    video_width_px_ = source.cols;
    video_height_px_ = source.rows;
    video_channels_ = channels;
  }
  glPixelStorei(GL_UNPACK_ROW_LENGTH, 0);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
  video_program_.Use();
  glUniform2i(video_program_.Uniform("target_origin"), area.x, area.y);
  glUniform2i(video_program_.Uniform("target_size"), area.width, area.height);
  glUniform1i(video_program_.Uniform("is_gray"), channels == 1);
  glBindVertexArray(empty_vertex_array_.name());
  glDisable(GL_BLEND);
  DrawFullScreenTriangle();
}

void ImageTarget::ReadBack(cv::Mat* image) const {
  if (target_ == nullptr) {
    image->release();
    return;
  }
  image->create(target_->height_px(), target_->width_px(), CV_8UC3);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, target_->readable_framebuffer());
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glPixelStorei(GL_PACK_ROW_LENGTH, static_cast<GLint>(image->step / image->elemSize()));
  glReadPixels(0, 0, target_->width_px(), target_->height_px(), GL_BGR, GL_UNSIGNED_BYTE, image->data);
  glPixelStorei(GL_PACK_ROW_LENGTH, 0);
  glPixelStorei(GL_PACK_ALIGNMENT, 4);
}

void ImageTarget::CopyFrom(const ImageTarget& other) {
  if (other.target_ == nullptr) return;
  const int width_px = other.target_->width_px(), height_px = other.target_->height_px();
  Bind(width_px, height_px);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, other.target_->readable_framebuffer());
  glBlitFramebuffer(0, 0, width_px, height_px, 0, 0, width_px, height_px, GL_COLOR_BUFFER_BIT, GL_NEAREST);
  target_->BindForDrawing();
}

void ImageTarget::Present(int x, int y, int width_px, int height_px, int window_height_px,
                          bool smooth) const {
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, 0);
  // OpenGL's origin is at the bottom left.
  const int bottom = window_height_px - y - height_px;
  glViewport(x, bottom, width_px, height_px);
  glEnable(GL_SCISSOR_TEST);
  glScissor(x, bottom, width_px, height_px);
  glClearColor(0.0f, 0.0f, 0.0f, 1.0f);
  glClear(GL_COLOR_BUFFER_BIT);
  glDisable(GL_SCISSOR_TEST);
  if (target_ == nullptr || width_px < 1 || height_px < 1) return;
  const Letterbox box = FitImage(target_->width_px(), target_->height_px(), width_px, height_px);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, target_->readable_framebuffer());
  // Row 0 is the bottom of the window but the top of the image.
  const int top = window_height_px - y - box.y;
  glBlitFramebuffer(0, 0, target_->width_px(), target_->height_px(), x + box.x, top, x + box.x + box.width,
                    top - box.height, GL_COLOR_BUFFER_BIT, smooth ? GL_LINEAR : GL_NEAREST);
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
}

}  // namespace docent::ui
