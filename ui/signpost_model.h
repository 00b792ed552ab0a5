// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "content/scene.h"

namespace docent::ui {

// Makes the geometry of a signpost: a board on a pole with a foot. Model axes are glTF's (y up, the reader at
// +z); the foot is at the origin and the board is one unit high. The board shows the text and, if the sign
// leads to a map, a strip with that map's name. The texture is at most 1024 x 1024 pixels
// however long the text is; text that does not fit ends with an ellipsis.
std::shared_ptr<const content::Model> MakeSignpostModel(const std::string& text, const std::string& to_map);

// The pose of that model in the map: it stands on its anchor, aligned with `up` and rotated about it so that
// the board faces a reader at eye_in_map (map units). When the reader looks along `up`, the rotation is
// arbitrary.
engine::Sim3 SignpostPose(const content::Signpost& signpost, const Eigen::Vector3d& eye_in_map);

// The geometry of the arrow of a signpost: it points along +z (y up) and is centred at the origin. The unit
// is the height of the board. Its head has another colour than its shaft, and its back is dark, so that an
// arrow that points away differs from one that points to the reader. The same model in every call; any
// thread.
std::shared_ptr<const content::Model> SignpostArrowModel();

// The pose of that model in the map: above the middle of the board, in the direction of the signpost, which
// must have one. It is the same for every reader.
engine::Sim3 SignpostArrowPose(const content::Signpost& signpost);

}  // namespace docent::ui
