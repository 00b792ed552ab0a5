// SPDX-License-Identifier: Apache-2.0
#include "ui/trail_model.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <vector>

namespace docent::ui {
namespace {

// In widths of the ribbon.
constexpr double kArrowSpacing = 2.5, kArrowLength = 0.9, kArrowHalfWidth = 0.36, kArrowLift = 0.02;
constexpr double kMaxMiter = 2;  // How far the outside of a bend may reach.
constexpr double kMaxArrows = 400;

glm::vec3 FloatFrom(const Eigen::Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}

// The trail without points that repeat the one before, relative to its first point.
std::vector<Eigen::Vector3d> DistinctPoints(const content::Trail& trail) {
  std::vector<Eigen::Vector3d> points;
  for (const Eigen::Vector3d& point : trail.points) {
    const Eigen::Vector3d place = point - trail.points.front();
    if (points.empty() || (place - points.back()).norm() > 1e-3 * trail.width) points.push_back(place);
  }
  return points;
}

// Collects the vertices of one colour.
class TrailMesh {
 public:
  explicit TrailMesh(const Eigen::Vector3d& up) : normal_(FloatFrom(up)) {}

  std::uint32_t Add(const Eigen::Vector3d& place) {
    content::Vertex vertex;
    vertex.position = FloatFrom(place);
    vertex.normal = normal_;
    primitive_.vertices.push_back(vertex);
    return static_cast<std::uint32_t>(primitive_.vertices.size() - 1);
  }
  void Triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    for (const std::uint32_t index : {a, b, c}) primitive_.indices.push_back(index);
  }
  content::Primitive Take(int material) {
    primitive_.material = material;
    return std::move(primitive_);
  }

 private:
  glm::vec3 normal_;
  content::Primitive primitive_;
};

// The unit vector to the left of a segment; of one along `up`, any across.
Eigen::Vector3d LeftOf(const Eigen::Vector3d& step, const Eigen::Vector3d& up) {
  const Eigen::Vector3d left = up.cross(step);
  return left.norm() > 1e-6 * step.norm() ? Eigen::Vector3d(left.normalized())
                                          : Eigen::Vector3d(up.unitOrthogonal());
}

// Half of the ribbon's width to the left at each point, longer in bends so that its edges stay straight.
std::vector<Eigen::Vector3d> HalfWidths(const std::vector<Eigen::Vector3d>& points, const Eigen::Vector3d& up,
                                        double width) {
  std::vector<Eigen::Vector3d> halves;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d before = LeftOf(i > 0 ? points[i] - points[i - 1] : points[1] - points[0], up);
    const Eigen::Vector3d after = i + 1 < points.size() ? LeftOf(points[i + 1] - points[i], up) : before;
    const Eigen::Vector3d sum = before + after;
    const Eigen::Vector3d middle = sum.norm() > 1e-6 ? Eigen::Vector3d(sum.normalized()) : before;
    const double miter = std::min(kMaxMiter, 1 / std::max(middle.dot(before), 1 / kMaxMiter));
    halves.push_back(0.5 * width * miter * middle);
  }
  return halves;
}

content::Primitive RibbonOf(const std::vector<Eigen::Vector3d>& points, const Eigen::Vector3d& up,
                            double width) {
  TrailMesh mesh(up);
  const std::vector<Eigen::Vector3d> halves = HalfWidths(points, up, width);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::uint32_t left = mesh.Add(points[i] + halves[i]), right = mesh.Add(points[i] - halves[i]);
    if (i == 0) continue;
    mesh.Triangle(right - 2, right, left);
    mesh.Triangle(right - 2, left, left - 2);
  }
  return mesh.Take(0);
}

content::Primitive ArrowsOf(const std::vector<Eigen::Vector3d>& points, const Eigen::Vector3d& up,
                            double width) {
  TrailMesh mesh(up);
  double total = 0;
  for (std::size_t i = 1; i < points.size(); ++i) total += (points[i] - points[i - 1]).norm();
  // Evenly spaced, at least one, and not more than can be told apart.
  const double count = std::clamp(std::floor(total / (kArrowSpacing * width)), 1.0, kMaxArrows);
  const double spacing = total / count;
  double next = 0.5 * spacing, begin = 0;
  for (std::size_t i = 1; i < points.size(); ++i) {
    const Eigen::Vector3d step = points[i] - points[i - 1];
    const double length = step.norm();
    const Eigen::Vector3d ahead = step / length, left = LeftOf(step, up);
    for (; next < begin + length; next += spacing) {
      const Eigen::Vector3d middle = points[i - 1] + (next - begin) * ahead + kArrowLift * width * up;
      const Eigen::Vector3d back = middle - 0.5 * kArrowLength * width * ahead;
      const Eigen::Vector3d side = kArrowHalfWidth * width * left;
      const std::uint32_t tip = mesh.Add(middle + 0.5 * kArrowLength * width * ahead);
      const std::uint32_t first = mesh.Add(back + side), second = mesh.Add(back - side);
      mesh.Triangle(tip, first, second);
    }
    begin += length;
  }
  return mesh.Take(1);
}

content::Material FlatColor(const glm::vec4& color) {
  content::Material material;
  material.base_color = color;  // Linear RGB.
  material.unlit = true;
  material.double_sided = true;
  return material;
}

}  // namespace

std::shared_ptr<const content::Model> MakeTrailModel(const content::Trail& trail) {
  auto model = std::make_shared<content::Model>();
  model->name = "trail";
  std::vector<Eigen::Vector3d> points = DistinctPoints(trail);
  if (points.empty()) return model;
  const Eigen::Vector3d up = trail.up.normalized();
  // All points in one place: a short piece shows where.
  if (points.size() < 2) points.push_back(points.front() + trail.width * up.unitOrthogonal());
  model->materials = {FlatColor({0.02f, 0.23f, 0.55f, 1.0f}), FlatColor({1.0f, 0.85f, 0.25f, 1.0f})};
  content::Mesh mesh{"trail", {RibbonOf(points, up, trail.width), ArrowsOf(points, up, trail.width)}};
  model->bounds_min = model->bounds_max = mesh.primitives[0].vertices.front().position;
  for (const content::Primitive& primitive : mesh.primitives) {
    for (const content::Vertex& vertex : primitive.vertices) {
      model->bounds_min = glm::min(model->bounds_min, vertex.position);
      model->bounds_max = glm::max(model->bounds_max, vertex.position);
    }
  }
  model->meshes.push_back(std::move(mesh));
  content::Node node;
  node.mesh = 0;
  model->nodes.push_back(node);
  model->roots.push_back(0);
  return model;
}

}  // namespace docent::ui
