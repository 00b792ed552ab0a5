// SPDX-License-Identifier: Apache-2.0
#include "maps/storage/mesh_rows.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "engine/base/error.h"
#include "maps/storage/envelope.h"
#include "maps/storage/rows.h"

namespace docent::maps {
namespace {

constexpr const char* kMeshPart = "mesh";
constexpr std::uint32_t kUnusedVertex = 0xFFFFFFFFu;
constexpr float kMaxStep = std::numeric_limits<std::uint16_t>::max();
constexpr float kMaxCoordinate = 1e9F;  // Map units; far beyond any map, far below what a float can hold.
// The smallest encodings. Decoded, both take four times as much.
constexpr std::size_t kLeastVertexBytes = 3, kLeastTriangleBytes = 3, kMeshKeyFrameBytes = 60;

[[noreturn]] void RefuseMesh(const std::string& what) {
  throw Error("its mesh is damaged: " + what);
}

// Seven bits a byte, the lowest first; the highest bit says that another byte follows.
void PutVariable(std::uint32_t number, ByteWriter* writer) {
  for (; number >= 0x80; number >>= 7) writer->Put(static_cast<std::uint8_t>(number | 0x80));
  writer->Put(static_cast<std::uint8_t>(number));
}

// Only the shortest form of a number is valid, so that a mesh has one encoding.
std::uint32_t GetVariable(ByteReader* reader) {
  std::uint32_t number = 0;
  for (int shift = 0; shift < 28; shift += 7) {
    const auto byte = reader->Get<std::uint8_t>();
    number |= static_cast<std::uint32_t>(byte & 0x7F) << shift;
    if ((byte & 0x80) != 0) continue;
    if (byte == 0 && shift > 0) RefuseMesh("a number is not valid");
    return number;
  }
  RefuseMesh("a number is not valid");
}

std::uint32_t ZigZag(int number) {
  return number < 0 ? static_cast<std::uint32_t>(-2 * number - 1) : static_cast<std::uint32_t>(2 * number);
}
int FromZigZag(std::uint32_t number) {
  return (number & 1) != 0 ? -static_cast<int>(number >> 1) - 1 : static_cast<int>(number >> 1);
}

// The vertices in the order of their use, and the triangles with the new numbers.
engine::SurfaceMesh InOrderOfUse(const engine::SurfaceMesh& mesh) {
  engine::SurfaceMesh ordered;
  std::vector<std::uint32_t> number(mesh.vertices.size(), kUnusedVertex);
  for (std::array<std::uint32_t, 3> triangle : mesh.triangles) {
    for (std::uint32_t& vertex : triangle) {
      if (vertex >= mesh.vertices.size()) throw Error("its mesh has a triangle without a vertex");
      if (!mesh.vertices[vertex].allFinite()) throw Error("its mesh has a vertex that is not finite");
      std::uint32_t& known = number[vertex];
      if (known == kUnusedVertex) {
        known = static_cast<std::uint32_t>(ordered.vertices.size());
        ordered.vertices.push_back(mesh.vertices[vertex]);
      }
      vertex = known;
    }
    ordered.triangles.push_back(triangle);
  }
  return ordered;
}

void PutVertices(const std::vector<Eigen::Vector3f>& vertices, ByteWriter* writer) {
  Eigen::Vector3f low = Eigen::Vector3f::Zero(), high = low;
  if (!vertices.empty()) low = high = vertices[0];
  for (const Eigen::Vector3f& vertex : vertices) {
    low = low.cwiseMin(vertex);
    high = high.cwiseMax(vertex);
  }
  const float step = (high - low).maxCoeff() / kMaxStep;
  if (!(low.cwiseAbs().maxCoeff() <= kMaxCoordinate && step * kMaxStep <= kMaxCoordinate))
    throw Error("its mesh is too large");
  writer->PutAll(low);
  writer->Put(step);
  writer->Put(static_cast<std::uint32_t>(vertices.size()));
  Eigen::Vector3i before = Eigen::Vector3i::Zero();
  for (const Eigen::Vector3f& vertex : vertices) {
    for (int axis = 0; axis < 3; ++axis) {
      const float steps = step > 0 ? std::round((vertex[axis] - low[axis]) / step) : 0;
      const int now = static_cast<int>(std::clamp(steps, 0.0F, kMaxStep));
      PutVariable(ZigZag(now - before[axis]), writer);
      before[axis] = now;
    }
  }
}

std::vector<Eigen::Vector3f> GetVertices(ByteReader* reader) {
  const auto low = reader->GetAll<Eigen::Vector3f>();
  const auto step = reader->Get<float>();
  const auto count = reader->Get<std::uint32_t>();
  if (reader->failed() || count > reader->remaining() / kLeastVertexBytes)
    RefuseMesh("its length does not match");
  const float side = step * kMaxStep;
  if (!(low.cwiseAbs().maxCoeff() <= kMaxCoordinate && side >= 0 && side <= kMaxCoordinate))
    RefuseMesh("its bounds are not valid");
  std::vector<Eigen::Vector3f> vertices(count);
  Eigen::Vector3i place = Eigen::Vector3i::Zero();
  for (Eigen::Vector3f& vertex : vertices) {
    for (int axis = 0; axis < 3; ++axis) {
      place[axis] += FromZigZag(GetVariable(reader));
      if (place[axis] < 0 || place[axis] > static_cast<int>(kMaxStep))
        RefuseMesh("a vertex is out of its bounds");
    }
    vertex = low + step * place.cast<float>();
  }
  return vertices;
}

void PutKeyFrames(const std::vector<engine::MeshKeyFrame>& keyframes, ByteWriter* writer) {
  writer->Put(static_cast<std::uint32_t>(keyframes.size()));
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    const engine::MeshKeyFrame& used = keyframes[i];
    if (i > 0 && keyframes[i - 1].keyframe >= used.keyframe)
      throw Error("its mesh has keyframes without order");
    if (!used.camera_from_map.translation.allFinite())
      throw Error("its mesh has a keyframe that is not finite");
    writer->Put(std::uint32_t{used.keyframe});
    writer->PutAll(used.camera_from_map.rotation.quaternion().coeffs());
    writer->PutAll(used.camera_from_map.translation);
  }
}

std::vector<engine::MeshKeyFrame> GetKeyFrames(ByteReader* reader) {
  const auto count = reader->Get<std::uint32_t>();
  if (reader->failed() || count > reader->remaining() / kMeshKeyFrameBytes)
    RefuseMesh("its length does not match");
  std::vector<engine::MeshKeyFrame> keyframes;
  keyframes.reserve(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    engine::MeshKeyFrame used;
    used.keyframe = reader->Get<std::uint32_t>();
    const Eigen::Quaterniond rotation(reader->GetAll<Eigen::Vector4d>());
    used.camera_from_map.translation = reader->GetAll<Eigen::Vector3d>();
    constexpr double kUnit = 1e-6;  // As for the rotations of keyframes.
    const bool is_pose =
        std::abs(rotation.norm() - 1) < kUnit && used.camera_from_map.translation.allFinite();
    if (!is_pose || (i > 0 && keyframes.back().keyframe >= used.keyframe))
      RefuseMesh("a keyframe is not valid");
    used.camera_from_map.rotation = engine::Rotation3(rotation);
    keyframes.push_back(used);
  }
  return keyframes;
}

// The encoded mesh, whatever its size.
Bytes EncodeAnyMesh(std::uint64_t map_key, const engine::MapMesh& mesh) {
  const engine::SurfaceMesh ordered = InOrderOfUse(mesh.mesh);
  ByteWriter writer = BeginEnvelope(kMeshKind, map_key, ordered.triangles.size());
  PutKeyFrames(mesh.keyframes, &writer);
  PutVertices(ordered.vertices, &writer);
  // A corner is the distance of its number from the next vertex that was not used yet, which is 0.
  std::uint32_t next = 0;
  for (const auto& triangle : ordered.triangles) {
    for (const std::uint32_t vertex : triangle) {
      PutVariable(next - vertex, &writer);
      next = std::max(next, vertex + 1);
    }
  }
  return FinishEnvelope(std::move(writer));
}

}  // namespace

std::size_t MeshBytes(const engine::MapMesh& mesh) {
  return EncodeAnyMesh(0, mesh).size();
}

Bytes EncodeMesh(std::uint64_t map_key, const engine::MapMesh& mesh) {
  Bytes bytes = EncodeAnyMesh(map_key, mesh);
  if (bytes.size() > kMaxMeshBytes)
    throw Error("its mesh has more than " + std::to_string(kMaxMeshBytes) + " bytes");
  return bytes;
}

engine::MapMesh DecodeMesh(std::uint64_t map_key, std::span<const std::uint8_t> bytes) {
  auto [reader, count] = OpenEnvelope(kMeshKind, map_key, bytes);
  if (bytes.size() > kMaxMeshBytes) RefuseMesh("it is too large");
  engine::MapMesh mesh;
  mesh.keyframes = GetKeyFrames(&reader);
  mesh.mesh.vertices = GetVertices(&reader);
  if (count > reader.remaining() / kLeastTriangleBytes) RefuseMesh("its length does not match");
  mesh.mesh.triangles.resize(count);
  std::uint32_t next = 0;
  for (auto& triangle : mesh.mesh.triangles) {
    for (std::uint32_t& vertex : triangle) {
      const std::uint32_t distance = GetVariable(&reader);
      if (distance > next || (distance == 0 && next >= mesh.mesh.vertices.size()))
        RefuseMesh("a triangle has no such vertex");
      vertex = next - distance;
      next = std::max(next, vertex + 1);
    }
  }
  if (reader.failed() || reader.remaining() != 0 || next != mesh.mesh.vertices.size())
    RefuseMesh("its length does not match");
  return mesh;
}

std::optional<engine::MapMesh> ReadMesh(const Database& database, std::uint64_t key) {
  const std::optional<Bytes> bytes = FindPart(database, key, kMeshPart);
  if (!bytes) return std::nullopt;
  return DecodeMesh(key, *bytes);
}

std::shared_ptr<const engine::MapMesh> FindUndamagedMesh(const Database& database, std::uint64_t key) {
  try {
    std::optional<engine::MapMesh> mesh = ReadMesh(database, key);
    return mesh ? std::make_shared<const engine::MapMesh>(*std::move(mesh)) : nullptr;
  } catch (const Error&) {
    return nullptr;
  }
}

bool ReplaceMesh(const Database& database, const MapInfo& info, const engine::MapMesh& mesh) {
  engine::MapSnapshot map;
  for (StoredKeyFrame& stored : ReadParts(database, info).keyframes)
    map.keyframes.push_back(std::move(stored.keyframe));
  if (engine::StateOf(mesh.keyframes, map) == engine::MeshState::kOutOfDate) return false;
  WritePart(database, info.key, kMeshPart, EncodeMesh(info.key, mesh));
  return true;
}

void RemoveMeshUnlessRight(const Database& database, std::uint64_t key, const engine::MapSnapshot& map) {
  try {
    const std::optional<engine::MapMesh> mesh = ReadMesh(database, key);
    if (!mesh || engine::StateOf(mesh->keyframes, map) != engine::MeshState::kOutOfDate) return;
  } catch (const Error&) {
    // A damaged one is removed too: it can be computed again.
  }
  database.Prepare("DELETE FROM parts WHERE map_key = ? AND part = ?")
      .Bind(1, static_cast<std::int64_t>(key))
      .Bind(2, std::string_view(kMeshPart))
      .Run();
}

}  // namespace docent::maps
