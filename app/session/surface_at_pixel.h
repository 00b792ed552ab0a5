// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "content/placement.h"
#include "engine/geometry/camera_model.h"
#include "engine/tracking/tracked_frame.h"

// Finds the point of the map's surface at a pixel that a user points at. Pure functions; any thread.
namespace docent::app {

// Throws Error with one sentence when the frame has no pose.
void RequirePose(const engine::TrackedFrame& frame);

// The surface that the frame shows at a pixel: at the distance that is measured in the images of keyframes,
// else where the map points around the pixel are. Throws Error with one sentence when the frame has no pose,
// the lens does not see anything at the pixel, or the map has no surface there.
content::SurfaceHit SurfaceAtPixel(const engine::TrackedFrame& frame, const engine::CameraModel& camera,
                                   const Eigen::Vector2d& pixel);
// The same from the map points alone, for what needs the plane around the pixel and not the point itself, as
// the floor does.
content::SurfaceHit PlaneAtPixel(const engine::TrackedFrame& frame, const engine::CameraModel& camera,
                                 const Eigen::Vector2d& pixel);

}  // namespace docent::app
