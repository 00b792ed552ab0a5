// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "maps/storage/scene_tools.h"

namespace docent::maps {

// The result of recovering a damaged library.
struct Recovery {
  std::size_t maps_complete = 0;      // Recovered exactly as they were saved.
  std::size_t maps_partial = 0;       // Recovered without some keyframes, points or their content.
  std::vector<std::string> problems;  // One sentence for each loss.
};

// Reads everything readable from a damaged file and writes it to a new library, which passes Library::Verify.
// The damaged file is not changed. The rows are searched in all pages of the file (storage/damaged_file.h),
// so that one is lost only with its own pages, and only what checksums confirm is taken:
//  - A keyframe without a readable image is dropped with the points that have their patch there.
//  - Of a damaged table of keyframes, points or observations, the records in intact blocks are kept. Without
//    observations, each point is observed by its source keyframe only.
//  - A map without readable keyframes is kept only if it has content.
//  - Of a scene, `scenes.read` keeps what is readable; without that function it is dropped if an asset is
//    lost, because it would not open.
//  - Maps keep their keys; signposts that lead to a map that is lost lead nowhere.
// Thumbnails and words are computed anew. Throws docent::Error when the file is not a library, the new file
// already exists or cannot be written, or nothing could be recovered; then no new file is left.
Recovery Recover(const std::filesystem::path& damaged, const std::filesystem::path& target,
                 const SceneTools& scenes = {});

}  // namespace docent::maps
