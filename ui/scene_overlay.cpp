// SPDX-License-Identifier: Apache-2.0
#include "ui/scene_overlay.h"

#include <imgui.h>

#include <algorithm>
#include <array>

#include "ui/theme.h"

namespace docent::ui {
namespace {

ImU32 Packed(const Color& color) {
  return ImGui::ColorConvertFloat4ToU32({color.red, color.green, color.blue, color.alpha});
}

ImVec2 At(const Eigen::Vector2d& point) {
  return {static_cast<float>(point.x()), static_cast<float>(point.y())};
}

Color ColorOf(GizmoPart part) {
  switch (part) {
    case GizmoPart::kMoveRight:
    case GizmoPart::kMoveAcrossRight:
    case GizmoPart::kTurnRight:
      return theme::kAxisRight;
    case GizmoPart::kMoveUp:
    case GizmoPart::kMoveAcrossUp:
    case GizmoPart::kTurnUp:
      return theme::kAxisUp;
    case GizmoPart::kMoveFront:
    case GizmoPart::kMoveAcrossFront:
    case GizmoPart::kTurnFront:
      return theme::kAxisFront;
    default:
      return theme::kText;
  }
}

// A text on a dark ground, inside the area. `point` is the middle of its lower edge.
void DrawTag(const Eigen::Vector2d& point, const std::string& text, const Area& area, double scale) {
  const ImVec2 size = ImGui::CalcTextSize(text.c_str());
  const Eigen::Vector2d padding = scale * Eigen::Vector2d(6, 3);
  const double width = size.x + 2 * padding.x(), height = size.y + 2 * padding.y();
  const Eigen::Vector2d low(
      std::clamp(point.x() - 0.5 * width, area.x, std::max(area.x, area.right() - width)),
      std::clamp(point.y() - height, area.y, std::max(area.y, area.bottom() - height)));
  ImDrawList* const list = ImGui::GetBackgroundDrawList();
  list->AddRectFilled(At(low), At(low + Eigen::Vector2d(width, height)), Packed(theme::kPanel),
                      static_cast<float>(4 * scale));
  list->AddText(At(low + padding), Packed(theme::kText), text.c_str());
}

}  // namespace

SceneOverlay::SceneOverlay(const GizmoCamera& camera, const Letterbox& box, const Area& image, double scale)
    : camera_(camera), box_(box), image_(image), scale_(scale) {
  const double right = box.x + box.width, bottom = box.y + box.height;
  ImGui::GetBackgroundDrawList()->PushClipRect(At({box.x + 0.0, box.y + 0.0}), At({right, bottom}));
}

SceneOverlay::~SceneOverlay() {
  ImGui::GetBackgroundDrawList()->PopClipRect();
}

void SceneOverlay::DrawLines(const GizmoLines& lines, const Color& color, double width) {
  ImDrawList* const list = ImGui::GetBackgroundDrawList();
  for (const auto& line : lines) {
    for (const Eigen::Vector2d& pixel : line) list->PathLineTo(At(box_.WindowFromImage(pixel)));
    list->PathStroke(Packed(color), 0, static_cast<float>(width * scale_));
  }
}

GizmoLines SceneOverlay::EdgesOf(const PlacedBox& placed, Eigen::AlignedBox2d* seen) const {
  constexpr int kSteps = 8;  // Lenses bend straight lines.
  const double far_px = camera_.lens.width_px() + camera_.lens.height_px();
  GizmoLines lines;
  for (int corner = 0; corner < 8; ++corner) {
    for (const int bit : {1, 2, 4}) {
      if ((corner & bit) != 0) continue;
      const Eigen::Vector3d from = placed.Corner(corner), to = placed.Corner(corner | bit);
      lines.emplace_back();
      for (int i = 0; i <= kSteps; ++i) {
        const double t = static_cast<double>(i) / kSteps;
        const auto pixel =
            camera_.lens.Project(camera_.camera_from_map * Eigen::Vector3d((1 - t) * from + t * to));
        if (!pixel || !camera_.lens.IsInside(*pixel, -far_px)) {
          lines.emplace_back();
          continue;
        }
        lines.back().push_back(*pixel);
        if (seen != nullptr) seen->extend(box_.WindowFromImage(*pixel));
      }
    }
  }
  return lines;
}

void SceneOverlay::DrawOutline(const PlacedBox& placed, const std::string& name, bool is_locked) {
  Eigen::AlignedBox2d seen;
  const GizmoLines lines = EdgesOf(placed, &seen);
  DrawNamed(lines, seen, name, is_locked);
}

void SceneOverlay::DrawOutline(const Eigen::AlignedBox2d& area, const std::string& name, bool is_locked) {
  const Eigen::Vector2d low = area.min(), high = area.max();
  DrawNamed({{low, {high.x(), low.y()}, high, {low.x(), high.y()}, low}},
            {box_.WindowFromImage(low), box_.WindowFromImage(high)}, name, is_locked);
}

void SceneOverlay::DrawNamed(const GizmoLines& lines, const Eigen::AlignedBox2d& seen,
                             const std::string& name, bool is_locked) {
  // A dark line below the bright one is seen on any image.
  DrawLines(lines, {0, 0, 0, 0.55f}, 3.5);
  DrawLines(lines, is_locked ? theme::kMutedText : theme::kSelection, 1.5);
  const Eigen::Vector2d low(box_.x, box_.y);
  const Eigen::AlignedBox2d image(low, low + Eigen::Vector2d(box_.width, box_.height));
  if (seen.intersects(image)) DrawTag({seen.center().x(), seen.min().y() - 6 * scale_}, name, image_, scale_);
}

void SceneOverlay::DrawBoundary(const Eigen::AlignedBox3d& bounds) {
  PlacedBox box;
  box.low = bounds.min();
  box.high = bounds.max();
  const GizmoLines lines = EdgesOf(box, nullptr);
  DrawLines(lines, {0, 0, 0, 0.4f}, 3);
  DrawLines(lines, theme::kAccentText, 1.2);
}

void SceneOverlay::DrawPair(const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                            const std::string& number) {
  const auto at = [&](const Eigen::Vector3d& point) {
    return camera_.lens.Project(camera_.camera_from_map * point);
  };
  const auto begin = at(from), end = at(to);
  ImDrawList* const list = ImGui::GetBackgroundDrawList();
  const auto radius = static_cast<float>(4.5 * scale_);
  if (begin && end) {
    DrawLines({{*begin, *end}}, {0, 0, 0, 0.55f}, 3.5);
    DrawLines({{*begin, *end}}, theme::kAccentText, 1.5);
  }
  if (end)
    list->AddCircle(At(box_.WindowFromImage(*end)), 1.6f * radius, Packed(theme::kAccentText), 0, 2.0f);
  if (!begin) return;
  const Eigen::Vector2d point = box_.WindowFromImage(*begin);
  list->AddCircleFilled(At(point), radius + 1, Packed({0, 0, 0, 0.7f}));
  list->AddCircleFilled(At(point), radius, Packed(theme::kText));
  DrawTag(point - Eigen::Vector2d(0, 10 * scale_), number, image_, scale_);
}

void SceneOverlay::DrawGizmo(const Gizmo& gizmo, GizmoPart highlighted) {
  std::vector<GizmoPart> parts = PartsOf(gizmo);
  std::reverse(parts.begin(), parts.end());  // Small handles are drawn over large ones.
  ImDrawList* const list = ImGui::GetBackgroundDrawList();
  for (const GizmoPart part : parts) {
    const GizmoLines lines = LinesOf(gizmo, part, camera_);
    const bool bright = part == highlighted;
    DrawLines(lines, {0, 0, 0, 0.5f}, bright ? 6.5 : 4.5);
    DrawLines(lines, bright ? theme::kText : ColorOf(part), bright ? 3.5 : 2.2);
    const bool has_head = part == GizmoPart::kMoveRight || part == GizmoPart::kMoveUp ||
                          part == GizmoPart::kMoveFront || part == GizmoPart::kScale;
    if (has_head && !lines.empty())
      list->AddCircleFilled(At(box_.WindowFromImage(lines.back().back())),
                            static_cast<float>((bright ? 6.5 : 5) * scale_),
                            Packed(bright ? theme::kText : ColorOf(part)));
  }
}

void SceneOverlay::DrawNote(const Eigen::Vector2d& point, const std::string& text) {
  DrawTag(point - Eigen::Vector2d(0, 14 * scale_), text, image_, scale_);
}

void SceneOverlay::DrawBanner(const std::string& text) {
  const double height = ImGui::GetTextLineHeight() + 6 * scale_;
  const double box_top = std::max<double>(box_.y, image_.y);
  DrawTag({box_.x + 0.5 * box_.width, box_top + height + 8 * scale_}, text, image_, scale_);
}

}  // namespace docent::ui
