// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "app/cameras/frame_source.h"
#include "app/cameras/sequence_layout.h"

// Sources that read video files and image sequences. All throw Error with one sentence; see FrameSource.
namespace docent::app {

// Opens a video. With `timestamps_path`, the timestamps come from that file, one for each image; a different
// number of images and timestamps is an Error at the image where it is detected. Without it, the timestamps
// come from the container, and a warning says if the video ends well before the length that its header
// states.
std::unique_ptr<FrameSource> OpenVideo(const std::filesystem::path& video,
                                       const std::optional<std::filesystem::path>& timestamps_path = {});

// Opens a folder in one of the layouts of sequence_layout.h.
std::unique_ptr<FrameSource> OpenFolder(const std::filesystem::path& folder,
                                        const CameraOptions& options = {});

}  // namespace docent::app
