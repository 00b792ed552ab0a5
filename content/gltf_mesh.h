// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <tiny_gltf.h>

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "content/gltf_accessor.h"
#include "content/load_limits.h"
#include "content/model.h"

// Turns the primitives of a checked glTF into triangles with whole vertices.
namespace docent::content {

// IsActive while one model is read. Every index that comes out is in range of its primitive's vertices, every
// coordinate finite.
class MeshReader {
 public:
  // All must outlive the reader. `materials` decide which primitives need tangents.
  MeshReader(const std::string& file, const tinygltf::Model& source, std::span<const Material> materials,
             const LoadLimits& limits, AccessorCache* accessors, std::vector<std::string>* warnings)
      : file_(file),
        source_(source),
        materials_(materials),
        limits_(limits),
        accessors_(*accessors),
        warnings_(*warnings) {}

  Mesh Read(std::size_t mesh);

  // One more than the largest joint that a vertex of the mesh hangs on, 0 when none does.
  static int JointsNeeded(const Mesh& mesh);

 private:
  using Attributes = std::map<std::string, int>;

  // Triangles as numbers of the file's vertices, three each.
  std::vector<std::uint32_t> ReadTriangles(const tinygltf::Primitive& primitive, std::size_t vertex_count,
                                           const std::string& place);
  void ReadVertices(const Attributes& attributes, std::span<const std::uint32_t> chosen, Primitive* result);
  void ReadSkinning(const Attributes& attributes, std::span<const std::uint32_t> chosen, Primitive* result);
  Primitive ReadPrimitive(const tinygltf::Primitive& primitive, const std::string& place);
  void Warn(const std::string& sentence);

  const std::string& file_;
  const tinygltf::Model& source_;
  std::span<const Material> materials_;
  const LoadLimits& limits_;
  AccessorCache& accessors_;
  std::vector<std::string>& warnings_;
  std::uint64_t vertices_ = 0, indices_ = 0;  // so far, of all primitives
};

}  // namespace docent::content
