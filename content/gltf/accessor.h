// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <tiny_gltf.h>

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

// Reads the elements of one accessor of a checked model (check.h). Handles strides, normalized integers
// (§3.6.2.2) and sparse replacements (§3.6.2.3). It refers to the model, which must outlive it.
namespace docent::content {

class AccessorReader {
 public:
  // `file` is used in messages. A sparse accessor is unpacked into a copy; others are read in place.
  AccessorReader(const std::string& file, const tinygltf::Model& model, int accessor);

  std::size_t count() const { return count_; }
  int components() const { return components_; }

  // Returns a component as a float, normalized if the accessor says so. Throws Error, which names the
  // accessor, when it is not finite.
  float Float(std::size_t element, int component) const;
  // Returns a component of an unsigned type as an integer, for indices and joints.
  std::uint32_t Unsigned(std::size_t element, int component = 0) const;
  // The largest value of the component type.
  std::uint32_t MaxUnsigned() const { return 0xFFFFFFFFu >> (32 - 8 * component_bytes_); }

 private:
  const std::uint8_t* At(std::size_t element, int component) const {
    return data_ + element * stride_ + static_cast<std::size_t>(component) * component_bytes_;
  }
  void ApplySparse(const tinygltf::Model& model, const tinygltf::Accessor& accessor,
                   std::size_t element_bytes);

  const std::string& file_;
  int index_;
  std::size_t count_ = 0, stride_ = 0, component_bytes_ = 0;
  int components_ = 0, component_type_ = 0;
  bool normalized_ = false;
  const std::uint8_t* data_ = nullptr;
  std::vector<std::uint8_t> own_;  // The data of sparse accessors and those without a view.
};

// Caches one reader per accessor, so that a sparse accessor shared by many primitives is unpacked once.
// `file` and `model` must outlive it.
class AccessorCache {
 public:
  AccessorCache(const std::string& file, const tinygltf::Model& model) : file_(file), model_(model) {}

  const AccessorReader& Get(int accessor);

  // Throws Error when a float of any accessor, used or not, is not finite, or when the accessors together
  // claim more than `max_bytes` of floats, which only overlapping ones can.
  void CheckFinite(std::uint64_t max_bytes);

 private:
  const std::string& file_;
  const tinygltf::Model& model_;
  std::map<int, std::unique_ptr<AccessorReader>> readers_;
};

}  // namespace docent::content
