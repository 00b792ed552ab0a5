// SPDX-License-Identifier: Apache-2.0
#pragma once

// Tracking and mapping: the System, what it takes (Frame, CameraModel) and what it returns (TrackedFrame,
// SystemEvent, MapSnapshot). Target: Docent::engine.

#include "docent/geometry.h"
#include "engine/initialization/hint.h"
#include "engine/map/map_snapshot.h"
#include "engine/matching/point_match.h"
#include "engine/recognition/place.h"
#include "engine/recognition/place_index.h"
#include "engine/system/camera_rig.h"
#include "engine/system/system.h"
#include "engine/system/system_event.h"
#include "engine/tracking/frame_inspection.h"
#include "engine/tracking/relocalization_result.h"
#include "engine/tracking/tracked_frame.h"
#include "engine/vision/frame.h"
