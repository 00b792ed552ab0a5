// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

namespace docent::content {

// Limits for a model file. A file that exceeds one is rejected with a message before memory is allocated, so
// that a small hostile file cannot exhaust the machine. The defaults allow any model that Docent can draw at
// video rate.
struct LoadLimits {
  std::uint64_t max_file_bytes = 512ull << 20;  // For one file, and for all files of one model together.
  std::uint64_t max_json_bytes = 64ull << 20;   // The JSON text including data URIs.
  std::size_t max_json_values = 2'000'000;      // Objects, arrays and leaves of the JSON text.
  int max_json_depth = 64;                      // Nesting of objects and arrays.
  std::uint64_t max_vertices = 6'000'000;       // For all primitives after strips and fans are unrolled.
  std::uint64_t max_indices = 24'000'000;       // Three per triangle, for all primitives after unrolling.
  // The same, counting each mesh once for each node that shows it.
  std::uint64_t max_drawn_indices = 60'000'000;
  // Primitives, counted in this way too, because each of them is drawn on its own in each frame.
  std::uint64_t max_drawn_primitives = 200'000;
  std::uint64_t max_key_frame_values = 8'000'000;  // For all animation channels.
  int max_image_side_px = 16384;                   // For the longer side of an image.
  std::uint64_t max_image_pixels = 128ull << 20;   // For all images together.
  std::size_t max_nodes = 200'000;                 // For the whole file.
};

}  // namespace docent::content
