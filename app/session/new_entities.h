// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>
#include <vector>

#include "app/script/commands.h"
#include "content/placement.h"
#include "content/scene.h"

// Labels, images, sounds, trails and occluders as they are placed in a map, by a command and as a preview.
// Map units mean nothing to the user, so sizes follow from the distance of the place from the camera. The
// entities have no names yet. Pure functions; points and directions are in the map.
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

// `places`: where it stands, or the corners of a polygon. See PlaceOccluder for the rest. Throws Error when
// the corners enclose no area.
content::Entity NewOccluder(const PlaceOccluder& command, std::span<const content::SurfaceHit> places,
                            const Eigen::Vector3d& viewer, const Eigen::Vector3d& up);

}  // namespace docent::app
