// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace docent::maps {

// What could be saved of a damaged library.
struct Recovery {
  std::size_t maps_whole = 0;         // exactly as they were saved
  std::size_t maps_in_part = 0;       // without some keyframes, points or their content
  std::vector<std::string> problems;  // a sentence for each thing that is lost
};

// Reads what a damaged file still holds and writes it into a new library, which verifies. The damaged file is
// not changed. A keyframe whose image is lost goes with its points; a map whose tables are lost is lost; a
// scene one of whose assets is lost goes whole, because it would not open. Throws docent::Error when the
// file is no library at all, the new one exists already or cannot be written, or nothing could be saved: then
// no new file is left.
Recovery Recover(const std::filesystem::path& damaged, const std::filesystem::path& target);

}  // namespace docent::maps
