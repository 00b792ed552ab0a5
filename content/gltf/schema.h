// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "content/gltf/json.h"

// Checks the structure of glTF 2.0's JSON: the type, range and allowed values of each member, and the array
// that each index refers to. The tables follow the JSON schemas of the standard (glTF 2.0, appendix B).
// Members that Docent does not read are ignored.
namespace docent::content {

// Throws Error for the first member of a wrong type or range, missing required member or index beyond its
// array. Afterwards every member in the tables can be read with its type without further checks, every number
// fits a float, and every index is in range.
void CheckSchema(std::string_view file, const Json& root);

}  // namespace docent::content
