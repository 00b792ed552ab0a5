// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "content/load_limits.h"
#include "content/scene.h"

// From a model file on disk, or bytes kept in a library, to an Asset that can be placed. Free of state: any
// thread may call these. Every fault of the file throws Error with one sentence that names it.
namespace docent::content {

// Reads a model file: .gltf and .glb by the glTF loader, other formats (.obj, .ply, .stl, .fbx, .dae, .3ds,
// .off) by assimp. The asset needs no other file afterwards; its id is the SHA-256 of its GLB bytes.
Asset ImportAsset(const std::filesystem::path& path, const LoadLimits& limits = {});

// An asset as it was kept: `glb` is checked as thoroughly as a file from anywhere, and may point to no other
// file.
Asset AssetFromGlb(const std::string& name, std::vector<std::uint8_t> glb, const LoadLimits& limits = {});

}  // namespace docent::content
