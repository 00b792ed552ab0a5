// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

#include "engine/tracking/frame_inspection.h"
#include "engine/tracking/tracked_frame.h"

// Debugging output for one frame of a run:
// - frame-N.json: state, quality, poses, and each map point with prediction, match, residual and weight.
// - frame-N-points.png: the image with all searched map points: green for finite inliers, blue for infinite
//   inliers, red for outliers, grey for points not found. A line joins predicted and found pixel, and the
//   radius shows the pyramid level.
// - frame-N-residuals.png: the found points with their residuals, scaled by 20.
// - frame-N-corners.png: the corners of all pyramid levels, with the smaller levels beside the image.
namespace docent::app {

// number: the frame's row in frames.csv, from 0. hint: what the person was asked to do; often empty. For a
// dropped frame, no images are written. Throws Error when the folder cannot be written.
void WriteFrameDump(const std::filesystem::path& folder, std::size_t number,
                    const engine::TrackedFrame& frame, const engine::FrameInspection& inspection,
                    const std::string& hint);

}  // namespace docent::app
