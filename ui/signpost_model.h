// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "content/scene.h"

namespace docent::ui {

// The signpost's body as a model: a board on a pole with a foot. Model axes are glTF's (y up, the reader
// stands at +z); the foot is at the origin and the board is one unit high. The board carries the text and,
// when the sign points to a map, a strip with an arrow and that map's name. The texture stays below 1024 x
// 1024 pixels however long the text is; what does not fit is cut with an ellipsis.
std::shared_ptr<const content::Model> MakeSignpostModel(const content::Signpost& signpost);

// Where that model stands in the map: on its anchor, upright along `up`, turned about it so that the board
// faces a reader at eye_in_map (metres, map). When the reader looks along `up` itself, some direction is
// taken.
engine::Sim3 SignpostPose(const content::Signpost& signpost, const Eigen::Vector3d& eye_in_map);

}  // namespace docent::ui
