// SPDX-License-Identifier: Apache-2.0
#include "content/warp.h"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "content/mesh_tools.h"
#include "content/model_bounds.h"
#include "engine/base/error.h"

namespace docent::content {
namespace {

constexpr double kMinGapRatio = 1e-4;        // Of two control points, to the extent of all.
constexpr double kMinThicknessRatio = 1e-3;  // Of the smallest spread to the largest.

Eigen::Vector3d EigenFrom(const glm::vec3& v) {
  return {static_cast<double>(v.x), static_cast<double>(v.y), static_cast<double>(v.z)};
}
glm::dvec3 GlmFromEigen(const Eigen::Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}

void RefuseUnsuitable(std::span<const Correspondence> correspondences) {
  if (correspondences.size() < kMinWarpPoints) {
    throw Error("At least " + std::to_string(kMinWarpPoints) +
                " points of the model with their places in the map are needed to bend it.");
  }
  if (correspondences.size() > kMaxWarpPoints)
    throw Error("A model can be bent by at most " + std::to_string(kMaxWarpPoints) + " points.");
  Eigen::Matrix3Xd points(3, static_cast<Eigen::Index>(correspondences.size()));
  for (std::size_t i = 0; i < correspondences.size(); ++i) {
    if (!correspondences[i].in_model.allFinite() || !correspondences[i].in_map.allFinite())
      throw Error("A point is not finite.");
    points.col(static_cast<Eigen::Index>(i)) = correspondences[i].in_model;
  }
  const Eigen::Matrix3Xd centred = points.colwise() - points.rowwise().mean().eval();
  const Eigen::JacobiSVD<Eigen::Matrix3Xd> svd(centred);
  const Eigen::Vector3d spread = svd.singularValues();
  if (!(spread[0] > 0)) throw Error("The points of the model coincide.");
  if (!(spread[2] > kMinThicknessRatio * spread[0]))
    throw Error("The points of the model lie in one plane; choose at least one beside it.");
  for (Eigen::Index a = 0; a < points.cols(); ++a) {
    for (Eigen::Index b = 0; b < a; ++b) {
      if ((points.col(a) - points.col(b)).norm() < kMinGapRatio * spread[0])
        throw Error("Two points of the model coincide.");
    }
  }
}

// Where a vertex is in the rest pose, and the transform that takes it there.
struct RestVertex {
  Eigen::Vector3d position;
  Eigen::Matrix3d model_from_vertex;
};

RestVertex AtRest(const Vertex& vertex, const glm::mat4& model_from_vertex) {
  RestVertex rest;
  rest.position = EigenFrom(glm::vec3(model_from_vertex * glm::vec4(vertex.position, 1)));
  for (int column = 0; column < 3; ++column)
    rest.model_from_vertex.col(column) = EigenFrom(glm::vec3(model_from_vertex[column]));
  return rest;
}

// Normals are transformed by the inverse transpose, which the cofactor matrix is up to a factor; it exists
// for every matrix.
Eigen::Matrix3d Cofactors(const Eigen::Matrix3d& m) {
  Eigen::Matrix3d cofactors;
  cofactors.col(0) = m.col(1).cross(m.col(2));
  cofactors.col(1) = m.col(2).cross(m.col(0));
  cofactors.col(2) = m.col(0).cross(m.col(1));
  return m.determinant() < 0 ? Eigen::Matrix3d(-cofactors) : cofactors;
}

// `transform`: of directions at the vertex, to the bent model; `position`: in the bent model.
Vertex WarpedVertex(const Vertex& vertex, const Eigen::Matrix3d& transform, const Eigen::Vector3d& position) {
  Vertex warped = vertex;
  warped.position = glm::vec3(GlmFromEigen(position));
  warped.normal = UnitOr(GlmFromEigen(Cofactors(transform) * EigenFrom(vertex.normal)), vertex.normal);
  const glm::vec3 tangent(vertex.tangent);
  const float handedness = transform.determinant() < 0 ? -vertex.tangent.w : vertex.tangent.w;
  warped.tangent = glm::vec4(UnitOr(GlmFromEigen(transform * EigenFrom(tangent)), tangent), handedness);
  warped.joints = glm::u16vec4(0);
  warped.weights = glm::vec4(0);
  return warped;
}

// `joints` and `node`: as for RestMatrix.
void WarpPrimitive(const std::vector<glm::mat4>& joints, const glm::mat4& node, const Warp& warp,
                   Primitive* primitive) {
  std::vector<bool> mirrors;
  mirrors.reserve(primitive->vertices.size());
  for (Vertex& vertex : primitive->vertices) {
    const RestVertex rest = AtRest(vertex, RestMatrix(vertex, joints, node));
    const Eigen::Matrix3d transform = warp.Jacobian(rest.position) * rest.model_from_vertex;
    mirrors.push_back(transform.determinant() < 0);
    vertex = WarpedVertex(vertex, transform, warp(rest.position));
  }
  // The order of its corners says which side of a triangle is its front, and a reflection reverses it.
  std::vector<std::uint32_t>& indices = primitive->indices;
  for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
    if (mirrors[indices[i]]) std::swap(indices[i + 1], indices[i + 2]);
  }
}

}  // namespace

Eigen::Vector3d Warp::operator()(const Eigen::Vector3d& x) const {
  Eigen::Vector3d result = affine.leftCols<3>() * x + affine.col(3);
  for (std::size_t i = 0; i < controls.size(); ++i) result += weights[i] * (x - controls[i]).norm();
  return result;
}

Eigen::Matrix3d Warp::Jacobian(const Eigen::Vector3d& x) const {
  Eigen::Matrix3d result = affine.leftCols<3>();
  for (std::size_t i = 0; i < controls.size(); ++i) {
    const Eigen::Vector3d offset = x - controls[i];
    const double distance = offset.norm();
    if (distance > 0) result += weights[i] * (offset / distance).transpose();
  }
  return result;
}

Warp FitWarp(std::span<const Correspondence> correspondences, const engine::Sim3& map_from_model) {
  RefuseUnsuitable(correspondences);
  const engine::Sim3 model_from_map = map_from_model.inverse();
  const auto count = static_cast<Eigen::Index>(correspondences.size());
  // In coordinates about the mean and of the size of the points, so that the system is well conditioned.
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Correspondence& pair : correspondences) mean += pair.in_model / static_cast<double>(count);
  double size = 0;
  for (const Correspondence& pair : correspondences) size = std::max(size, (pair.in_model - mean).norm());
  Eigen::MatrixXd system = Eigen::MatrixXd::Zero(count + 4, count + 4);
  Eigen::MatrixXd places = Eigen::MatrixXd::Zero(count + 4, 3);
  Warp warp;
  for (Eigen::Index i = 0; i < count; ++i) {
    const Correspondence& pair = correspondences[static_cast<std::size_t>(i)];
    warp.controls.push_back(pair.in_model);
    for (Eigen::Index j = 0; j < i; ++j) {
      const double distance = (pair.in_model - warp.controls[static_cast<std::size_t>(j)]).norm() / size;
      system(i, j) = system(j, i) = distance;
    }
    system.block<1, 3>(i, count) = (pair.in_model - mean).transpose() / size;
    system(i, count + 3) = 1;
    system.col(i).tail<4>() = system.row(i).tail<4>().transpose();
    places.row(i) = (model_from_map * pair.in_map - mean).transpose() / size;
  }
  const Eigen::MatrixXd solution = system.fullPivLu().solve(places);
  // Back to metres: y = size * (A (x - mean) / size + b + sum w |x - c| / size) + mean.
  for (Eigen::Index i = 0; i < count; ++i) warp.weights.emplace_back(solution.row(i).transpose());
  const Eigen::Matrix3d linear = solution.block<3, 3>(count, 0).transpose();
  warp.affine.leftCols<3>() = linear;
  warp.affine.col(3) = mean + size * solution.row(count + 3).transpose() - linear * mean;
  if (!Validate(warp).empty()) throw Error("The points are too far from each other to bend the model.");
  return warp;
}

std::optional<Eigen::Vector3d> Unwarped(const Warp& warp, const Eigen::Vector3d& warped) {
  constexpr int kIterations = 30;   // Four to six are usual.
  constexpr double kAgrees = 1e-9;  // Relative to the size of the point and its displacement.
  Eigen::Vector3d x = warped;
  const double scale = 1e-12 + warped.norm() + (warp(x) - warped).norm();
  for (int i = 0; i < kIterations; ++i) {
    const Eigen::Vector3d error = warp(x) - warped;
    if (!error.allFinite()) return std::nullopt;
    if (error.norm() <= kAgrees * scale) return x;
    const Eigen::FullPivLU<Eigen::Matrix3d> jacobian(warp.Jacobian(x));
    if (!jacobian.isInvertible()) return std::nullopt;
    x -= jacobian.solve(error);
  }
  return std::nullopt;
}

std::string Validate(const Warp& warp) {
  if (warp.controls.size() < kMinWarpPoints || warp.controls.size() > kMaxWarpPoints ||
      warp.weights.size() != warp.controls.size())
    return "would be bent by a number of points that is not between " + std::to_string(kMinWarpPoints) +
           " and " + std::to_string(kMaxWarpPoints);
  const auto is_in_range = [](const auto& numbers) {
    return (numbers.array().abs() <= kMaxWarpNumber).all();  // false for NaN
  };
  for (std::size_t i = 0; i < warp.controls.size(); ++i) {
    if (!is_in_range(warp.controls[i]) || !is_in_range(warp.weights[i]))
      return "would be bent by a number that is out of range";
  }
  return is_in_range(warp.affine) ? "" : "would be bent by a number that is out of range";
}

std::shared_ptr<const Model> Warped(const Model& model, const Warp& warp) {
  auto warped = std::make_shared<Model>();
  warped->name = model.name;
  warped->images = model.images;
  warped->textures = model.textures;
  warped->materials = model.materials;
  const std::vector<glm::mat4> nodes = NodeMatrices(model, -1, 0);
  JointMatrices skins(model, nodes);
  for (std::size_t i = 0; i < model.nodes.size(); ++i) {
    const Node& node = model.nodes[i];
    if (node.mesh < 0) continue;
    const std::vector<glm::mat4>& joints = skins.Of(node);
    Mesh mesh = model.meshes[static_cast<std::size_t>(node.mesh)];
    for (Primitive& primitive : mesh.primitives) WarpPrimitive(joints, nodes[i], warp, &primitive);
    Node flat;
    flat.name = node.name;
    flat.mesh = static_cast<int>(warped->meshes.size());
    warped->roots.push_back(static_cast<int>(warped->nodes.size()));
    warped->nodes.push_back(std::move(flat));
    warped->meshes.push_back(std::move(mesh));
  }
  if (const auto bounds = RestBounds(*warped)) std::tie(warped->bounds_min, warped->bounds_max) = *bounds;
  return warped;
}

}  // namespace docent::content
