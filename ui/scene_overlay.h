// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <string>

#include "ui/entity_shapes.h"
#include "ui/gizmo.h"
#include "ui/letterbox.h"
#include "ui/text.h"
#include "ui/window_layout.h"

namespace docent::ui {

// Lines and texts over the image, below all widgets, at the window's resolution. One per frame, between
// Gui::Begin and Gui::Draw.
class SceneOverlay {
 public:
  // `scale` is that of the interface.
  SceneOverlay(const GizmoCamera& camera, const Letterbox& box, const Area& image, double scale);
  ~SceneOverlay();
  SceneOverlay(const SceneOverlay&) = delete;
  SceneOverlay& operator=(const SceneOverlay&) = delete;

  // The edges of an entity's box, and its name above it.
  void DrawOutline(const PlacedBox& placed, const std::string& name, bool is_locked);
  // The edges of a part of the image, in its pixels, where an entity is drawn that has no box, and its name.
  void DrawOutline(const Eigen::AlignedBox2d& area, const std::string& name, bool is_locked);
  // The edges of the box within which the map is extended, in map coordinates.
  void DrawBoundary(const Eigen::AlignedBox3d& bounds);
  // A point of the map that belongs at another one, with its number.
  void DrawPair(const Eigen::Vector3d& from, const Eigen::Vector3d& to, const std::string& number);
  // The handles; the one under the pointer or held is brighter.
  void DrawGizmo(const Gizmo& gizmo, GizmoPart highlighted);
  // A text at a point of the window, such as what is wrong below the pointer.
  void DrawNote(const Eigen::Vector2d& point, const std::string& text);
  // A text at the upper edge of the image.
  void DrawBanner(const std::string& text);

 private:
  // The edges of a box as far as the lens sees them. `seen`, if not null, is extended by the visible part, in
  // pixels of the window.
  GizmoLines EdgesOf(const PlacedBox& placed, Eigen::AlignedBox2d* seen) const;
  // Lines with a name above them. `seen`: what they cover, in pixels of the window.
  void DrawNamed(const GizmoLines& lines, const Eigen::AlignedBox2d& seen, const std::string& name,
                 bool is_locked);
  void DrawLines(const GizmoLines& lines, const Color& color, double width);

  const GizmoCamera& camera_;
  const Letterbox box_;
  const Area image_;
  const double scale_;
};

}  // namespace docent::ui
