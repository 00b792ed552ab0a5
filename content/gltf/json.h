// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "content/load_limits.h"

// Parses the JSON text of a glTF file under limits. Nesting depth and number of values are counted while the
// text is read, so that hostile text ("[[[[…") stops at the limit instead of exhausting memory.
namespace docent::content {

using Json = nlohmann::json;

// Throws Error "FILE: PLACE WHAT", the form of all messages about model files. `place` may be empty.
[[noreturn]] void Refuse(std::string_view file, std::string_view place, std::string_view what);

// Returns the parsed text; throws Error when it is not JSON, not an object, or exceeds the limits.
Json ParseGltfJson(std::string_view file, std::string_view text, const LoadLimits& limits);

// Returns member `name` of an object as an unsigned number, or `fallback` when it is missing. The caller has
// checked that it is an integer in range.
std::uint64_t UnsignedOr(const Json& object, const char* name, std::uint64_t fallback);
// Returns the length of the array member `name` of an object, or 0 when it is missing.
std::size_t CountOf(const Json& object, const char* name);
// Returns the array or object member `name`, or an empty one when it is missing.
const Json& ArrayOf(const Json& object, const char* name);
const Json& ObjectOf(const Json& object, const char* name);

// For example "nodes[3]".
std::string Place(std::string_view array, std::size_t index);

}  // namespace docent::content
