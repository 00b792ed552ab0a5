// SPDX-License-Identifier: Apache-2.0
#include "maps/maintenance/densify.h"

#include <memory>
#include <optional>
#include <utility>

#include "engine/base/error.h"
#include "engine/dense/mesh_simplification.h"
#include "maps/storage/mesh_rows.h"

namespace docent::maps {
namespace {

bool HasCurrentMesh(const Library& library, std::uint64_t key, const engine::MapSnapshot& map) {
  try {
    const std::optional<engine::MapMesh> mesh = library.LoadMesh(key);
    return mesh && engine::StateOf(mesh->keyframes, map) == engine::MeshState::kCurrent;
  } catch (const Error&) {
    return false;  // A damaged one is computed again.
  }
}

}  // namespace

engine::MapMesh MeshThatFits(engine::MapMesh mesh) {
  constexpr double kStep = 0.8;
  while (MeshBytes(mesh) > kMaxMeshBytes) {
    const auto triangles = static_cast<std::size_t>(kStep * static_cast<double>(mesh.mesh.triangles.size()));
    engine::SurfaceMesh simple = engine::SimplifyMesh(mesh.mesh, 0, triangles);
    // Loose triangles cannot be simplified; then the last ones are given up.
    if (simple.triangles.size() > triangles) simple.triangles.resize(triangles);
    mesh.mesh = std::move(simple);
  }
  return mesh;
}

DensifyResult DensifyStoredMap(Library* library, std::uint64_t key,
                               const engine::DensificationOptions& options,
                               const engine::DensificationProgress& progress,
                               const std::atomic<bool>* interrupt) {
  using Outcome = DensifyResult::Outcome;
  const std::shared_ptr<const engine::MapSnapshot> map =
      library->Load(key, Library::DamagedContent::kLeaveOut).snapshot;
  if (HasCurrentMesh(*library, key, *map)) return {Outcome::kUpToDate};
  std::optional<engine::MapMesh> mesh = engine::DensifyMap(map, options, progress, interrupt);
  if (!mesh) return {Outcome::kInterrupted};
  if (mesh->mesh.empty()) return {Outcome::kNoDepth};
  const engine::MapMesh fitting = MeshThatFits(*std::move(mesh));
  if (!library->SaveMesh(key, fitting)) return {Outcome::kChanged};
  return {Outcome::kStored, fitting.mesh.triangles.size(), MeshBytes(fitting)};
}

const char* ToText(DensifyResult::Outcome outcome) {
  switch (outcome) {
    case DensifyResult::Outcome::kStored:
      return "has a mesh now";
    case DensifyResult::Outcome::kUpToDate:
      return "has a mesh already";
    case DensifyResult::Outcome::kNoDepth:
      return "has too little parallax for a mesh";
    case DensifyResult::Outcome::kInterrupted:
      return "was interrupted";
    case DensifyResult::Outcome::kChanged:
      return "was changed by another program in the meantime";
  }
  return "";
}

}  // namespace docent::maps
