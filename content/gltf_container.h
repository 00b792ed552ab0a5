// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

// The outer shell of a glTF file: plain JSON text (.gltf), or the chunks of a GLB (glTF 2.0 §4.4).
namespace docent::content {

struct GltfContainer {
  std::string_view json;                             // into the bytes that were split
  std::optional<std::span<const std::uint8_t>> bin;  // likewise; empty when there is no BIN chunk
  bool is_glb = false;
};

// Splits the file's bytes, which must outlive the result. Throws Error for a GLB whose lengths disagree with
// each other or with the bytes that are there (a cut-off file), for missing or doubled chunks, and for
// glTF 1.0.
GltfContainer SplitGltf(std::string_view file, std::span<const std::uint8_t> bytes);

// A GLB of this JSON text and binary chunk, padded as the standard asks (empty `bin`: no BIN chunk). The
// caller has seen to it that both together stay below 4 GiB.
std::vector<std::uint8_t> MakeGlb(std::string_view json, std::span<const std::uint8_t> bin);

}  // namespace docent::content
