// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "engine/geometry/rigid3.h"

// The essential matrix E of two calibrated views: ray_b . (E ray_a) = 0, E = [t]x R with b_from_a = (R, t).
// Free functions without state; any thread.
namespace docent::engine {

// Every real essential matrix (at most ten) that satisfies five ray pairs, each of Frobenius norm 1. The
// cubic constraints on the null space (Nister 2004) are solved through the eigenvectors of a 10x10 action
// matrix (Stewenius, Engels and Nister 2006). The rays need not have unit length. Empty if the five pairs are
// degenerate.
std::vector<Eigen::Matrix3d> SolveFivePoint(std::span<const Eigen::Vector3d, 5> rays_in_a,
                                            std::span<const Eigen::Vector3d, 5> rays_in_b);

// The essential matrix [t]x R of a pose.
Eigen::Matrix3d EssentialFromPose(const Rigid3& b_from_a);

// The four poses of an essential matrix, with |translation| = 1: two rotations (the twisted pair), each with
// both signs of the translation. Only cheirality distinguishes them. The first two share a rotation.
std::array<Rigid3, 4> PosesFromEssential(const Eigen::Matrix3d& essential);

}  // namespace docent::engine
