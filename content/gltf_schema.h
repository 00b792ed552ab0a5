// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "content/gltf_json.h"

// The shape of glTF 2.0's JSON: which member has which type, range and set of values, and which array each
// index points into. Written as tables after the JSON schemas of the standard (glTF 2.0, appendix B); members
// that no part of Docent reads are left alone.
namespace docent::content {

// Throws Error at the first member of the wrong type or range, the first required member that is missing and
// the first index beyond its array. What holds afterwards: every member named in the tables can be read with
// its type without a further check, every number fits a float, every index lies in its array.
void CheckSchema(std::string_view file, const Json& root);

}  // namespace docent::content
