// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

namespace docent::content {

// What a model file may cost at most. A file that asks for more is refused with a sentence before the memory
// is taken, so that a small hostile file cannot exhaust the machine. The defaults leave room for any model
// that a guide can draw at video rate.
struct LoadLimits {
  std::uint64_t max_file_bytes = 512ull << 20;     // of one file, and of all files of one model together
  std::uint64_t max_json_bytes = 64ull << 20;      // of the JSON text, data URIs included
  std::size_t max_json_values = 2'000'000;         // objects, arrays and leaves of the JSON text
  int max_json_depth = 64;                         // nesting of objects and arrays
  std::uint64_t max_vertices = 6'000'000;          // of all primitives after unrolling
  std::uint64_t max_indices = 24'000'000;          // three a triangle, of all primitives after unrolling
  std::uint64_t max_drawn_indices = 60'000'000;    // the same, each mesh counted as often as nodes show it
  std::uint64_t max_key_frame_values = 8'000'000;  // of all animation channels
  int max_image_side_px = 16384;
  std::uint64_t max_image_pixels = 128ull << 20;  // of all images together
  std::size_t max_nodes = 200'000;
};

}  // namespace docent::content
