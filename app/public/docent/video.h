// SPDX-License-Identifier: Apache-2.0
#pragma once

// Images with their times from devices, videos, folders and the simulator, and calibration files. Target:
// Docent::cameras.

#include "app/calibration/calibration_file.h"
#include "app/cameras/frame_source.h"
#include "docent/geometry.h"
