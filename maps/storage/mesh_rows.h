// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "engine/dense/densification.h"
#include "maps/storage/database.h"
#include "maps/storage/map_codec.h"
#include "maps/storage/map_record.h"

// The part `mesh` of a map: its surfaces as one triangle mesh, with the keyframes and poses that it was made
// from. It is computed from the rest of the map, so that a library without it is complete, and programs that
// do not know it leave it alone. The functions run in a transaction of the caller, and throw docent::Error.
namespace docent::maps {

inline constexpr std::size_t kMaxMeshBytes = std::size_t{2} << 20;  // Largest encoded mesh.

// Positions are rounded to 1/65535 of the largest side of the mesh, and vertices get the order in which the
// triangles use them; those that no triangle uses are left out. Throws when the mesh is not valid or the
// result has more than kMaxMeshBytes.
Bytes EncodeMesh(std::uint64_t map_key, const engine::MapMesh& mesh);
// The size of the encoded mesh. Throws when the mesh is not valid.
std::size_t MeshBytes(const engine::MapMesh& mesh);
engine::MapMesh DecodeMesh(std::uint64_t map_key, std::span<const std::uint8_t> bytes);

// Empty if the map has none.
std::optional<engine::MapMesh> ReadMesh(const Database& database, std::uint64_t key);
// Null if the map has none, or a damaged one.
std::shared_ptr<const engine::MapMesh> FindUndamagedMesh(const Database& database, std::uint64_t key);
// Stores the mesh unless it was made of another state of the map than the stored one; returns whether it did.
bool ReplaceMesh(const Database& database, const MapInfo& info, const engine::MapMesh& mesh);
// Removes the stored mesh if it is damaged, or a keyframe that it was made from has moved or is gone.
void RemoveMeshUnlessRight(const Database& database, std::uint64_t key, const engine::MapSnapshot& map);

}  // namespace docent::maps
