// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <span>
#include <vector>

namespace docent::ui {

// Moves boards apart that overlap. Each keeps its place if it can, else it gets the nearest free one above,
// below or beside the boards before it, moved into `bounds`; where there is none, it stays. The
// result depends on nothing else, so that boards that move slowly do not jump. Boards are at least `gap`
// apart. Pure; any thread.
std::vector<Eigen::AlignedBox2d> LayOutApart(std::span<const Eigen::AlignedBox2d> boards,
                                             const Eigen::AlignedBox2d& bounds, double gap);

}  // namespace docent::ui
