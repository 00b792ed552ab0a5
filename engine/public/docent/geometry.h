// SPDX-License-Identifier: Apache-2.0
#pragma once

// Times, errors, rotations, rigid and similarity transforms, and the camera model. Target: Docent::geometry.

#include <Eigen/Core>

#include "engine/base/error.h"
#include "engine/base/time.h"
#include "engine/geometry/camera_model.h"
#include "engine/geometry/rigid3.h"
#include "engine/geometry/sim3.h"

// The layout of types with Eigen members depends on these macros, which the targets of the package define.
static_assert(EIGEN_MAX_ALIGN_BYTES == 32 && EIGEN_MAX_STATIC_ALIGN_BYTES == 32 &&
                  EIGEN_MALLOC_ALREADY_ALIGNED == 0,
              "Docent was compiled with another alignment of Eigen's types: link the targets Docent::...");
