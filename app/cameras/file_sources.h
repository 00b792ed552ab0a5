// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "app/cameras/frame_source.h"
#include "app/cameras/sequence_layout.h"

// Sources that read files. All throw Error with one sentence; see FrameSource.
namespace docent::app {

// A video. With `timestamps_path` the times are that file's, one an image, and a video that holds fewer or
// more images than the file has times is an Error at the image where it shows. Without it the times are
// the container's own, and a video that ends clearly before its announced length is said to break off.
std::unique_ptr<FrameSource> OpenVideo(const std::filesystem::path& video,
                                       const std::optional<std::filesystem::path>& timestamps_path = {});

// A folder in one of the layouts of sequence_layout.h.
std::unique_ptr<FrameSource> OpenFolder(const std::filesystem::path& folder,
                                        const CameraOptions& options = {});

}  // namespace docent::app
