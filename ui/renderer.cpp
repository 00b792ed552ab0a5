// SPDX-License-Identifier: Apache-2.0
#include "ui/renderer.h"

#include "ui/canvas.h"
#include "ui/content_layer.h"
#include "ui/heads_up.h"
#include "ui/image_target.h"

namespace docent::ui {

struct Renderer::Impl {
  explicit Impl(const RendererOptions& options) : content(options.samples, options.max_texture_px) {}

  ImageTarget image;
  ContentLayer content;
  Canvas canvas;
};

Renderer::Renderer(const RendererOptions& options) : impl_(std::make_unique<Impl>(options)) {}

Renderer::~Renderer() = default;

void Renderer::Draw(const View& view) {
  const engine::TrackedFrame* tracked = view.tracked;
  const cv::Mat image = tracked != nullptr ? tracked->frame.image : cv::Mat();
  const int width_px = view.camera != nullptr ? view.camera->width_px() : image.cols;
  const int height_px = view.camera != nullptr ? view.camera->height_px() : image.rows;
  if (width_px < 1 || height_px < 1) return;

  const RenderTarget& target = impl_->image.Bind(width_px, height_px);
  impl_->image.DrawVideo(image);
  const bool has_pose = view.camera != nullptr && tracked != nullptr && engine::HasPose(tracked->state);
  if (has_pose && view.scene != nullptr)
    impl_->content.Draw(*view.camera, tracked->camera_from_map, *view.scene, view.animation_seconds, target);

  impl_->canvas.Begin(width_px, height_px);
  if (has_pose && view.overlay.keyframes && tracked->map != nullptr)
    DrawKeyFrames(*tracked->map, *view.camera, tracked->camera_from_map, &impl_->canvas);
  if (tracked != nullptr && view.overlay.points) DrawPoints(*tracked, &impl_->canvas);
  if (view.overlay.hud) DrawHeadsUp(view, &impl_->canvas);
  target.BindForDrawing();
  impl_->canvas.End();
  if (view.overlay.inset == nullptr || view.overlay.inset->frame.image.empty()) return;
  const cv::Mat& other = view.overlay.inset->frame.image;
  const Inset inset = PlaceInset(width_px, height_px, other.cols, other.rows);
  impl_->image.DrawInset(other, inset);
  impl_->canvas.Begin(width_px, height_px);
  DrawInsetFrame(*view.overlay.inset, inset, &impl_->canvas);
  target.BindForDrawing();
  impl_->canvas.End();
}

void Renderer::Present(int width_px, int height_px) {
  impl_->image.Present(width_px, height_px);
}

void Renderer::ReadBack(cv::Mat* image) {
  impl_->image.ReadBack(image);
}

}  // namespace docent::ui
