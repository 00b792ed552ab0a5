// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace docent::maps {

// The result of recovering a damaged library.
struct Recovery {
  std::size_t maps_complete = 0;      // Recovered exactly as they were saved.
  std::size_t maps_partial = 0;       // Recovered without some keyframes, points or their content.
  std::vector<std::string> problems;  // One sentence for each loss.
};

// Reads everything readable from a damaged file and writes it to a new library, which passes Library::Verify.
// The damaged file is not changed. A keyframe without a readable image is dropped with its points. A map
// without readable tables is dropped. A scene is dropped completely if one of its assets is unreadable,
// because it would not open. Throws docent::Error when the file is not a library, the new file already exists
// or cannot be written, or nothing could be recovered; then no new file is left.
Recovery Recover(const std::filesystem::path& damaged, const std::filesystem::path& target);

}  // namespace docent::maps
