// SPDX-License-Identifier: Apache-2.0
#include "engine/dense/mesh_simplification.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <queue>
#include <tuple>
#include <utility>

#include "engine/base/interrupt.h"

namespace docent::engine {
namespace {

constexpr std::uint32_t kRemoved = 0xFFFFFFFFu;

// The sum of squared distances to planes, weighted, as a function of the place: x'Ax + 2b'x + c.
struct Quadric {
  Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  double c = 0, weight = 0;

  void AddPlane(const Eigen::Vector3d& unit_normal, const Eigen::Vector3d& point, double plane_weight) {
    const double offset = -unit_normal.dot(point);
    a += plane_weight * unit_normal * unit_normal.transpose();
    b += plane_weight * offset * unit_normal;
    c += plane_weight * offset * offset;
    weight += plane_weight;
  }
  void Add(const Quadric& other) {
    a += other.a;
    b += other.b;
    c += other.c;
    weight += other.weight;
  }
  // Mean squared distance.
  double ErrorAt(const Eigen::Vector3d& x) const {
    return weight > 0 ? std::max(0.0, x.dot(a * x) + 2 * b.dot(x) + c) / weight : 0;
  }
};

class Simplification {
 public:
  explicit Simplification(const SurfaceMesh& mesh)
      : triangles_(mesh.triangles),
        triangles_of_(mesh.vertices.size()),
        quadrics_(mesh.vertices.size()),
        versions_(mesh.vertices.size(), 0),
        count_(mesh.triangles.size()) {
    // Numbers near zero keep the precision of the quadrics.
    if (!mesh.vertices.empty()) origin_ = mesh.vertices[0].cast<double>();
    for (const Eigen::Vector3f& vertex : mesh.vertices) places_.push_back(vertex.cast<double>() - origin_);
    for (std::uint32_t i = 0; i < triangles_.size(); ++i) {
      for (const std::uint32_t vertex : triangles_[i]) triangles_of_[vertex].push_back(i);
      AddTriangle(triangles_[i]);
    }
    AddBorders();
    std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
    for (const auto& t : triangles_) {
      for (std::size_t i = 0; i < 3; ++i) edges.push_back(std::minmax(t[i], t[(i + 1) % 3]));
    }
    std::sort(edges.begin(), edges.end());
    edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
    for (const auto& [from, to] : edges) Push(from, to);
  }

  void Run(double max_error, std::size_t max_triangles, const std::atomic<bool>* interrupt) {
    while (!queue_.empty() && !IsInterrupted(interrupt)) {
      const Collapse next = queue_.top();
      if (next.error > max_error && count_ <= max_triangles) return;
      queue_.pop();
      if (versions_[next.from] == next.from_version && versions_[next.to] == next.to_version)
        TryCollapse(next);
    }
  }

  SurfaceMesh Result() const {
    SurfaceMesh mesh;
    std::vector<std::uint32_t> index(places_.size(), kRemoved);
    for (const auto& triangle : triangles_) {
      if (triangle[0] == kRemoved) continue;
      std::array<std::uint32_t, 3> corners{};
      for (std::size_t i = 0; i < 3; ++i) {
        std::uint32_t& known = index[triangle[i]];
        if (known == kRemoved) {
          known = static_cast<std::uint32_t>(mesh.vertices.size());
          mesh.vertices.push_back((places_[triangle[i]] + origin_).cast<float>());
        }
        corners[i] = known;
      }
      mesh.triangles.push_back(corners);
    }
    return mesh;
  }

 private:
  struct Collapse {
    double error;
    std::uint32_t from, to, from_version, to_version;
    Eigen::Vector3d place;
    bool operator<(const Collapse& other) const {  // The priority queue's top is the largest.
      return std::tie(error, from, to) > std::tie(other.error, other.from, other.to);
    }
  };

  Eigen::Vector3d AreaNormal(const std::array<std::uint32_t, 3>& t) const {
    return (places_[t[1]] - places_[t[0]]).cross(places_[t[2]] - places_[t[0]]);
  }

  void AddTriangle(const std::array<std::uint32_t, 3>& t) {
    const Eigen::Vector3d normal = AreaNormal(t);
    const double area = normal.norm();
    if (!(area > 0)) return;
    for (const std::uint32_t vertex : t) quadrics_[vertex].AddPlane(normal / area, places_[t[0]], area);
  }

  // A plane through each border edge, perpendicular to its triangle, so that borders do not shrink.
  void AddBorders() {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::pair<int, std::uint32_t>> edges;
    for (std::uint32_t i = 0; i < triangles_.size(); ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        auto& [uses, triangle] = edges[std::minmax(triangles_[i][k], triangles_[i][(k + 1) % 3])];
        ++uses;
        triangle = i;
      }
    }
    for (const auto& [edge, use] : edges) {
      if (use.first != 1) continue;
      const Eigen::Vector3d along = places_[edge.second] - places_[edge.first];
      const Eigen::Vector3d normal = AreaNormal(triangles_[use.second]).cross(along);
      if (!(normal.norm() > 0)) continue;
      for (const std::uint32_t vertex : {edge.first, edge.second})
        quadrics_[vertex].AddPlane(normal.normalized(), places_[edge.first], along.squaredNorm());
    }
  }

  void Push(std::uint32_t from, std::uint32_t to) {
    Quadric sum = quadrics_[from];
    sum.Add(quadrics_[to]);
    // The best place, drawn towards the middle of the edge where the surface is flat.
    const Eigen::Vector3d middle = 0.5 * (places_[from] + places_[to]);
    constexpr double kFlat = 1e-3;
    const Eigen::Matrix3d a = sum.a + kFlat * sum.weight * Eigen::Matrix3d::Identity();
    Eigen::Vector3d place = a.ldlt().solve(-sum.b + kFlat * sum.weight * middle);
    if (!place.allFinite() || (place - middle).norm() > (places_[from] - places_[to]).norm()) place = middle;
    queue_.push({sum.ErrorAt(place), from, to, versions_[from], versions_[to], place});
  }

  std::vector<std::uint32_t> NeighboursOf(std::uint32_t vertex) const {
    std::vector<std::uint32_t> neighbours;
    for (const std::uint32_t triangle : triangles_of_[vertex]) {
      for (const std::uint32_t other : triangles_[triangle]) {
        if (other != vertex) neighbours.push_back(other);
      }
    }
    std::sort(neighbours.begin(), neighbours.end());
    neighbours.erase(std::unique(neighbours.begin(), neighbours.end()), neighbours.end());
    return neighbours;
  }

  // Whether a triangle of `vertex` that stays would turn over or become a sliver.
  bool TurnsOver(std::uint32_t vertex, std::uint32_t other, const Eigen::Vector3d& place) const {
    constexpr double kMinCosine = 0.2;
    for (const std::uint32_t index : triangles_of_[vertex]) {
      const auto& t = triangles_[index];
      if (std::find(t.begin(), t.end(), other) != t.end()) continue;
      std::array<Eigen::Vector3d, 3> moved;
      for (std::size_t i = 0; i < 3; ++i) moved[i] = t[i] == vertex ? place : places_[t[i]];
      const Eigen::Vector3d before = AreaNormal(t), after = (moved[1] - moved[0]).cross(moved[2] - moved[0]);
      if (after.dot(before) <= kMinCosine * after.norm() * before.norm()) return true;
    }
    return false;
  }

  void TryCollapse(const Collapse& collapse) {
    const auto [error, from, to, from_version, to_version, place] = collapse;
    const std::vector<std::uint32_t> around_from = NeighboursOf(from), around_to = NeighboursOf(to);
    std::vector<std::uint32_t> common;
    std::set_intersection(around_from.begin(), around_from.end(), around_to.begin(), around_to.end(),
                          std::back_inserter(common));
    constexpr std::size_t kMaxCommon = 2;  // More would join sheets of the surface that only touch.
    if (common.size() > kMaxCommon || TurnsOver(from, to, place) || TurnsOver(to, from, place)) return;
    places_[to] = place;
    quadrics_[to].Add(quadrics_[from]);
    for (const std::uint32_t index : triangles_of_[from]) {
      auto& t = triangles_[index];
      if (std::find(t.begin(), t.end(), to) != t.end()) {
        t.fill(kRemoved);
        --count_;
      } else {
        *std::find(t.begin(), t.end(), from) = to;
        triangles_of_[to].push_back(index);
      }
    }
    triangles_of_[from].clear();
    ++versions_[from];
    ++versions_[to];
    std::erase_if(triangles_of_[to], [&](std::uint32_t index) { return triangles_[index][0] == kRemoved; });
    for (const std::uint32_t other : common)
      std::erase_if(triangles_of_[other],
                    [&](std::uint32_t index) { return triangles_[index][0] == kRemoved; });
    for (const std::uint32_t other : NeighboursOf(to)) Push(std::min(other, to), std::max(other, to));
  }

  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3d> places_;
  std::vector<std::array<std::uint32_t, 3>> triangles_;
  std::vector<std::vector<std::uint32_t>> triangles_of_;
  std::vector<Quadric> quadrics_;
  std::vector<std::uint32_t> versions_;
  std::size_t count_;  // Of the triangles that are left.
  std::priority_queue<Collapse> queue_;
};

}  // namespace

SurfaceMesh SimplifyMesh(const SurfaceMesh& mesh, double max_distance, std::size_t max_triangles,
                         const std::atomic<bool>* interrupt) {
  Simplification simplification(mesh);
  simplification.Run(max_distance * max_distance, max_triangles, interrupt);
  return simplification.Result();
}

SurfaceMesh CutSharedEdges(const SurfaceMesh& mesh) {
  struct Side {
    std::pair<std::uint32_t, std::uint32_t> edge;  // Ascending.
    std::uint32_t triangle;
  };
  std::vector<Side> sides;
  sides.reserve(3 * mesh.triangles.size());
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& t = mesh.triangles[i];
    for (std::size_t k = 0; k < 3; ++k) sides.push_back({std::minmax(t[k], t[(k + 1) % 3]), i});
  }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    return std::tie(a.edge, a.triangle) < std::tie(b.edge, b.triangle);
  });
  // Union-find over the corners of the triangles: those at both ends of an edge between two triangles belong
  // together.
  std::vector<std::uint32_t> parent(3 * mesh.triangles.size());
  std::iota(parent.begin(), parent.end(), 0U);
  const auto root_of = [&](std::uint32_t corner) {
    while (parent[corner] != corner) corner = parent[corner] = parent[parent[corner]];
    return corner;
  };
  const auto corner_of = [&](std::uint32_t triangle, std::uint32_t vertex) {
    const auto& t = mesh.triangles[triangle];
    return 3 * triangle + static_cast<std::uint32_t>(std::find(t.begin(), t.end(), vertex) - t.begin());
  };
  for (std::size_t from = 0, to = 0; from < sides.size(); from = to) {
    while (to < sides.size() && sides[to].edge == sides[from].edge) ++to;
    if (to - from != 2) continue;
    for (const std::uint32_t vertex : {sides[from].edge.first, sides[from].edge.second}) {
      const std::uint32_t a = root_of(corner_of(sides[from].triangle, vertex)),
                          b = root_of(corner_of(sides[from + 1].triangle, vertex));
      parent[std::max(a, b)] = std::min(a, b);
    }
  }
  SurfaceMesh cut;
  std::vector<std::uint32_t> index(parent.size(), kRemoved);
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    std::array<std::uint32_t, 3> corners{};
    for (std::uint32_t k = 0; k < 3; ++k) {
      std::uint32_t& known = index[root_of(3 * i + k)];
      if (known == kRemoved) {
        known = static_cast<std::uint32_t>(cut.vertices.size());
        cut.vertices.push_back(mesh.vertices[mesh.triangles[i][k]]);
      }
      corners[k] = known;
    }
    cut.triangles.push_back(corners);
  }
  return cut;
}

SurfaceMesh RemoveSmallPieces(const SurfaceMesh& mesh, std::size_t min_triangles) {
  // Union-find over the vertices.
  std::vector<std::uint32_t> parent(mesh.vertices.size());
  std::iota(parent.begin(), parent.end(), 0U);
  const auto root_of = [&](std::uint32_t vertex) {
    while (parent[vertex] != vertex) vertex = parent[vertex] = parent[parent[vertex]];
    return vertex;
  };
  for (const auto& t : mesh.triangles) {
    for (std::size_t i = 1; i < 3; ++i) {
      const std::uint32_t a = root_of(t[0]), b = root_of(t[i]);
      parent[std::max(a, b)] = std::min(a, b);
    }
  }
  std::vector<std::size_t> size(mesh.vertices.size(), 0);
  for (const auto& t : mesh.triangles) ++size[root_of(t[0])];
  SurfaceMesh kept;
  std::vector<std::uint32_t> index(mesh.vertices.size(), kRemoved);
  for (auto t : mesh.triangles) {
    if (size[root_of(t[0])] < min_triangles) continue;
    for (std::uint32_t& vertex : t) {
      if (index[vertex] == kRemoved) {
        index[vertex] = static_cast<std::uint32_t>(kept.vertices.size());
        kept.vertices.push_back(mesh.vertices[vertex]);
      }
      vertex = index[vertex];
    }
    kept.triangles.push_back(t);
  }
  return kept;
}

}  // namespace docent::engine
