// SPDX-License-Identifier: Apache-2.0
#include "maps/exchange/mesh_ply.h"

#include "maps/storage/byte_stream.h"

namespace docent::maps {

std::string MakeMeshPly(const engine::SurfaceMesh& mesh) {
  ByteWriter writer;
  for (const Eigen::Vector3f& vertex : mesh.vertices) writer.PutAll(vertex);
  for (const auto& triangle : mesh.triangles) {
    writer.Put(std::uint8_t{3});
    for (const std::uint32_t vertex : triangle) writer.Put(vertex);
  }
  std::string ply =
      "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(mesh.vertices.size()) +
      "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
      std::to_string(mesh.triangles.size()) + "\nproperty list uchar uint vertex_indices\nend_header\n";
  return ply.append(writer.bytes().begin(), writer.bytes().end());
}

}  // namespace docent::maps
