// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

// The container of a glTF file: plain JSON text (.gltf), or the chunks of a GLB (glTF 2.0 §4.4).
namespace docent::content {

struct GltfContainer {
  std::string_view json;  // A view into the input bytes.
  std::optional<std::span<const std::uint8_t>>
      bin;  // A view into the input bytes; empty when there is no BIN chunk.
  bool is_glb = false;
};

// Splits the file's bytes, which must outlive the result. Throws Error for glTF 1.0, for missing or duplicate
// chunks, and for a GLB whose lengths disagree with each other or with the number of bytes (a truncated
// file).
GltfContainer SplitGltf(std::string_view file, std::span<const std::uint8_t> bytes);

// Makes a GLB of this JSON text and binary chunk, padded according to the standard (no BIN chunk if `bin` is
// empty). The caller ensures that the total is below 4 GiB.
std::vector<std::uint8_t> MakeGlb(std::string_view json, std::span<const std::uint8_t> bin);

}  // namespace docent::content
