// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "engine/geometry/camera_model.h"
#include "engine/geometry/rigid3.h"
#include "engine/geometry/sim3.h"

// The handles by which a person moves, rotates and scales an entity in the image, without any drawing. Pure
// mathematics; any thread. Lengths are in map units, pixels are those of the camera's image, angles in
// radians.
namespace docent::ui {

enum class GizmoPart {
  kNone,
  kMoveRight,  // Arrows along the axes.
  kMoveUp,
  kMoveFront,
  kMoveAcrossRight,  // Squares: in the plane across an axis.
  kMoveAcrossUp,
  kMoveAcrossFront,
  kTurnRight,  // Rings about the axes.
  kTurnUp,
  kTurnFront,
  kScale,   // A square beside the origin: the same factor for all axes.
  kGround,  // The entity itself: over the plane through its base.
};

// The camera that the handles are seen by.
struct GizmoCamera {
  engine::CameraModel lens;
  engine::Rigid3 camera_from_map;
};

// The handles of an entity: an origin and three axes.
struct Gizmo {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  // The middle of the entity's base.
  engine::Rotation3 map_from_axes;                   // x right, y up, z front.
  double length = 1;                                 // Of the arrows.
  bool turns = true, scales = true;                  // Whether there are handles for that.

  // A unit vector in the map; 0 right, 1 up, 2 front.
  Eigen::Vector3d Axis(int index) const;
};

// The length of arrows that have this length in pixels where the origin is seen; empty behind the camera.
std::optional<double> GizmoLength(const GizmoCamera& camera, const Eigen::Vector3d& origin, double pixels);

// The visible course of a handle in the image, as pieces of connected lines.
using GizmoLines = std::vector<std::vector<Eigen::Vector2d>>;
GizmoLines LinesOf(const Gizmo& gizmo, GizmoPart part, const GizmoCamera& camera);
// All handles that the gizmo has, from the front to the back of a choice: small ones win over large ones.
std::vector<GizmoPart> PartsOf(const Gizmo& gizmo);

// The handle whose lines pass the pixel within this distance, else kNone.
GizmoPart PartAt(const Gizmo& gizmo, const GizmoCamera& camera, const Eigen::Vector2d& pixel,
                 double reach_px);

// One drag of a handle. The motion is a similarity of the map that takes the entity from where it was at the
// beginning to where the pointer holds it: new_map_from_model = motion * map_from_model.
class GizmoDrag {
 public:
  // Empty when the handle cannot be held at this pixel, for instance a plane that is seen from its edge.
  static std::optional<GizmoDrag> Begin(const Gizmo& gizmo, GizmoPart part, const GizmoCamera& camera,
                                        const Eigen::Vector2d& pixel);

  // Steps that a drag is rounded to: a round length (1, 2 or 5 times a power of ten, about a fifth of the
  // arrows), 15 degrees, and a tenth of the size.
  struct Steps {
    double length = 0.1, angle = 0, factor = 0.1;
  };
  Steps steps() const;
  // The motion for the pointer at this pixel. Where the pointer has no place on the handle (its ray is
  // parallel to the plane, or meets it behind the camera), the last motion stays.
  const engine::Sim3& Update(const GizmoCamera& camera, const Eigen::Vector2d& pixel, bool in_steps);

  const engine::Sim3& motion() const { return motion_; }
  GizmoPart part() const { return part_; }

 private:
  GizmoDrag(const Gizmo& gizmo, GizmoPart part) : gizmo_(gizmo), part_(part) {}
  // The pointer on the handle: a position along the arrow, on the plane, an angle, or a distance in pixels.
  std::optional<Eigen::Vector3d> Grip(const GizmoCamera& camera, const Eigen::Vector2d& pixel) const;

  Gizmo gizmo_;
  GizmoPart part_;
  Eigen::Vector3d start_ = Eigen::Vector3d::Zero();
  engine::Sim3 motion_;
};

// The similarity that translates, rotates about an axis through a point, or scales about a point.
engine::Sim3 TranslationBy(const Eigen::Vector3d& offset);
engine::Sim3 RotationAbout(const Eigen::Vector3d& point, const Eigen::Vector3d& axis, double angle);
engine::Sim3 ScalingAbout(const Eigen::Vector3d& point, double factor);

}  // namespace docent::ui
