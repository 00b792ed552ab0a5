// SPDX-License-Identifier: Apache-2.0
#include "ui/card_view.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "ui/theme.h"

namespace docent::ui {

namespace {

constexpr double kCardView_rad = std::numbers::pi / 6;  // Of the smaller side; a model looks undistorted.
constexpr double kOwnTurn_rad_per_s = 0.5;              // Once around in twelve seconds.

Eigen::Vector3d Bound(const glm::vec3& v) {
  return {v.x, v.y, v.z};
}

// The largest of these sizes at which the whole text fits, else the smallest.
double FittingSize(const std::string& text, const Area& area, double unit, Canvas* canvas) {
  constexpr std::array<double, 5> kUnits = {26, 22, 20, 18, 16};
  for (const double units : kUnits) {
    TextStyle style;
    style.size_px = units * unit;
    style.max_width_px = std::max(40, static_cast<int>(area.width));
    style.max_height_px = 100'000;
    if (canvas->Measure(text, style).y() <= area.height) return style.size_px;
  }
  return kUnits.back() * unit;
}

void DrawCardText(const std::string& text, const Area& area, double size_px, bool at_right,
                  const Color& color, Canvas* canvas) {
  if (text.empty() || area.width < 1 || area.height < 1) return;
  TextStyle style;
  style.size_px = size_px;
  style.max_width_px = std::max(40, static_cast<int>(area.width));
  style.max_height_px = std::max(20, static_cast<int>(area.height));
  style.color = color;
  canvas->Text(text, style, {at_right ? area.right() : area.x, area.y}, at_right ? 1 : 0);
}

void DrawCross(const Area& area, double unit, Canvas* canvas) {
  const Eigen::Vector2d middle(area.x + 0.5 * area.width, area.y + 0.5 * area.height);
  canvas->Disk(middle, 0.5 * area.width, theme::kButton);
  const double reach = 0.2 * area.width;
  for (const double side : {-1.0, 1.0})
    canvas->Line(middle + Eigen::Vector2d(-reach, -side * reach),
                 middle + Eigen::Vector2d(reach, side * reach), 3 * unit, theme::kText);
}

}  // namespace

engine::Sim3 CardPose(const Card& card, double field_of_view_rad) {
  engine::Sim3 pose;
  const auto asset = card.shown ? card.shown->model.asset : nullptr;
  if (!asset || !asset->model) return pose;
  const Eigen::Vector3d low = Bound(asset->model->bounds_min), high = Bound(asset->model->bounds_max);
  const double radius = std::max(0.5 * (high - low).norm(), 1e-9);
  const bool turns = card.shown->kind == content::Entity::Kind::kModel;
  const Eigen::Vector2d turned =
      card.turned_rad ? *card.turned_rad : Eigen::Vector2d(turns ? kOwnTurn_rad_per_s * card.seconds : 0, 0);
  // The camera's y axis points down, and its z axis away from the viewer; a model's up is y, its front z.
  const engine::Rotation3 upright = engine::Rotation3::Exp(Eigen::Vector3d(std::numbers::pi, 0, 0));
  pose.rotation = engine::Rotation3::Exp(Eigen::Vector3d(turned.y(), 0, 0)) * upright *
                  engine::Rotation3::Exp(Eigen::Vector3d(0, turned.x(), 0));
  pose.scale = 1 / radius;
  const double distance = 1.05 / std::sin(0.5 * field_of_view_rad);
  pose.translation =
      Eigen::Vector3d(0, 0, distance) - pose.scale * (pose.rotation * Eigen::Vector3d(0.5 * (low + high)));
  return pose;
}

GLuint CardModel::Draw(const Card& card, int width_px, int height_px) {
  if (!card.shown || width_px < 1 || height_px < 1) return 0;
  if (!content_) content_ = std::make_unique<ContentLayer>(samples_, max_texture_px_, std::string());
  if (!target_ || target_->width_px() != width_px || target_->height_px() != height_px)
    target_ = std::make_unique<RenderTarget>(width_px, height_px, 1, false);
  target_->BindForDrawing();
  glClearColor(theme::kPanel.red, theme::kPanel.green, theme::kPanel.blue, 1.0f);
  glClear(GL_COLOR_BUFFER_BIT);
  const double focal = 0.5 * std::min(width_px, height_px) / std::tan(0.5 * kCardView_rad);
  const engine::CameraModel camera(
      engine::LensModel::kRadialTangential,
      {width_px, height_px, focal, focal, 0.5 * (width_px - 1), 0.5 * (height_px - 1)}, {});
  content::Scene alone;
  alone.entities = {*card.shown};
  alone.entities.front().hidden = false;
  alone.entities.front().model.warp.reset();
  alone.entities.front().model.map_from_model = CardPose(card, kCardView_rad);
  content_->Draw(camera, engine::Rigid3(), alone, {.animation_seconds = card.seconds}, *target_);
  return target_->texture();
}

void DrawCard(const Overlay& overlay, const HeadsUpStyle& style, GLuint texture, Canvas* canvas) {
  if (!overlay.visitor || !overlay.visitor->card) return;
  const VisitorDisplay& visitor = *overlay.visitor;
  const Card& card = *visitor.card;
  const double unit = style.unit_px;
  const CardLayout layout = LayOutCard(overlay, canvas->width_px(), canvas->height_px(), style);
  const Area& all = layout.card;
  canvas->Box({all.x, all.y}, {all.right(), all.bottom()}, 14 * unit, theme::kPanel);
  canvas->Box({all.x, all.y}, {all.right(), all.bottom()}, 14 * unit, theme::kBorder, 2 * unit);
  const Area& shown = layout.shown;
  if (texture != 0 && shown.width >= 1)
    canvas->Image(texture, {shown.x, shown.y}, {shown.right(), shown.bottom()});
  DrawCardText(card.text, layout.text, FittingSize(card.text, layout.text, unit, canvas),
               visitor.is_right_to_left, theme::kText, canvas);
  const double hint_px = 16 * unit;
  Area hint = layout.hint;
  hint.y += 8 * unit;
  DrawCardText(card.hint, hint, hint_px, visitor.is_right_to_left, theme::kMutedText, canvas);
  DrawCross(layout.close, unit, canvas);
}

}  // namespace docent::ui
