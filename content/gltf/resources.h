// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "content/gltf/container.h"
#include "content/gltf/json.h"

// Collects the data that a glTF file refers to: its binary chunk, data URIs, and external files.
namespace docent::content {

// Returns all bytes of a regular file; throws Error when it cannot be read or is larger than `max_bytes`.
std::vector<std::uint8_t> ReadFileBytes(const std::filesystem::path& path, std::uint64_t max_bytes);

// Returns the file that a relative URI refers to, which must be inside `folder` after all symbolic links are
// resolved. Throws Error otherwise: for other schemes, absolute paths, "..", invalid escapes and missing
// files.
std::filesystem::path ResolveUri(std::string_view file, std::string_view place, const std::string& uri,
                                 const std::filesystem::path& folder);

// Decodes a "data:" URI (RFC 2397, base64 of RFC 4648 or percent-encoded); empty when it is invalid.
std::optional<std::vector<std::uint8_t>> DecodeDataUri(std::string_view uri);
bool IsDataUri(std::string_view uri);

// A glTF with a single buffer that contains all its data and images.
struct PackedGltf {
  Json json;  // One buffer without URI (none when `bin` is empty); images by buffer view.
  std::vector<std::uint8_t> bin;
  bool was_self_contained = true;  // False when it referred to other files.
  std::vector<std::string> warnings;
};

// Collects all data. `root` must have passed CheckSchema; buffer views are checked against the actual sizes
// of their buffers. If `folder` is empty, only the binary chunk and data URIs are allowed. An image that
// cannot be read is left out with a warning, and so is a buffer on another machine that nothing uses.
PackedGltf PackGltf(std::string_view file, Json root, const GltfContainer& container,
                    const std::optional<std::filesystem::path>& folder, const LoadLimits& limits);

}  // namespace docent::content
