// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "content/scene.h"

namespace docent::ui {

// What authors see of an occluder: its faces, of which everything behind remains visible, in the axes and the
// unit of its shape.
std::shared_ptr<const content::Model> MakeOccluderModel(const content::Occluder& occluder);

}  // namespace docent::ui
