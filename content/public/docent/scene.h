// SPDX-License-Identifier: Apache-2.0
#pragma once

// Content of maps: models from files, signposts, scenes, and where to place them. Target: Docent::content.

#include "content/asset.h"
#include "content/load_limits.h"
#include "content/placement.h"
#include "content/scene.h"
#include "docent/geometry.h"
