// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "content/gltf_json.h"

// What the JSON says, held against itself and against the true sizes of the buffers, before anything is
// decoded: tinygltf and the decoders after it then work on numbers that are known to be in range. Everything
// throws Error with one sentence. The steps go in this order, each relying on those before it.
namespace docent::content {

// glTF 2.x, and no required extension that Docent cannot read.
void CheckVersion(std::string_view file, const Json& root);

// Whether the extension's name stands in extensionsUsed.
bool UsesExtension(const Json& root, std::string_view name);

// Bytes of one component and of one element of an accessor (columns of small matrices padded, §3.6.2.4).
std::uint64_t ComponentBytes(int component_type);
std::uint64_t ElementBytes(std::string_view type, int component_type);
// Without the padding after the last column, which the last element of a view may lack.
std::uint64_t UnpaddedBytes(std::string_view type, int component_type);
int ComponentCount(std::string_view type);

// Every buffer view inside its buffer, every accessor inside its view and aligned, every sparse part
// likewise. An accessor without a view costs no bytes in the file: its count is bounded by `file_bytes`.
// buffer_bytes: the true number of bytes of each buffer.
void CheckBufferViews(std::string_view file, const Json& root, std::span<const std::uint64_t> buffer_bytes);
void CheckAccessors(std::string_view file, const Json& root, std::uint64_t file_bytes,
                    const LoadLimits& limits);

// Attributes and indices of the kinds that §3.7.2.1 allows, all of one count within a primitive.
void CheckMeshes(std::string_view file, const Json& root);

// Nodes form a forest, skins and animation samplers have the kinds and counts that
// they need (§3.5, §3.7.3, §3.11).
void CheckNodes(std::string_view file, const Json& root, const LoadLimits& limits);
void CheckSkins(std::string_view file, const Json& root);
void CheckAnimations(std::string_view file, const Json& root);

}  // namespace docent::content
