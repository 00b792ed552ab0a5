// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>

#include "engine/dense/densification.h"
#include "maps/library/library.h"

namespace docent::maps {

// What came of computing the mesh of a stored map.
struct DensifyResult {
  enum class Outcome {
    kStored,       // The mesh was computed and stored.
    kUpToDate,     // The stored mesh was made of the map as it is.
    kNoDepth,      // No two keyframes see the same points from different places.
    kInterrupted,  // Nothing was changed.
    kChanged,      // Another program changed the map meanwhile; nothing was stored.
  };
  Outcome outcome = Outcome::kUpToDate;
  std::size_t triangles = 0, bytes = 0;  // Of the mesh; 0 if there is none.
};

// Computes and stores the mesh of a map's surfaces (see engine/dense/densification.h) unless it is there
// already, so that interrupted work on a library continues with the next map. Takes seconds per keyframe.
// Throws Error when the map cannot be read or written.
DensifyResult DensifyStoredMap(Library* library, std::uint64_t key,
                               const engine::DensificationOptions& options = {},
                               const engine::DensificationProgress& progress = {},
                               const std::atomic<bool>* interrupt = nullptr);

// The mesh with as many triangles as can be stored.
engine::MapMesh MeshThatFits(engine::MapMesh mesh);

// A phrase for the result, such as "has a mesh already".
const char* ToText(DensifyResult::Outcome outcome);

}  // namespace docent::maps
