// SPDX-License-Identifier: Apache-2.0
#include "content/gltf/mesh.h"

#include <algorithm>
#include <utility>

#include "content/gltf/json.h"
#include "content/gltf/skinning.h"
#include "content/mesh_tools.h"

namespace docent::content {
namespace {

template <int N>
glm::vec<N, float> ReadVector(const AccessorReader& reader, std::uint32_t element) {
  glm::vec<N, float> value;
  for (int k = 0; k < N; ++k) value[k] = reader.Float(element, k);
  return value;
}

// Calls `emit` for the triangles formed by `count` vertices (§3.7.2.1); incomplete ones are left out.
template <typename Emit>
void ForEachTriangle(int mode, std::size_t count, const Emit& emit) {
  if (count < 3) return;
  if (mode == TINYGLTF_MODE_TRIANGLES) {
    for (std::size_t i = 0; i + 2 < count; i += 3) emit(i, i + 1, i + 2);
  } else if (mode == TINYGLTF_MODE_TRIANGLE_STRIP) {
    for (std::size_t i = 0; i + 2 < count; ++i) emit(i, i + 1 + i % 2, i + 2 - i % 2);
  } else {
    for (std::size_t i = 1; i + 1 < count; ++i) emit(i, i + 1, 0);
  }
}

}  // namespace

void MeshReader::Warn(const std::string& sentence) {
  if (std::find(warnings_.begin(), warnings_.end(), sentence) == warnings_.end())
    warnings_.push_back(sentence);
}

std::vector<std::uint32_t> MeshReader::ReadTriangles(const tinygltf::Primitive& primitive,
                                                     std::size_t vertex_count, const std::string& place) {
  const AccessorReader* indices = primitive.indices < 0 ? nullptr : &accessors_.Get(primitive.indices);
  const std::size_t count = indices == nullptr ? vertex_count : indices->count();
  const std::uint64_t corners = primitive.mode == TINYGLTF_MODE_TRIANGLES ? count : 3 * std::uint64_t{count};
  indices_ += corners;
  if (indices_ > limits_.max_indices) {
    Refuse(file_, place,
           "takes the model over the limit of " + std::to_string(limits_.max_indices / 3) + " triangles.");
  }
  const auto vertex_at = [&](std::size_t i) {
    const std::uint32_t vertex = indices == nullptr ? static_cast<std::uint32_t>(i) : indices->Unsigned(i);
    // glTF forbids the largest value of the type, because it restarts a strip on some graphics hardware.
    if (vertex >= vertex_count || (indices != nullptr && vertex == indices->MaxUnsigned())) {
      Refuse(file_, place + ".indices",
             "refers to vertex " + std::to_string(vertex) + " of " + std::to_string(vertex_count) + ".");
    }
    return vertex;
  };
  // Vertices of incomplete triangles must be in range too.
  std::vector<std::uint32_t> vertices(count);
  for (std::size_t i = 0; i < count; ++i) vertices[i] = vertex_at(i);
  std::vector<std::uint32_t> triangles;
  triangles.reserve(corners);
  ForEachTriangle(primitive.mode, count, [&](std::size_t a, std::size_t b, std::size_t c) {
    for (const std::size_t corner : {a, b, c}) triangles.push_back(vertices[corner]);
  });
  return triangles;
}

void MeshReader::ReadVertices(const Attributes& attributes, std::span<const std::uint32_t> chosen,
                              const std::string& place, Primitive* result) {
  result->vertices.resize(chosen.size());
  const auto read = [&](const char* name, const auto& assign) {
    const auto found = attributes.find(name);
    if (found == attributes.end()) return;
    const AccessorReader& reader = accessors_.Get(found->second);
    for (std::size_t i = 0; i < chosen.size(); ++i) assign(reader, chosen[i], &result->vertices[i]);
  };
  read("POSITION", [](const AccessorReader& reader, std::uint32_t element, Vertex* vertex) {
    vertex->position = ReadVector<3>(reader, element);
  });
  read("NORMAL", [](const AccessorReader& reader, std::uint32_t element, Vertex* vertex) {
    vertex->normal = ReadVector<3>(reader, element);
  });
  read("TANGENT", [](const AccessorReader& reader, std::uint32_t element, Vertex* vertex) {
    const glm::vec4 tangent = ReadVector<4>(reader, element);
    vertex->tangent = glm::vec4(UnitOr(glm::vec3(tangent), glm::vec3(1, 0, 0)), tangent.w < 0 ? -1.0f : 1.0f);
  });
  read("TEXCOORD_0", [](const AccessorReader& reader, std::uint32_t element, Vertex* vertex) {
    vertex->uv0 = ReadVector<2>(reader, element);
  });
  read("TEXCOORD_1", [](const AccessorReader& reader, std::uint32_t element, Vertex* vertex) {
    vertex->uv1 = ReadVector<2>(reader, element);
  });
  read("COLOR_0", [](const AccessorReader& reader, std::uint32_t element, Vertex* vertex) {
    const bool has_alpha = reader.components() == 4;
    const glm::vec4 color =
        has_alpha ? ReadVector<4>(reader, element) : glm::vec4(ReadVector<3>(reader, element), 1);
    vertex->color = glm::clamp(color, 0.0f, 1.0f);
  });
  ReadSkinning(attributes, chosen, place, result);
}

void MeshReader::ReadSkinning(const Attributes& attributes, std::span<const std::uint32_t> chosen,
                              const std::string& place, Primitive* result) {
  // More than two sets are rare, and any number of them may name the same two accessors.
  constexpr std::uint64_t kMaxSetsPerVertex = 8;
  struct Readers {
    const AccessorReader& joints;
    const AccessorReader& weights;
  };
  std::vector<Readers> sets;
  for (const JointSet& set : JointSets(attributes))
    sets.push_back({accessors_.Get(set.joints), accessors_.Get(set.weights)});
  if (sets.empty()) return;
  joint_reads_ += std::uint64_t{chosen.size()} * sets.size();
  if (joint_reads_ > kMaxSetsPerVertex * limits_.max_vertices)
    Refuse(file_, place, "has too many sets of joints for its vertices.");
  std::vector<std::pair<float, std::uint32_t>> influences;  // Weight and joint.
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    influences.clear();
    for (const auto& [joints, weights] : sets) {
      for (int k = 0; k < 4; ++k) {
        const float weight = weights.Float(chosen[i], k);
        if (weight > 0) influences.emplace_back(weight, joints.Unsigned(chosen[i], k));
      }
    }
    if (influences.size() > 4) {
      std::stable_sort(influences.begin(), influences.end(),
                       [](const auto& a, const auto& b) { return a.first > b.first; });
      influences.resize(4);
      Warn("Only the four joints of largest weight are used for each vertex.");
    }
    double sum = 0;
    for (const auto& [weight, joint] : influences) sum += weight;
    Vertex& vertex = result->vertices[i];
    for (std::size_t k = 0; k < influences.size(); ++k) {
      vertex.weights[static_cast<int>(k)] = static_cast<float>(influences[k].first / sum);
      vertex.joints[static_cast<int>(k)] = static_cast<std::uint16_t>(influences[k].second);
    }
  }
}

Primitive MeshReader::ReadPrimitive(const tinygltf::Primitive& primitive, const std::string& place) {
  Primitive result;
  result.material = primitive.material;
  const std::size_t vertex_count = accessors_.Get(primitive.attributes.at("POSITION")).count();
  const std::vector<std::uint32_t> triangles = ReadTriangles(primitive, vertex_count, place);
  // Keeps only the vertices that the triangles use, because primitives often share one long accessor.
  std::vector<std::uint32_t> chosen = triangles;
  std::sort(chosen.begin(), chosen.end());
  chosen.erase(std::unique(chosen.begin(), chosen.end()), chosen.end());
  const bool has_normals = primitive.attributes.contains("NORMAL");
  vertices_ += has_normals ? chosen.size() : triangles.size();
  if (vertices_ > limits_.max_vertices) {
    Refuse(file_, place,
           "takes the model over the limit of " + std::to_string(limits_.max_vertices) + " vertices.");
  }
  result.indices.resize(triangles.size());
  std::transform(triangles.begin(), triangles.end(), result.indices.begin(), [&](std::uint32_t vertex) {
    return static_cast<std::uint32_t>(std::lower_bound(chosen.begin(), chosen.end(), vertex) -
                                      chosen.begin());
  });
  ReadVertices(primitive.attributes, chosen, place, &result);
  if (has_normals) {
    RepairNormals(&result);
  } else {
    MakeFlat(&result);
  }
  if (!has_normals || !primitive.attributes.contains("TANGENT")) {
    const TextureUse* normal_map =
        primitive.material < 0 ? nullptr
                               : &materials_[static_cast<std::size_t>(primitive.material)].normal_texture;
    if (normal_map != nullptr && normal_map->texture >= 0) ComputeTangents(normal_map->uv_set, &result);
  }
  return result;
}

Mesh MeshReader::Read(std::size_t mesh) {
  const tinygltf::Mesh& source = source_.meshes[mesh];
  Mesh result;
  result.name = source.name;
  for (std::size_t i = 0; i < source.primitives.size(); ++i) {
    const tinygltf::Primitive& primitive = source.primitives[i];
    if (!primitive.targets.empty()) Warn("Morph targets are left out.");
    if (primitive.mode < TINYGLTF_MODE_TRIANGLES) {
      Warn("Points and lines are left out.");
    } else if (!primitive.attributes.contains("POSITION")) {
      Warn("Primitives without positions are left out.");
    } else {
      Primitive read = ReadPrimitive(primitive, Place("meshes", mesh) + "." + Place("primitives", i));
      // Without a whole triangle there is nothing to draw, and each node would go through it in each frame.
      if (!read.indices.empty()) result.primitives.push_back(std::move(read));
    }
  }
  return result;
}

}  // namespace docent::content
