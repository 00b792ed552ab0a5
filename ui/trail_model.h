// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "content/scene.h"

namespace docent::ui {

// The ribbon of a trail and the arrows on it, relative to its first point in the axes and the unit of the
// map. It lies across the trail's up direction, with its front towards it, and is seen from both sides.
std::shared_ptr<const content::Model> MakeTrailModel(const content::Trail& trail);

}  // namespace docent::ui
