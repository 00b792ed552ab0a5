// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <vector>

#include "app/simulator/simulation.h"
#include "engine/dense/densification.h"
#include "engine/geometry/sim3.h"
#include "ui/renderer.h"

// Compares depth, meshes and hidden content with the exact surfaces of a simulation.
namespace docent::app {

// Relative to the true distance.
inline constexpr std::array<double, 5> kDepthTolerances = {0.005, 0.01, 0.02, 0.05, 0.1};
inline constexpr std::size_t kTwoPercent = 2;  // Index of the tolerance that limits refer to.

// Counts of pixels; the shares are empty of meaning before something was counted.
struct DepthFigures {
  std::size_t seen = 0;   // Pixels whose surface another keyframe sees too.
  std::size_t known = 0;  // Of these, those with a depth.
  std::array<std::size_t, kDepthTolerances.size()> correct = {};  // Of these, those within each tolerance.

  double Completeness(std::size_t tolerance = kTwoPercent) const {
    return static_cast<double>(correct[tolerance]) / static_cast<double>(seen);
  }
  double Accuracy(std::size_t tolerance = kTwoPercent) const {
    return static_cast<double>(correct[tolerance]) / static_cast<double>(known);
  }
};

// Measures the depth maps of all keyframes, checked against each other. frames: the frame of each keyframe.
// world_from_map: with the scale of the map.
DepthFigures MeasureDepthMaps(const Simulation& simulation,
                              const std::shared_ptr<const engine::MapSnapshot>& map,
                              const std::vector<int>& frames, const engine::Sim3& world_from_map);
// Measures how far along their rays the pixels of a pyramid level of each keyframe see the mesh. Level 1 has
// the pixels of the depth maps, and each level has a quarter of those of the one before.
DepthFigures MeasureMesh(const Simulation& simulation, const std::shared_ptr<const engine::MapSnapshot>& map,
                         const engine::SurfaceMesh& mesh, int level, const std::vector<int>& frames,
                         const engine::Sim3& world_from_map);

struct OcclusionFigures {
  std::size_t behind = 0,
              hidden = 0;  // Content pixels behind a surface, and those of them that are not drawn.
  std::size_t before = 0,
              wrongly_hidden = 0;      // Content pixels before all surfaces, and those that are not drawn.
  std::vector<double> edge_errors_px;  // From the true edges of objects before the content to the drawn ones.
  std::size_t compared = 0,
              changed = 0;  // Content pixels that should be as in the frame before, and those that are not.

  double HiddenShare() const { return static_cast<double>(hidden) / static_cast<double>(behind); }
  double WronglyHiddenShare() const {
    return static_cast<double>(wrongly_hidden) / static_cast<double>(before);
  }
  double ChangedShare() const { return static_cast<double>(changed) / static_cast<double>(compared); }
  double MedianEdgeError_px() const;
};

// Draws a plane of content across the view of a frame, in the middle of the depths that it sees, and adds
// what is hidden. keyframes: the frames of the keyframes; pixels whose surface fewer than two of them see are
// left out, as are those where the plane is within 3 % of the surface. A pixel is hidden if more than half of
// the content's colour is gone. image: receives the drawn image; may be null.
void AddOcclusion(const Simulation& simulation, int frame, const engine::Rigid3& camera_from_map,
                  double map_units_per_metre, const std::vector<int>& keyframes,
                  const std::shared_ptr<const engine::SurfaceMesh>& surfaces, ui::Renderer* renderer,
                  OcclusionFigures* figures, cv::Mat* image);

// Draws the same plane in a frame and in the next one, and adds the content pixels that are hidden in one of
// them only although the plane is on the same side of the surface in both. A pixel of the next frame is
// compared with those within 1 px of where its content was, because edges move by parts of a pixel.
// camera_from_map: of both frames.
void AddFlicker(const Simulation& simulation, int frame, const std::array<engine::Rigid3, 2>& camera_from_map,
                double map_units_per_metre, const std::shared_ptr<const engine::SurfaceMesh>& surfaces,
                ui::Renderer* renderer, OcclusionFigures* figures);

}  // namespace docent::app
