// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "content/placement.h"
#include "engine/geometry/camera_model.h"
#include "engine/tracking/tracked_frame.h"

// From a pixel that a person points at to the map's surface seen there. Pure functions; any thread.
namespace docent::app {

// The surface that the frame shows at a pixel. Throws Error with one sentence when the frame has no pose, the
// pixel no ray, or the map no surface there.
content::SurfaceHit SurfaceAtPixel(const engine::TrackedFrame& frame, const engine::CameraModel& camera,
                                   const Eigen::Vector2d& pixel);

// Upwards in a map, unit length: against the mean of where its keyframes' images have their lower edge. A
// map knows no gravity; people hold cameras level on the whole, and the mean of many keyframes is steadier
// than the first one alone.
Eigen::Vector3d UpInMap(const engine::MapSnapshot& map);

}  // namespace docent::app
