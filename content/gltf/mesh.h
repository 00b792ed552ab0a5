// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <tiny_gltf.h>

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "content/gltf/accessor.h"
#include "content/load_limits.h"
#include "content/model.h"

// Converts the primitives of a checked glTF to triangles with complete vertices.
namespace docent::content {

// Reads the meshes of one model. All indices of its results are in range of the primitive's vertices, and all
// coordinates are finite.
class MeshReader {
 public:
  // All references must outlive the reader. `materials` determine which primitives need tangents.
  MeshReader(const std::string& file, const tinygltf::Model& source, std::span<const Material> materials,
             const LoadLimits& limits, AccessorCache* accessors, std::vector<std::string>* warnings)
      : file_(file),
        source_(source),
        materials_(materials),
        limits_(limits),
        accessors_(*accessors),
        warnings_(*warnings) {}

  Mesh Read(std::size_t mesh);

 private:
  using Attributes = std::map<std::string, int>;

  // Triangles as indices of the file's vertices, three each.
  std::vector<std::uint32_t> ReadTriangles(const tinygltf::Primitive& primitive, std::size_t vertex_count,
                                           const std::string& place);
  void ReadVertices(const Attributes& attributes, std::span<const std::uint32_t> chosen,
                    const std::string& place, Primitive* result);
  void ReadSkinning(const Attributes& attributes, std::span<const std::uint32_t> chosen,
                    const std::string& place, Primitive* result);
  Primitive ReadPrimitive(const tinygltf::Primitive& primitive, const std::string& place);
  void Warn(const std::string& sentence);

  const std::string& file_;
  const tinygltf::Model& source_;
  std::span<const Material> materials_;
  const LoadLimits& limits_;
  AccessorCache& accessors_;
  std::vector<std::string>& warnings_;
  std::uint64_t vertices_ = 0, indices_ = 0;  // Totals of all primitives so far.
  std::uint64_t joint_reads_ = 0;             // The same: the sets of joints of each vertex.
};

}  // namespace docent::content
