// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "content/placement.h"
#include "content/scene.h"

// Labels, images, sounds and trails as they are placed in a map, by a command and as a preview. Map units
// mean nothing to the user, so sizes follow from the distance of the place from the camera. The entities have
// no names yet. Pure functions; points and directions are in the map.
namespace docent::app {

// The board is above the point.
content::Entity NewLabel(const std::string& text, const Eigen::Vector3d& point, const Eigen::Vector3d& up,
                         double distance);
// Flush with the surface, or upright on it facing the viewer. `scale`: length of the longer side.
content::Entity NewImage(const std::shared_ptr<const content::Asset>& image, const content::SurfaceHit& hit,
                         const Eigen::Vector3d& viewer, const Eigen::Vector3d& up, double scale,
                         bool upright);
content::Entity NewSound(const std::shared_ptr<const content::Asset>& sound, const Eigen::Vector3d& point,
                         double distance);
// `normals`: the sum of the normals of the surfaces that the points are on; where there is none, the trail is
// level.
content::Entity NewTrail(std::vector<Eigen::Vector3d> points, const Eigen::Vector3d& normals,
                         const Eigen::Vector3d& up, double distance);

}  // namespace docent::app
