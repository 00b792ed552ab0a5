// SPDX-License-Identifier: Apache-2.0
#include "ui/gizmo.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace docent::ui {
namespace {

constexpr double kGizmoPi = std::numbers::pi;
// In lengths of the arrows.
constexpr double kSquareFrom = 0.25, kSquareTo = 0.42, kRingRadius = 0.8, kScaleFrom = 1.08, kScaleTo = 1.24;

int AxisOf(GizmoPart part) {
  switch (part) {
    case GizmoPart::kMoveRight:
    case GizmoPart::kMoveAcrossRight:
    case GizmoPart::kTurnRight:
      return 0;
    case GizmoPart::kMoveFront:
    case GizmoPart::kMoveAcrossFront:
    case GizmoPart::kTurnFront:
      return 2;
    default:
      return 1;
  }
}

bool IsArrow(GizmoPart part) {
  return part == GizmoPart::kMoveRight || part == GizmoPart::kMoveUp || part == GizmoPart::kMoveFront;
}

bool IsRing(GizmoPart part) {
  return part == GizmoPart::kTurnRight || part == GizmoPart::kTurnUp || part == GizmoPart::kTurnFront;
}

struct Line3 {
  Eigen::Vector3d origin, direction;
};

std::optional<Line3> PointerRay(const GizmoCamera& camera, const Eigen::Vector2d& pixel) {
  const std::optional<Eigen::Vector3d> ray = camera.lens.Unproject(pixel);
  if (!ray) return std::nullopt;
  const engine::Rigid3 map_from_camera = camera.camera_from_map.inverse();
  return Line3{map_from_camera.translation, (map_from_camera.rotation * *ray).normalized()};
}

// Rays that meet a plane at less than about two degrees are refused: a pixel is then a long way.
std::optional<Eigen::Vector3d> OnPlane(const Line3& ray, const Eigen::Vector3d& point,
                                       const Eigen::Vector3d& normal) {
  const double along = normal.dot(ray.direction);
  if (std::abs(along) < 0.035) return std::nullopt;
  const double distance = normal.dot(point - ray.origin) / along;
  if (!(distance > 0)) return std::nullopt;
  return ray.origin + distance * ray.direction;
}

// The point of a line that is nearest to the ray, as a distance along the line.
std::optional<double> AlongLine(const Line3& ray, const Eigen::Vector3d& point, const Eigen::Vector3d& axis) {
  const double across = axis.dot(ray.direction);
  const double determinant = 1 - across * across;
  if (determinant < 1e-3) return std::nullopt;
  const Eigen::Vector3d offset = ray.origin - point;
  return (axis.dot(offset) - across * ray.direction.dot(offset)) / determinant;
}

double RoundedTo(double value, double step) {
  return std::round(value / step) * step;
}

double DistanceToPiece(const Eigen::Vector2d& point, const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  const Eigen::Vector2d along = to - from;
  const double squared = along.squaredNorm();
  const double t = squared > 0 ? std::clamp(along.dot(point - from) / squared, 0.0, 1.0) : 0.0;
  return (from + t * along - point).norm();
}

// Projects connected points; a part behind the camera or far outside the image interrupts the line.
void Add(const std::vector<Eigen::Vector3d>& places, const GizmoCamera& camera, GizmoLines* lines) {
  const double far_px = camera.lens.width_px() + camera.lens.height_px();
  lines->emplace_back();
  for (const Eigen::Vector3d& place : places) {
    const auto pixel = camera.lens.Project(camera.camera_from_map * place);
    if (pixel && camera.lens.IsInside(*pixel, -far_px)) {
      lines->back().push_back(*pixel);
    } else if (!lines->back().empty()) {
      lines->emplace_back();
    }
  }
  if (lines->back().size() < 2) lines->pop_back();
}

std::vector<Eigen::Vector3d> Straight(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  constexpr int kPieces = 8;  // Lenses bend straight lines.
  std::vector<Eigen::Vector3d> places;
  for (int i = 0; i <= kPieces; ++i) {
    const double t = static_cast<double>(i) / kPieces;
    places.emplace_back((1 - t) * from + t * to);
  }
  return places;
}

}  // namespace

Eigen::Vector3d Gizmo::Axis(int index) const {
  return map_from_axes * Eigen::Vector3d::Unit(index);
}

std::optional<double> GizmoLength(const GizmoCamera& camera, const Eigen::Vector3d& origin, double pixels) {
  const Eigen::Vector3d in_camera = camera.camera_from_map * origin;
  if (!(in_camera.z() > 0)) return std::nullopt;
  return pixels * camera.lens.PixelAngle() * in_camera.norm();
}

std::vector<GizmoPart> PartsOf(const Gizmo& gizmo) {
  std::vector<GizmoPart> parts;
  if (gizmo.scales) parts.push_back(GizmoPart::kScale);
  for (const GizmoPart part :
       {GizmoPart::kMoveAcrossRight, GizmoPart::kMoveAcrossUp, GizmoPart::kMoveAcrossFront,
        GizmoPart::kMoveRight, GizmoPart::kMoveUp, GizmoPart::kMoveFront})
    parts.push_back(part);
  if (gizmo.turns) {
    for (const GizmoPart part : {GizmoPart::kTurnUp, GizmoPart::kTurnRight, GizmoPart::kTurnFront})
      parts.push_back(part);
  }
  return parts;
}

GizmoLines LinesOf(const Gizmo& gizmo, GizmoPart part, const GizmoCamera& camera) {
  GizmoLines lines;
  const int axis = AxisOf(part);
  const Eigen::Vector3d first = gizmo.Axis((axis + 1) % 3), second = gizmo.Axis((axis + 2) % 3);
  const auto at = [&](double along_first, double along_second) -> Eigen::Vector3d {
    return gizmo.origin + gizmo.length * (along_first * first + along_second * second);
  };
  if (IsArrow(part)) {
    Add(Straight(gizmo.origin, gizmo.origin + gizmo.length * gizmo.Axis(axis)), camera, &lines);
  } else if (IsRing(part)) {
    constexpr int kRingPieces = 64;
    std::vector<Eigen::Vector3d> ring;
    for (int i = 0; i <= kRingPieces; ++i) {
      const double angle = 2 * kGizmoPi * i / kRingPieces;
      ring.push_back(at(kRingRadius * std::cos(angle), kRingRadius * std::sin(angle)));
    }
    Add(ring, camera, &lines);
  } else if (part == GizmoPart::kScale) {
    // Beyond the tip of the upward arrow.
    const Eigen::Vector3d up = gizmo.length * gizmo.Axis(1);
    Add(Straight(gizmo.origin + kScaleFrom * up, gizmo.origin + kScaleTo * up), camera, &lines);
  } else if (part != GizmoPart::kNone && part != GizmoPart::kGround) {
    Add({at(kSquareFrom, kSquareFrom), at(kSquareTo, kSquareFrom), at(kSquareTo, kSquareTo),
         at(kSquareFrom, kSquareTo), at(kSquareFrom, kSquareFrom)},
        camera, &lines);
  }
  return lines;
}

GizmoPart PartAt(const Gizmo& gizmo, const GizmoCamera& camera, const Eigen::Vector2d& pixel,
                 double reach_px) {
  GizmoPart nearest = GizmoPart::kNone;
  double least = reach_px;
  for (const GizmoPart part : PartsOf(gizmo)) {
    for (const auto& line : LinesOf(gizmo, part, camera)) {
      for (std::size_t i = 1; i < line.size(); ++i) {
        const double distance = DistanceToPiece(pixel, line[i - 1], line[i]);
        if (distance >= least) continue;
        least = distance;
        nearest = part;
      }
    }
  }
  return nearest;
}

std::optional<Eigen::Vector3d> GizmoDrag::Grip(const GizmoCamera& camera,
                                               const Eigen::Vector2d& pixel) const {
  if (part_ == GizmoPart::kScale) {
    const auto middle = camera.lens.Project(camera.camera_from_map * gizmo_.origin);
    if (!middle || (pixel - *middle).norm() < 1) return std::nullopt;
    return Eigen::Vector3d((pixel - *middle).norm(), 0, 0);
  }
  const std::optional<Line3> ray = PointerRay(camera, pixel);
  if (!ray) return std::nullopt;
  const Eigen::Vector3d axis = gizmo_.Axis(AxisOf(part_));
  if (IsArrow(part_)) {
    const auto along = AlongLine(*ray, gizmo_.origin, axis);
    if (!along) return std::nullopt;
    return Eigen::Vector3d(*along, 0, 0);
  }
  const auto place = OnPlane(*ray, gizmo_.origin, axis);
  if (!place || !IsRing(part_)) return place;
  const Eigen::Vector3d offset = *place - gizmo_.origin;
  const int index = AxisOf(part_);
  const double first = gizmo_.Axis((index + 1) % 3).dot(offset),
               second = gizmo_.Axis((index + 2) % 3).dot(offset);
  if (!(std::hypot(first, second) > 1e-9 * gizmo_.length)) return std::nullopt;
  return Eigen::Vector3d(std::atan2(second, first), 0, 0);
}

std::optional<GizmoDrag> GizmoDrag::Begin(const Gizmo& gizmo, GizmoPart part, const GizmoCamera& camera,
                                          const Eigen::Vector2d& pixel) {
  if (part == GizmoPart::kNone || !(gizmo.length > 0)) return std::nullopt;
  GizmoDrag drag(gizmo, part);
  const auto grip = drag.Grip(camera, pixel);
  if (!grip) return std::nullopt;
  drag.start_ = *grip;
  return drag;
}

GizmoDrag::Steps GizmoDrag::steps() const {
  const double wanted = 0.2 * gizmo_.length;
  const double power = std::pow(10.0, std::floor(std::log10(wanted)));
  double length = power;
  for (const double step : {2.0, 5.0}) {
    if (step * power <= wanted * (1 + 1e-9)) length = step * power;
  }
  return {length, kGizmoPi / 12, 0.1};
}

const engine::Sim3& GizmoDrag::Update(const GizmoCamera& camera, const Eigen::Vector2d& pixel,
                                      bool in_steps) {
  const auto grip = Grip(camera, pixel);
  if (!grip) return motion_;
  const Steps step = steps();
  const Eigen::Vector3d axis = gizmo_.Axis(AxisOf(part_));
  if (part_ == GizmoPart::kScale) {
    constexpr double kLeastFactor = 0.01;
    double factor = grip->x() / start_.x();
    if (in_steps) factor = RoundedTo(factor, step.factor);
    motion_ = ScalingAbout(gizmo_.origin, std::max(kLeastFactor, factor));
  } else if (IsArrow(part_)) {
    double along = grip->x() - start_.x();
    if (in_steps) along = RoundedTo(along, step.length);
    motion_ = TranslationBy(along * axis);
  } else if (IsRing(part_)) {
    double angle = std::remainder(grip->x() - start_.x(), 2 * kGizmoPi);
    if (in_steps) angle = RoundedTo(angle, step.angle);
    motion_ = RotationAbout(gizmo_.origin, axis, angle);
  } else {
    Eigen::Vector3d offset = *grip - start_;
    if (in_steps) {
      const Eigen::Vector3d along = gizmo_.map_from_axes.inverse() * offset;
      offset = gizmo_.map_from_axes *
               Eigen::Vector3d(along.unaryExpr([&](double value) { return RoundedTo(value, step.length); }));
    }
    motion_ = TranslationBy(offset);
  }
  return motion_;
}

engine::Sim3 TranslationBy(const Eigen::Vector3d& offset) {
  engine::Sim3 motion;
  motion.translation = offset;
  return motion;
}

engine::Sim3 RotationAbout(const Eigen::Vector3d& point, const Eigen::Vector3d& axis, double angle) {
  engine::Sim3 motion;
  motion.rotation = engine::Rotation3::Exp(angle * axis.normalized());
  motion.translation = point - motion.rotation * point;
  return motion;
}

engine::Sim3 ScalingAbout(const Eigen::Vector3d& point, double factor) {
  engine::Sim3 motion;
  motion.scale = factor;
  motion.translation = (1 - factor) * point;
  return motion;
}

}  // namespace docent::ui
