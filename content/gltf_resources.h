// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "content/gltf_json.h"

// The bytes that a glTF file points to: its binary chunk, data URIs, and files beside it.
namespace docent::content {

// All bytes of a regular file; throws Error when it cannot be read or is larger than `max_bytes`.
std::vector<std::uint8_t> ReadFileBytes(const std::filesystem::path& path, std::uint64_t max_bytes);

// The file that a relative URI of a model names, inside `folder` also after every symbolic link is followed.
// Throws Error for anything else: other schemes, absolute paths, "..", a broken escape, a missing file.
std::filesystem::path ResolveUri(std::string_view file, std::string_view place, const std::string& uri,
                                 const std::filesystem::path& folder);

// The bytes of a "data:" URI (RFC 2397, base64 of RFC 4648 or percent-encoded); empty when it is damaged.
std::optional<std::vector<std::uint8_t>> DecodeDataUri(std::string_view uri);
bool IsDataUri(std::string_view uri);

// A glTF whose buffers are one run of bytes and whose images all lie in it.
struct PackedGltf {
  Json json;  // one buffer without URI (none when `bin` is empty); images by buffer view
  std::vector<std::uint8_t> bin;
  bool was_self_contained = true;  // false when something came from another file
};

// Gathers everything. `root` has passed CheckSchema; buffer views are checked against their buffers' true
// sizes on the way. With `folder` empty nothing but the binary chunk and data URIs can be pointed to.
PackedGltf PackGltf(std::string_view file, Json root, std::optional<std::span<const std::uint8_t>> bin,
                    const std::optional<std::filesystem::path>& folder, const LoadLimits& limits);

}  // namespace docent::content
