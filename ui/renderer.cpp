// SPDX-License-Identifier: Apache-2.0
#include "ui/renderer.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "ui/canvas.h"
#include "ui/card_targets.h"
#include "ui/card_view.h"
#include "ui/content_layer.h"
#include "ui/figures.h"
#include "ui/heads_up.h"
#include "ui/image_degradation.h"
#include "ui/image_target.h"
#include "ui/label_board.h"
#include "ui/letterbox.h"
#include "ui/theme.h"
#include "ui/video_exposure.h"
#include "ui/visitor_display.h"

namespace docent::ui {

namespace {

constexpr double kCaptionUnits = 18;  // The size of the captions of sounds; see HeadsUpStyle.

// The pose that the content is drawn from; null for none.
const engine::Rigid3* DrawnFrom(const View& view) {
  if (view.camera == nullptr) return nullptr;
  if (view.seen_from_map != nullptr) return view.seen_from_map;
  const bool has_pose = view.tracked != nullptr && engine::HasPose(view.tracked->state);
  return has_pose ? &view.tracked->camera_from_map : view.held_camera_from_map;
}

// The lens as it is seen in an image of another size.
engine::CameraModel ScaledTo(const engine::CameraModel& camera, int width_px, int height_px) {
  engine::CameraModel::Intrinsics scaled = camera.intrinsics();
  const double across = static_cast<double>(width_px) / scaled.width_px,
               down = static_cast<double>(height_px) / scaled.height_px;
  scaled.width_px = width_px;
  scaled.height_px = height_px;
  scaled.fx *= across;
  scaled.fy *= down;
  // The centre of the first pixel is at 0.
  scaled.cx = across * (scaled.cx + 0.5) - 0.5;
  scaled.cy = down * (scaled.cy + 0.5) - 0.5;
  return {camera.lens(), scaled, camera.distortion()};
}

}  // namespace

struct Renderer::Impl {
  explicit Impl(const RendererOptions& options)
      : language(options.language),
        max_texture_px(options.max_texture_px),
        content(options.samples, options.max_texture_px, options.language),
        card_model(options.samples, options.max_texture_px) {}

  // Draws the model of the view's card for a canvas of this size, before the canvas is drawn.
  void PrepareCard(const View& view, int width_px, int height_px, const HeadsUpStyle& style) {
    card_texture = 0;
    if (!view.overlay.hud || !view.overlay.visitor || !view.overlay.visitor->card) return;
    const Area shown = LayOutCard(view.overlay, width_px, height_px, style).shown;
    card_texture = card_model.Draw(*view.overlay.visitor->card, static_cast<int>(shown.width),
                                   static_cast<int>(shown.height));
  }

  // Draws labels and heads-up display into a canvas that shows the image in this part of it.
  void DrawTexts(const View& view, const HeadsUpStyle& style, const Letterbox& box, Canvas* target) {
    card_targets.clear();
    label_areas.clear();
    const bool has_card = view.overlay.visitor && view.overlay.visitor->card;
    const double lowest = target->height_px() - 12 * style.unit_px - style.bottom_px;
    const Eigen::AlignedBox2d caption =
        SentencePanel(view.overlay.caption, kCaptionUnits, lowest, style.unit_px, target);
    HeadsUpStyle above = style;
    if (!caption.isEmpty()) above.bottom_px += lowest - caption.min().y() + 6 * style.unit_px;
    std::vector<DrawnBoard> boards;
    const engine::Rigid3* const from = DrawnFrom(view);
    if (from != nullptr && view.scene != nullptr) {
      std::vector<Eigen::AlignedBox2d> taken;
      if (view.overlay.visitor && !has_card) taken = TakenByVisitorDisplay(view, above, target);
      if (!caption.isEmpty() && !has_card) taken.push_back(caption);
      // An image that is small in its window makes texts small that a visitor is to read.
      const double least_px = view.overlay.visitor ? kNormalTextUnits * style.unit_px : 0;
      const LabelView labels{*view.camera, *from, box, language, view.faint, taken, least_px};
      boards = DrawLabels(*view.scene, labels, target);
      if (!view.overlay.visitor) label_areas = AreasOfLabels(*view.scene, labels, boards);
    }
    if (view.overlay.visitor) card_targets = MovedToBoards(view.overlay.visitor->targets, boards, box);
    if (has_card) return DrawCardWithTexts(view, style, target);
    DrawInsetText(view, style, box, target);
    DrawSentence(view.overlay.caption, kCaptionUnits, lowest, style.unit_px, target);
    if (!view.overlay.visitor || boards.empty()) return DrawHeadsUp(view, above, target);
    View moved = view;
    moved.overlay.visitor->targets = card_targets;
    DrawHeadsUp(moved, above, target);
  }

  // A card covers the other texts, except those of sounds and faults.
  void DrawCardWithTexts(const View& view, const HeadsUpStyle& style, Canvas* target) const {
    const double unit = style.unit_px, lowest = target->height_px() - 12 * unit - style.bottom_px;
    const double above = DrawSentence(view.overlay.message, 15, lowest, unit, target) - 6 * unit;
    DrawSentence(view.overlay.caption, kCaptionUnits, above, unit, target);
    DrawCard(view.overlay, style, card_texture, target);
  }

  const std::string language;
  const int max_texture_px;

  // The other camera's image with its content.
  void DrawInset(const View& view, const Inset& inset) {
    const engine::TrackedFrame& other = *view.overlay.inset;
    image.DrawInset(other.frame.image, inset);
    if (view.overlay.inset_scene == nullptr || view.overlay.inset_camera == nullptr ||
        !engine::HasPose(other.state))
      return;
    if (!inset_content) inset_content = std::make_unique<ContentLayer>(1, max_texture_px, language);
    const RenderTarget& target = inset_image.Bind(inset.width, inset.height);
    inset_image.DrawVideo(other.frame.image);
    inset_content->Draw(
        ScaledTo(*view.overlay.inset_camera, inset.width, inset.height), other.camera_from_map,
        *view.overlay.inset_scene,
        {.animation_seconds = view.animation_seconds, .animation_starts = view.animation_starts}, target);
    image.CopyInto(inset_image, inset);
  }
  // Where the other camera is, in words below its image.
  static void DrawInsetText(const View& view, const HeadsUpStyle& style, const Letterbox& box,
                            Canvas* target) {
    if (view.overlay.inset == nullptr || view.overlay.inset_text.empty() || view.camera == nullptr) return;
    const cv::Mat& other = view.overlay.inset->frame.image;
    if (other.empty()) return;
    const Inset inset = PlaceInset(view.camera->width_px(), view.camera->height_px(), other.cols, other.rows);
    TextStyle text;
    text.size_px = 15 * style.unit_px;
    text.max_width_px = std::max(40, static_cast<int>(box.scale * inset.width));
    text.max_height_px = static_cast<int>(60 * style.unit_px);
    text.color = theme::kText;
    const Eigen::Vector2d below = box.WindowFromImage({inset.x - 0.5, inset.y + inset.height + 1.5});
    const Eigen::Vector2d size = target->Measure(view.overlay.inset_text, text);
    const Eigen::Vector2d padding(6 * style.unit_px, 3 * style.unit_px);
    const Eigen::Vector2d corner = below + Eigen::Vector2d(0, 4 * style.unit_px);
    target->Box(corner, corner + size + 2 * padding, 5 * style.unit_px, theme::kHeadsUp);
    target->Text(view.overlay.inset_text, text, corner + padding);
  }

  // Over the video, whose target is bound.
  void DrawViews(const VisitorDisplay& visitor) {
    const std::vector<Inset> areas = PlaceViews(visitor, image.width_px(), image.height_px());
    for (std::size_t i = 0; i < areas.size(); ++i) image.DrawInset(visitor.views[i].image, areas[i]);
  }

  // The camera that sees the view's image at the size in which it is drawn.
  const engine::CameraModel& DrawnCamera(const engine::CameraModel& camera, int width_px, int height_px) {
    if (camera.width_px() == width_px && camera.height_px() == height_px) return camera;
    if (!scaled_from || !(*scaled_from == camera) || scaled.width_px() != width_px) {
      scaled_from = camera;
      scaled = ScaledTo(camera, width_px, height_px);
    }
    return scaled;
  }

  double scale = 1;  // Of the drawn image; see SetQuality.
  bool smooth = true;
  std::optional<engine::CameraModel> scaled_from;
  engine::CameraModel scaled;
  ImageTarget image;
  ImageTarget copy;  // With the heads-up display, for ReadBackWithHeadsUp.
  ContentLayer content;
  ImageTarget inset_image;
  std::unique_ptr<ContentLayer> inset_content;  // Made for the first inset with content.
  std::vector<CardTarget> card_targets;
  std::vector<LabelArea> label_areas;
  CardModel card_model;
  GLuint card_texture = 0;
  VideoExposure exposure;
  DegradationEstimator degradation;
  Canvas canvas;
  Canvas window_canvas;
};

Renderer::Renderer(const RendererOptions& options) : impl_(std::make_unique<Impl>(options)) {}

Renderer::~Renderer() = default;

void Renderer::Draw(const View& view) {
  const engine::TrackedFrame* tracked = view.tracked;
  const cv::Mat image = tracked != nullptr ? tracked->frame.image : cv::Mat();
  const int camera_width = view.camera != nullptr ? view.camera->width_px() : image.cols;
  const int camera_height = view.camera != nullptr ? view.camera->height_px() : image.rows;
  if (camera_width < 1 || camera_height < 1) return;
  const int width_px = std::max(1, static_cast<int>(std::lround(impl_->scale * camera_width)));
  const int height_px = std::max(1, static_cast<int>(std::lround(impl_->scale * camera_height)));

  impl_->PrepareCard(view, camera_width, camera_height, HeadsUpStyleFor(camera_height));
  const RenderTarget& target = impl_->image.Bind(width_px, height_px);
  if (view.shows_video) {
    impl_->image.DrawVideo(image);
  } else {
    impl_->image.DrawBlack();
  }
  const bool has_pose = view.camera != nullptr && tracked != nullptr && engine::HasPose(tracked->state);
  const engine::Rigid3* const drawn_from = DrawnFrom(view);
  if (drawn_from != nullptr && view.scene != nullptr) {
    ContentLayer::What what;
    what.animation_seconds = view.animation_seconds;
    what.animation_starts = view.animation_starts;
    what.markers = view.overlay.markers;
    what.faint = view.faint;
    what.surfaces = view.surfaces;
    what.occluders = view.occluders;
    what.light.room = view.light;
    if (view.follows_exposure) what.light.exposure = impl_->exposure.Update(tracked);
    if (view.follows_degradation && view.shows_video) {
      what.degradation = impl_->degradation.Update(tracked);
      what.degradation.shading = static_cast<float>(impl_->exposure.shading());
      what.degradation.shading_reference = static_cast<float>(impl_->exposure.shading_reference());
      what.camera_pixel = impl_->scale;
    }
    what.shadows = view.shadows;
    if (!image.empty() && view.shows_video) what.video = impl_->image.video();
    impl_->content.Draw(impl_->DrawnCamera(*view.camera, width_px, height_px), *drawn_from, *view.scene, what,
                        target);
  }

  // In the camera's pixels, whatever the size of the target.
  impl_->canvas.Begin(camera_width, camera_height);
  if (has_pose && view.overlay.keyframes && tracked->map != nullptr)
    DrawKeyFrames(*tracked->map, *view.camera, tracked->camera_from_map, &impl_->canvas);
  if (tracked != nullptr && view.overlay.points) DrawPoints(*tracked, &impl_->canvas);
  if (view.overlay.hud)
    impl_->DrawTexts(view, HeadsUpStyleFor(camera_height),
                     FitImage(camera_width, camera_height, camera_width, camera_height), &impl_->canvas);
  target.BindForDrawing();
  impl_->canvas.End();
  if (view.overlay.visitor) impl_->DrawViews(*view.overlay.visitor);
  if (view.overlay.inset == nullptr || view.overlay.inset->frame.image.empty()) return;
  const cv::Mat& other = view.overlay.inset->frame.image;
  const Inset inset = PlaceInset(width_px, height_px, other.cols, other.rows);
  impl_->DrawInset(view, inset);
  impl_->canvas.Begin(width_px, height_px);
  DrawInsetFrame(*view.overlay.inset, inset, &impl_->canvas);
  target.BindForDrawing();
  impl_->canvas.End();
}

void Renderer::SetQuality(int samples, double scale, bool smooth) {
  impl_->scale = scale;
  impl_->smooth = smooth;
  impl_->content.SetSamples(samples);
}

void Renderer::Present(int width_px, int height_px) {
  impl_->image.Present(0, 0, width_px, height_px, height_px);
}

void Renderer::PresentWithHeadsUp(const View& view, const WindowPart& part, const HeadsUpStyle& style) {
  impl_->PrepareCard(view, part.width_px, part.height_px, style);
  impl_->image.Present(part.x, part.y, part.width_px, part.height_px, part.window_height_px, impl_->smooth);
  if (!view.overlay.hud) return;
  Canvas& canvas = impl_->window_canvas;
  canvas.Begin(part.width_px, part.height_px, true);
  const int image_width = view.camera != nullptr ? view.camera->width_px() : impl_->image.width_px(),
            image_height = view.camera != nullptr ? view.camera->height_px() : impl_->image.height_px();
  impl_->DrawTexts(
      view, style,
      FitImage(std::max(1, image_width), std::max(1, image_height), part.width_px, part.height_px), &canvas);
  glViewport(part.x, part.window_height_px - part.y - part.height_px, part.width_px, part.height_px);
  canvas.End();
}

const std::vector<CardTarget>& Renderer::card_targets() const {
  return impl_->card_targets;
}

const std::vector<LabelArea>& Renderer::label_areas() const {
  return impl_->label_areas;
}

void Renderer::ReadBack(cv::Mat* image) {
  impl_->image.ReadBack(image);
}

void Renderer::ReadBackWithHeadsUp(const View& view, cv::Mat* image) {
  if (!view.overlay.hud || impl_->image.empty()) return ReadBack(image);
  const int image_height = impl_->image.height_px();
  impl_->PrepareCard(view, impl_->image.width_px(), image_height, HeadsUpStyleFor(image_height));
  impl_->copy.CopyFrom(impl_->image);
  impl_->canvas.Begin(impl_->copy.width_px(), impl_->copy.height_px());
  const int width_px = impl_->copy.width_px(), height_px = impl_->copy.height_px();
  impl_->DrawTexts(view, HeadsUpStyleFor(height_px), FitImage(width_px, height_px, width_px, height_px),
                   &impl_->canvas);
  impl_->canvas.End();
  impl_->copy.ReadBack(image);
}

}  // namespace docent::ui
