// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "content/load_limits.h"

// JSON text of a glTF file, parsed under limits. The nested containers of hostile text ("[[[[…") and their
// number are counted while they are read, so that a bomb stops at its limit and not at the end of memory.
namespace docent::content {

using Json = nlohmann::json;

// Throws Error "FILE: PLACE WHAT", the one form of every sentence about a model file. `place` may be empty.
[[noreturn]] void Refuse(std::string_view file, std::string_view place, std::string_view what);

// The parsed text; throws Error when it is not JSON, not an object, or beyond the limits.
Json ParseGltfJson(std::string_view file, std::string_view text, const LoadLimits& limits);

// Member `name` of an object as an unsigned number, or `fallback` when it is absent. The caller has checked
// that it is a whole number of that range.
std::uint64_t UnsignedOr(const Json& object, const char* name, std::uint64_t fallback);
// Member `name` as an index, -1 when it is absent. The caller has checked that it is in range.
int IndexOr(const Json& object, const char* name);
// Length of the array member `name` of an object, 0 when it is absent.
std::size_t CountOf(const Json& object, const char* name);
// The array or object member `name`, or an empty one of that kind.
const Json& ArrayOf(const Json& object, const char* name);
const Json& ObjectOf(const Json& object, const char* name);

// "nodes[3]"
std::string Place(std::string_view array, std::size_t index);

}  // namespace docent::content
