// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <limits>
#include <string_view>
#include <vector>

// The tables of CheckSchema (gltf_schema.h). Private to gltf_schema.
namespace docent::content {

struct Schema;

// One member of a JSON object: its type and its other constraints.
struct Field {
  enum class Kind { kBoolean, kString, kInteger, kNumber, kIndex, kIndexMap, kObject };
  const char* name = "";
  Kind kind = Kind::kObject;
  double min = -std::numeric_limits<double>::infinity();  // For kInteger and kNumber.
  double max = std::numeric_limits<double>::infinity();
  const char* target = "";              // For kIndex and kIndexMap: name of the root's array.
  const Schema* schema = nullptr;       // For kObject.
  std::vector<int> codes;               // For kInteger: the allowed values; empty for any.
  std::vector<std::string_view> words;  // For kString: the allowed values; empty for any.
  bool required = false;
  bool list = false;  // An array of `kind`.
  bool distinct = false;
  std::size_t min_count = 0, max_count = std::numeric_limits<std::size_t>::max();  // For kIndexMap and lists.

  Field Required() const {
    Field result = *this;
    result.required = true;
    return result;
  }
  Field List(std::size_t min_entries,
             std::size_t max_entries = std::numeric_limits<std::size_t>::max()) const {
    Field result = *this;
    result.list = true;
    result.min_count = min_entries;
    result.max_count = max_entries;
    return result;
  }
  Field Distinct() const {
    Field result = *this;
    result.distinct = true;
    return result;
  }
};

struct Schema {
  std::vector<Field> fields;
};

const Schema& RootSchema();

}  // namespace docent::content
