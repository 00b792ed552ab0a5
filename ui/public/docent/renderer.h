// SPDX-License-Identifier: Apache-2.0
#pragma once

// Drawing a scene over the video through the lens of its camera, with or without a display. Target:
// Docent::ui.

#include "docent/scene.h"
#include "docent/system.h"
#include "ui/context.h"
#include "ui/renderer.h"
