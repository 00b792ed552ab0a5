// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "app/session/guided_view.h"
#include "content/picking.h"
#include "ui/gizmo.h"
#include "ui/letterbox.h"
#include "ui/renderer.h"
#include "ui/window_layout.h"

namespace docent::app {

// What the author sees: a frame with its pose, the content that is drawn over it, and where that is in the
// window. With a frozen view the content is newer than the frame. On the window's thread.
struct AuthorView {
  std::shared_ptr<const ShownFrame> frame;      // Null before the first one.
  std::shared_ptr<const content::Scene> scene;  // Null without a map.
  ui::GizmoCamera camera;                       // The lens and pose of the frame.
  ui::Letterbox box;                            // Of the image in the window.
  ui::Area image;                               // The part of the window that the image is centred in.
  ui::Area inset;                               // Of the second camera's image; empty without one.
  double scale = 1;                             // Of the interface.
  // The labels in the image that was drawn last, the topmost last; null where none are drawn.
  const std::vector<ui::LabelArea>* labels = nullptr;

  bool has_pose() const { return frame && engine::HasPose(frame->tracked.state) && frame->tracked.map; }
  // Whether the image shows this point of the window, and not the second camera's image.
  bool ShowsImageAt(const Eigen::Vector2d& point) const {
    return frame && !inset.Contains(point) && camera.lens.IsInside(PixelAt(point), -0.5);
  }
  Eigen::Vector2d PixelAt(const Eigen::Vector2d& point) const { return box.ImageFromWindow(point); }
  Eigen::Vector3d eye() const { return camera.camera_from_map.OriginInSource(); }
  // The ray of a pixel in the map; empty without a pose or where the lens has none.
  std::optional<content::Ray> RayAt(const Eigen::Vector2d& pixel) const {
    const auto ray = camera.lens.Unproject(pixel);
    if (!has_pose() || !ray) return std::nullopt;
    return content::Ray{eye(), (camera.camera_from_map.rotation.inverse() * *ray).normalized()};
  }
};

}  // namespace docent::app
