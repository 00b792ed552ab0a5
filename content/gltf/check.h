// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "content/gltf/json.h"

// Checks the JSON for consistency with itself and with the actual sizes of the buffers before anything is
// decoded, so that tinygltf and the later decoders only see numbers in range. All functions throw Error with
// a one-sentence message. The checks must run in this order, because each relies on the previous ones.
namespace docent::content {

// Checks for glTF 2.x. A file that asks for a reader of a later 2.x is read as 2.0, with a warning.
void CheckVersion(std::string_view file, const Json& root, std::vector<std::string>* warnings);

// Replaces accessors of a type that glTF 2.0 does not have by 2x2 matrices without data, which no member that
// is read may refer to; so such a file is shown if nothing uses them. May be called before CheckSchema.
void ReplaceUnknownAccessors(Json* root, std::vector<std::string>* warnings);

// The bytes of one component and of one element of an accessor (columns of small matrices are padded,
// §3.6.2.4).
std::uint64_t ComponentBytes(int component_type);
std::uint64_t ElementBytes(std::string_view type, int component_type);
// The same without the padding after the last column, which may be missing for the last element of a view.
std::uint64_t UnpaddedBytes(std::string_view type, int component_type);
int ComponentCount(std::string_view type);

// Checks that every buffer view is inside its buffer, and every accessor and sparse part is aligned and
// inside its view. An accessor without a view takes no bytes in the file, so its count is limited by
// `file_bytes`. buffer_bytes are the actual sizes of the buffers.
void CheckBufferViews(std::string_view file, const Json& root, std::span<const std::uint64_t> buffer_bytes);
void CheckAccessors(std::string_view file, const Json& root, std::uint64_t file_bytes,
                    const LoadLimits& limits);

// Checks that attributes and indices have types that §3.7.2.1 allows, and that the attributes of a primitive
// have equal counts.
void CheckMeshes(std::string_view file, const Json& root);

// Checks that the nodes form a forest and that skins and animation samplers have the required types and
// counts (§3.5, §3.7.3, §3.11).
void CheckNodes(std::string_view file, const Json& root, const LoadLimits& limits);
void CheckSkins(std::string_view file, const Json& root);
void CheckAnimations(std::string_view file, const Json& root);

}  // namespace docent::content
