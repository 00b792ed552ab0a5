// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>

#include "engine/tracking/frame_inspection.h"
#include "engine/tracking/tracked_frame.h"

// Everything about one frame of a run, for whoever looks for a fault in it:
//   frame-N.json           state, quality, poses, and each point with its prediction, match, residual and
//   weight frame-N-points.png     the image with each point: green found and believed, red found and not
//   believed,
//                          grey not found; blue instead of green for a direction; a line from where it was
//                          looked for to where it was found; the size says the pyramid level
//   frame-N-residuals.png  what was found, with its residual twenty times as long
//   frame-N-corners.png    the corners of all pyramid levels, the smaller levels beside the image
namespace docent::app {

// number: the frame's line in frames.csv, counted from 0. The images are left out for a frame that was
// dropped. Throws Error when the folder cannot be written.
void WriteFrameDump(const std::filesystem::path& folder, std::size_t number,
                    const engine::TrackedFrame& frame, const engine::FrameInspection& inspection);

}  // namespace docent::app
