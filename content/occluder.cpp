// SPDX-License-Identifier: Apache-2.0
#include "content/occluder.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/base/error.h"

namespace docent::content {
namespace {

using Point = Eigen::Vector2d;

// Sides of the prism that a cylinder is drawn as: its outline is within half a percent of the radius.
constexpr int kCylinderSides = 32;
// A measured surface that is no farther from an occluder than this, relative to the geometric mean of its two
// larger sides, is the one that the occluder stands for. An author places it from about twice its size, and
// nine tenths of the depths of a map are off by less than 2 % (docs/decisions/dense-surfaces.md).
constexpr double kMargin = 0.05;
// Of an outline, relative to the square of its longest extent; a thinner one is a line and its rounding.
constexpr double kLeastArea = 1e-6;

double Cross(const Point& a, const Point& b) {
  return a.x() * b.y() - a.y() * b.x();
}

// Twice the signed area of the triangle a, b, c.
double Turn(const Point& a, const Point& b, const Point& c) {
  return Cross(b - a, c - a);
}

// Positive if the outline runs counterclockwise.
double SignedArea(const std::vector<Point>& outline) {
  double twice = 0;
  for (std::size_t i = 0; i < outline.size(); ++i)
    twice += Cross(outline[i], outline[(i + 1) % outline.size()]);
  return 0.5 * twice;
}

double Extent(const std::vector<Point>& outline) {
  Point low = outline.front(), high = low;
  for (const Point& point : outline) {
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
  }
  return (high - low).maxCoeff();
}

// Whether two line segments have a point in common that is not an end of both.
bool Crosses(const Point& a, const Point& b, const Point& c, const Point& d) {
  const double c_side = Turn(a, b, c), d_side = Turn(a, b, d);
  const double a_side = Turn(c, d, a), b_side = Turn(c, d, b);
  return c_side * d_side < 0 && a_side * b_side < 0;
}

bool CrossesItself(const std::vector<Point>& outline) {
  const std::size_t n = outline.size();
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = i + 2; k < n; ++k) {
      if (Crosses(outline[i], outline[(i + 1) % n], outline[k], outline[(k + 1) % n])) return true;
    }
  }
  return false;
}

std::string OutlineProblem(const std::vector<Point>& outline) {
  if (outline.size() < kMinOutlinePoints || outline.size() > kMaxOutlinePoints) {
    return "would have an outline of " + std::to_string(outline.size()) + " points, which is not between " +
           std::to_string(kMinOutlinePoints) + " and " + std::to_string(kMaxOutlinePoints);
  }
  for (const Point& point : outline) {
    if (!(point.cwiseAbs().maxCoeff<Eigen::PropagateNaN>() <= kMaxCoordinate))
      return "would have a point of its outline that is too far away";
  }
  const double extent = Extent(outline);
  if (!(std::abs(SignedArea(outline)) > kLeastArea * extent * extent))
    return "would have an outline without an area";
  return CrossesItself(outline) ? "would have an outline that crosses itself" : "";
}

bool IsInside(const std::vector<Point>& outline, const Point& point) {
  bool inside = false;
  for (std::size_t i = 0, last = outline.size() - 1; i < outline.size(); last = i++) {
    const Point &a = outline[last], &b = outline[i];
    if ((a.y() > point.y()) == (b.y() > point.y())) continue;
    if (point.x() < a.x() + (point.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x())) inside = !inside;
  }
  return inside;
}

std::vector<Point> Rectangle(double width, double height) {
  const double x = 0.5 * width, y = 0.5 * height;
  return {{-x, -y}, {x, -y}, {x, y}, {-x, y}};
}

// Cuts off one corner after the other that has no other point of the outline in it.
OccluderMesh FlatMesh(std::vector<Point> outline) {
  if (SignedArea(outline) < 0) std::reverse(outline.begin(), outline.end());
  OccluderMesh mesh;
  std::vector<std::uint32_t> left;
  for (const Point& point : outline) {
    left.push_back(static_cast<std::uint32_t>(left.size()));
    mesh.vertices.emplace_back(point.x(), point.y(), 0);
  }
  const auto can_cut = [&](std::size_t i) {
    const std::size_t n = left.size();
    const Point &a = outline[left[(i + n - 1) % n]], &b = outline[left[i]], &c = outline[left[(i + 1) % n]];
    if (Turn(a, b, c) < 0) return false;
    return std::none_of(left.begin(), left.end(), [&](std::uint32_t other) {
      const Point& p = outline[other];
      return p != a && p != b && p != c && Turn(a, b, p) >= 0 && Turn(b, c, p) >= 0 && Turn(c, a, p) >= 0;
    });
  };
  while (left.size() > 3) {
    std::size_t corner = 0;
    while (corner + 1 < left.size() && !can_cut(corner)) ++corner;
    const std::size_t n = left.size();
    mesh.triangles.push_back({left[(corner + n - 1) % n], left[corner], left[(corner + 1) % n]});
    left.erase(left.begin() + static_cast<std::ptrdiff_t>(corner));
  }
  mesh.triangles.push_back({left[0], left[1], left[2]});
  return mesh;
}

// Stands on the plane y = 0 over an outline in x and z.
OccluderMesh PrismMesh(const std::vector<Point>& outline, double height) {
  OccluderMesh mesh;
  const auto n = static_cast<std::uint32_t>(outline.size());
  for (const double y : {0.0, height}) {
    for (const Point& point : outline) mesh.vertices.emplace_back(point.x(), y, point.y());
  }
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t next = (i + 1) % n;
    mesh.triangles.push_back({i, next, n + i});
    mesh.triangles.push_back({next, n + next, n + i});
    if (i < 2) continue;
    mesh.triangles.push_back({0, i - 1, i});
    mesh.triangles.push_back({n, n + i - 1, n + i});
  }
  return mesh;
}

std::vector<Point> Circle(double diameter) {
  std::vector<Point> outline;
  for (int i = 0; i < kCylinderSides; ++i) {
    const double angle = 2 * std::numbers::pi * i / kCylinderSides;
    outline.emplace_back(0.5 * diameter * std::cos(angle), 0.5 * diameter * std::sin(angle));
  }
  return outline;
}

double MarginOf(const Occluder& occluder) {
  if (occluder.shape == Occluder::Shape::kPolygon)
    return kMargin * std::sqrt(std::abs(SignedArea(occluder.outline)));
  Eigen::Vector3d sides = occluder.size;
  std::sort(sides.data(), sides.data() + 3);
  return kMargin * std::sqrt(sides[1] * sides[2]);
}

}  // namespace

const char* NameOf(Occluder::Shape shape) {
  switch (shape) {
    case Occluder::Shape::kPlane:
      return "plane";
    case Occluder::Shape::kBox:
      return "box";
    case Occluder::Shape::kCylinder:
      return "cylinder";
    case Occluder::Shape::kPolygon:
      return "polygon";
  }
  return "";
}

OccluderMesh MeshOf(const Occluder& occluder) {
  const Eigen::Vector3d& size = occluder.size;
  switch (occluder.shape) {
    case Occluder::Shape::kPlane:
      return FlatMesh(Rectangle(size.x(), size.y()));
    case Occluder::Shape::kBox:
      return PrismMesh(Rectangle(size.x(), size.z()), size.y());
    case Occluder::Shape::kCylinder:
      return PrismMesh(Circle(size.x()), size.y());
    case Occluder::Shape::kPolygon:
      break;
  }
  return FlatMesh(occluder.outline);
}

Occluder PolygonThrough(std::span<const Eigen::Vector3d> points) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero(), normal = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < points.size(); ++i) {
    middle += points[i] / static_cast<double>(points.size());
    // The sum of these products is twice the area vector of the polygon (Newell's method).
    normal += (points[i] - points[0]).cross(points[(i + 1) % points.size()] - points[0]);
  }
  const double length = normal.norm();
  // Points on one line have no plane, which ShapeProblem finds out.
  normal = length > 0 ? Eigen::Vector3d(normal / length) : Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d right = normal.unitOrthogonal();
  Eigen::Matrix3d axes;
  axes << right, normal.cross(right), normal;
  Occluder occluder;
  occluder.shape = Occluder::Shape::kPolygon;
  occluder.size.setZero();
  for (const Eigen::Vector3d& point : points)
    occluder.outline.emplace_back((axes.transpose() * (point - middle)).head<2>());
  if (std::string problem = ShapeProblem(occluder); !problem.empty()) throw Error("the polygon " + problem);
  occluder.map_from_shape.rotation = engine::Rotation3(axes);
  occluder.map_from_shape.translation = middle;
  return occluder;
}

std::string ShapeProblem(const Occluder& occluder) {
  if (occluder.shape == Occluder::Shape::kPolygon) return OutlineProblem(occluder.outline);
  if (!occluder.outline.empty())
    return std::string("would be a ") + NameOf(occluder.shape) + " with an outline";
  const int sides = occluder.shape == Occluder::Shape::kPlane ? 2 : 3;
  for (int i = 0; i < sides; ++i) {
    if (!(occluder.size[i] >= kMinOccluderSide && occluder.size[i] <= kMaxOccluderSide))
      return "would have a side whose length is outside the limits of a scene";
  }
  if (occluder.shape == Occluder::Shape::kPlane && occluder.size.z() != 0)
    return "would be a plane with a depth";
  if (occluder.shape == Occluder::Shape::kCylinder && occluder.size.z() != occluder.size.x())
    return "would be a cylinder that is not round";
  return "";
}

bool StandsFor(const Occluder& occluder, const Eigen::Vector3d& point_in_map) {
  const Eigen::Vector3d place = occluder.map_from_shape.inverse() * point_in_map;
  const Eigen::Vector3d half = 0.5 * occluder.size;
  const double margin = MarginOf(occluder);
  const auto within = [&](double value, double low, double high) {
    return value >= low - margin && value <= high + margin;
  };
  switch (occluder.shape) {
    case Occluder::Shape::kPlane:
      return within(place.z(), 0, 0) && std::abs(place.x()) <= half.x() && std::abs(place.y()) <= half.y();
    case Occluder::Shape::kBox:
      return within(place.x(), -half.x(), half.x()) && within(place.y(), 0, occluder.size.y()) &&
             within(place.z(), -half.z(), half.z());
    case Occluder::Shape::kCylinder:
      return within(place.y(), 0, occluder.size.y()) && within(std::hypot(place.x(), place.z()), 0, half.x());
    case Occluder::Shape::kPolygon:
      break;
  }
  return within(place.z(), 0, 0) && IsInside(occluder.outline, place.head<2>());
}

}  // namespace docent::content
