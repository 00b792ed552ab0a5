// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>

#include "engine/geometry/camera_model.h"
#include "engine/map/map.h"

// The readout time of rolling shutters in a map (see ReadoutMotion). All images of one lens have the same.
namespace docent::engine {

// The readout time, seconds, that the images of the camera's lens have in a map; empty if the map has no
// image of that lens whose rotation is known. camera: the lens, or the model of one of its images.
std::optional<Eigen::Vector2d> ReadoutIn(const MapSnapshot& map, const CameraModel& camera);
std::optional<Eigen::Vector2d> ReadoutIn(const Map& map, const CameraModel& camera);

// The largest rotation rate of the images of the camera's lens in a map, radians per second; zero if none is
// known. Without keyframes that wait for their local adjustment, which do not tell the readout time yet.
double LargestRotationRateIn(const MapSnapshot& map, const CameraModel& camera);

// The model of an image with the readout time that its lens has in a map: `camera` itself if the map has
// none, the rotation is not known, or the readout time of the camera is known (CameraModel::known_readout_s).
std::shared_ptr<const CameraModel> WithReadoutIn(const Map& map,
                                                 const std::shared_ptr<const CameraModel>& camera);

// Gives all images of the camera's lens this readout time, and recomputes the directions of infinite points.
// Poses and finite points follow in the next adjustment. True if something changed.
bool SetReadout(const CameraModel& camera, const Eigen::Vector2d& readout_s, Map* map);

// The same for all lenses of two maps in one, of which B has the keyframes from first_of_b on. All images of
// a lens get what a calibration states; otherwise that of A, or of B if A has none. A readout time of zero
// counts as none, because that of a rolling shutter is zero until it is estimated. True if something changed.
bool UniteReadouts(KeyFrameId first_of_b, Map* map);

}  // namespace docent::engine
