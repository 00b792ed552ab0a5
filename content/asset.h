// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "content/load_limits.h"
#include "content/scene.h"

// Makes an Asset, which can be placed in a map, from a model file or from bytes that a library stores. The
// functions are stateless and thread-safe. Every error in the file throws Error with a one-sentence message
// that names the file.
namespace docent::content {

// Reads a model file: .gltf and .glb with the glTF loader, other formats (.obj, .ply, .stl, .fbx, .dae, .3ds,
// .off) with assimp. The asset is self-contained; its id is the SHA-256 of its GLB bytes.
Asset ImportAsset(const std::filesystem::path& path, const LoadLimits& limits = {});

// Makes an asset from stored bytes. `glb` is checked as thoroughly as any other file and must not refer to
// other files.
Asset AssetFromGlb(const std::string& name, std::vector<std::uint8_t> glb, const LoadLimits& limits = {});

}  // namespace docent::content
