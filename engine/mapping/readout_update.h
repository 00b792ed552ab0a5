// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "engine/geometry/camera_model.h"
#include "engine/map/map.h"

namespace docent::engine {

// Gives all keyframes of a map that have the lens of `newest` its readout time, which was estimated more
// precisely meanwhile, and recomputes the directions of infinite points. Poses and finite points follow in
// the next adjustment. True if something changed. Mapper's thread.
bool UpdateReadout(const CameraModel& newest, Map* map);

}  // namespace docent::engine
