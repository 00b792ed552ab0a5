// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <cstring>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "content/gltf/container.h"
#include "content/gltf/loader.h"
#include "tests/support/error_of.h"

// Small glTF files for tests, built in memory and easy to damage.
namespace docent::content {

struct GltfFile {
  nlohmann::json json = {{"asset", {{"version", "2.0"}}}};
  std::vector<std::uint8_t> bin;

  // Appends an entry to an array of the root and returns its index.
  int Add(const char* array, nlohmann::json entry) {
    if (!json.contains(array)) json[array] = nlohmann::json::array();
    json[array].push_back(std::move(entry));
    return static_cast<int>(json[array].size()) - 1;
  }

  template <typename T>
  int AddView(const std::vector<T>& values) {
    while (bin.size() % 4 != 0) bin.push_back(0);
    const std::size_t begin = bin.size(), bytes = values.size() * sizeof(T);
    bin.resize(begin + bytes);
    std::memcpy(bin.data() + begin, values.data(), bytes);
    return Add("bufferViews", {{"buffer", 0}, {"byteOffset", begin}, {"byteLength", bytes}});
  }

  template <typename T>
  int AddAccessor(const std::vector<T>& values, int component_type, const char* type, std::size_t count) {
    const int view = AddView(values);
    return Add("accessors",
               {{"bufferView", view}, {"componentType", component_type}, {"type", type}, {"count", count}});
  }
  int AddFloats(const std::vector<float>& values, const char* type, std::size_t count) {
    return AddAccessor(values, 5126, type, count);
  }
  int AddIndices(const std::vector<std::uint16_t>& values) {
    return AddAccessor(values, 5123, "SCALAR", values.size());
  }

  std::vector<std::uint8_t> Glb() const {
    nlohmann::json whole = json;
    if (!bin.empty() && !whole.contains("buffers")) {
      whole["buffers"] = nlohmann::json::array({{{"byteLength", bin.size()}}});
    }
    return MakeGlb(whole.dump(), bin);
  }

  std::shared_ptr<const Model> Load(const LoadLimits& limits = {}) const {
    return LoadGltf("test.glb", Glb(), std::nullopt, limits).model;
  }

  // Returns the error message for the file, or an empty text when it loads.
  std::string Refusal(const LoadLimits& limits = {}) const {
    return ErrorOf([&] { Load(limits); });
  }
};

// One triangle (0,0,0) (1,0,0) (0,1,0) without normals, referenced by node 0.
inline GltfFile TriangleFile() {
  GltfFile file;
  const int positions = file.AddFloats({0, 0, 0, 1, 0, 0, 0, 1, 0}, "VEC3", 3);
  file.Add("meshes", {{"primitives", {{{"attributes", {{"POSITION", positions}}}}}}});
  file.Add("nodes", {{"mesh", 0}});
  file.Add("scenes", {{"nodes", {0}}});
  return file;
}

}  // namespace docent::content
