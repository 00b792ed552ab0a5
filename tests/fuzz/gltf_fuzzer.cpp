// SPDX-License-Identifier: Apache-2.0
// Loads any bytes as an asset of a library: they must load or be rejected with a docent::Error. The limits
// are low, so that a large but valid asset does not appear as a hang.
#include <cstddef>
#include <cstdint>
#include <vector>

#include "content/asset.h"
#include "engine/base/error.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  docent::content::LoadLimits limits;
  limits.max_file_bytes = 1 << 20;
  limits.max_json_values = 20'000;
  limits.max_vertices = limits.max_indices = limits.max_drawn_indices = 100'000;
  limits.max_key_frame_values = 100'000;
  limits.max_image_pixels = 1 << 18;
  limits.max_nodes = 2'000;
  try {
    const docent::content::Asset asset =
        docent::content::AssetFromBytes("fuzz", std::vector<std::uint8_t>(data, data + size), limits);
    if (!asset.model) return 0;  // A sound.
    const int animations = static_cast<int>(asset.model->animations.size());
    for (int i = -1; i < animations && i < 4; ++i) docent::content::NodeMatrices(*asset.model, i, 0.7);
  } catch (const docent::Error&) {
    return 0;
  }
  return 0;
}
