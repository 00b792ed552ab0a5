// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "content/alignment.h"
#include "content/model.h"
#include "engine/geometry/sim3.h"

// Smooth deformations of a model, so that a scan or a plan that is not quite like the real object can be laid
// over it. Pure functions; thread-safe.
namespace docent::content {

inline constexpr std::size_t kMinWarpPoints = 4, kMaxWarpPoints = 64;
inline constexpr double kMaxWarpNumber = 1e12;  // Of each coordinate, weight and entry of the affine part.

// A deformation of the space of a model, in its axes and metres:
//   x -> affine * (x, 1) + sum over i of weights[i] * |x - controls[i]|
// the thin-plate spline in three dimensions, whose kernel is the distance (Duchon 1977; Bookstein 1989).
struct Warp {
  std::vector<Eigen::Vector3d> controls, weights;  // Equally many.
  Eigen::Matrix<double, 3, 4> affine = Eigen::Matrix<double, 3, 4>::Identity();

  Eigen::Vector3d operator()(const Eigen::Vector3d& x) const;
  // The derivative at x. At a control point the kernel has none; its part is left out there.
  Eigen::Matrix3d Jacobian(const Eigen::Vector3d& x) const;
};

// The smoothest deformation after which the model, at this pose, has each point at its place in the map.
// Throws Error with one sentence for fewer than kMinWarpPoints or more than kMaxWarpPoints correspondences,
// for points of the model of which two coincide or that lie in one plane, and for numbers that are not finite
// or too large.
Warp FitWarp(std::span<const Correspondence> correspondences, const engine::Sim3& map_from_model);

// The point that the warp takes to `warped`, by Newton's method; empty where it finds none, as beyond a fold.
std::optional<Eigen::Vector3d> Unwarped(const Warp& warp, const Eigen::Vector3d& warped);

// What is wrong with a stored warp, as the end of a sentence; empty if nothing is.
std::string Validate(const Warp& warp);

// The model in its rest pose with every vertex, normal and tangent deformed. It has no animations. Where a
// node or the warp mirrors, the corners of the triangles are in the opposite order, so that fronts stay
// fronts.
std::shared_ptr<const Model> Warped(const Model& model, const Warp& warp);

}  // namespace docent::content
