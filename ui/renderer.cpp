// SPDX-License-Identifier: Apache-2.0
#include "ui/renderer.h"

#include <algorithm>

#include "ui/canvas.h"
#include "ui/content_layer.h"
#include "ui/figures.h"
#include "ui/heads_up.h"
#include "ui/image_target.h"
#include "ui/label_board.h"
#include "ui/letterbox.h"
#include "ui/video_exposure.h"
#include "ui/visitor_display.h"

namespace docent::ui {

namespace {

// The pose that the content is drawn from; null for none.
const engine::Rigid3* DrawnFrom(const View& view) {
  if (view.camera == nullptr) return nullptr;
  const bool has_pose = view.tracked != nullptr && engine::HasPose(view.tracked->state);
  return has_pose ? &view.tracked->camera_from_map : view.held_camera_from_map;
}

}  // namespace

struct Renderer::Impl {
  explicit Impl(const RendererOptions& options)
      : language(options.language), content(options.samples, options.max_texture_px, options.language) {}

  // Draws labels and heads-up display into a canvas that shows the image in this part of it.
  void DrawTexts(const View& view, const HeadsUpStyle& style, const Letterbox& box, Canvas* target) const {
    const engine::Rigid3* const from = DrawnFrom(view);
    if (from != nullptr && view.scene != nullptr)
      DrawLabels(*view.scene, language, *view.camera, *from, box, view.faint, target);
    HeadsUpStyle above = style;
    if (!view.overlay.caption.empty()) {
      const double lowest = target->height_px() - 12 * style.unit_px - style.bottom_px;
      const double top = DrawSentence(view.overlay.caption, 18, lowest, style.unit_px, target);
      above.bottom_px += lowest - top + 6 * style.unit_px;
    }
    DrawHeadsUp(view, above, target);
  }

  const std::string language;

  // Over the video, whose target is bound.
  void DrawViews(const VisitorDisplay& visitor) {
    const std::vector<Inset> areas = PlaceViews(visitor, image.width_px(), image.height_px());
    for (std::size_t i = 0; i < areas.size(); ++i) image.DrawInset(visitor.views[i], areas[i]);
  }

  ImageTarget image;
  ImageTarget copy;  // With the heads-up display, for ReadBackWithHeadsUp.
  ContentLayer content;
  VideoExposure exposure;
  Canvas canvas;
  Canvas window_canvas;
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
  const engine::Rigid3* const drawn_from = DrawnFrom(view);
  if (drawn_from != nullptr && view.scene != nullptr) {
    ContentLayer::What what;
    what.animation_seconds = view.animation_seconds;
    what.markers = view.overlay.markers;
    what.faint = view.faint;
    what.surfaces = view.surfaces;
    what.occluders = view.occluders;
    what.light.room = view.light;
    if (view.follows_exposure) what.light.exposure = impl_->exposure.Update(tracked);
    what.shadows = view.shadows;
    if (image.cols == width_px && image.rows == height_px) what.video = impl_->image.video();
    impl_->content.Draw(*view.camera, *drawn_from, *view.scene, what, target);
  }

  impl_->canvas.Begin(width_px, height_px);
  if (has_pose && view.overlay.keyframes && tracked->map != nullptr)
    DrawKeyFrames(*tracked->map, *view.camera, tracked->camera_from_map, &impl_->canvas);
  if (tracked != nullptr && view.overlay.points) DrawPoints(*tracked, &impl_->canvas);
  if (view.overlay.hud)
    impl_->DrawTexts(view, HeadsUpStyleFor(height_px), FitImage(width_px, height_px, width_px, height_px),
                     &impl_->canvas);
  target.BindForDrawing();
  impl_->canvas.End();
  if (view.overlay.visitor) impl_->DrawViews(*view.overlay.visitor);
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
  impl_->image.Present(0, 0, width_px, height_px, height_px);
}

void Renderer::PresentWithHeadsUp(const View& view, const WindowPart& part, double unit_px,
                                  double bottom_px) {
  impl_->image.Present(part.x, part.y, part.width_px, part.height_px, part.window_height_px);
  if (!view.overlay.hud) return;
  Canvas& canvas = impl_->window_canvas;
  canvas.Begin(part.width_px, part.height_px, true);
  const int image_width = std::max(1, impl_->image.width_px()),
            image_height = std::max(1, impl_->image.height_px());
  impl_->DrawTexts(view, {unit_px, bottom_px},
                   FitImage(image_width, image_height, part.width_px, part.height_px), &canvas);
  glViewport(part.x, part.window_height_px - part.y - part.height_px, part.width_px, part.height_px);
  canvas.End();
}

void Renderer::ReadBack(cv::Mat* image) {
  impl_->image.ReadBack(image);
}

void Renderer::ReadBackWithHeadsUp(const View& view, cv::Mat* image) {
  if (!view.overlay.hud || impl_->image.empty()) return ReadBack(image);
  impl_->copy.CopyFrom(impl_->image);
  impl_->canvas.Begin(impl_->copy.width_px(), impl_->copy.height_px());
  const int width_px = impl_->copy.width_px(), height_px = impl_->copy.height_px();
  impl_->DrawTexts(view, HeadsUpStyleFor(height_px), FitImage(width_px, height_px, width_px, height_px),
                   &impl_->canvas);
  impl_->canvas.End();
  impl_->copy.ReadBack(image);
}

}  // namespace docent::ui
