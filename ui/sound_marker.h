// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "content/scene.h"

namespace docent::ui {

// A round sign with a loudspeaker that shows authors where a sound is. The same model for all sounds.
std::shared_ptr<const content::Model> SoundMarkerModel();

// The pose of that model in the map: its middle is at the sound's position and its front faces a reader at
// eye_in_map (map units). It grows with the sound's range, but stays between 1/30 and 1/8 of the distance.
engine::Sim3 SoundMarkerPose(const content::Sound& sound, const Eigen::Vector3d& eye_in_map);

}  // namespace docent::ui
