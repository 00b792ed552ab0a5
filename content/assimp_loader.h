// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "content/load_limits.h"

// Reads model files that are not glTF, through assimp, by turning them into glTF: what assimp understood then
// passes through the glTF loader's checks like any other file. Triangles, normals, two sets of texture
// coordinates, vertex colours, the node tree, colours and PNG or JPEG textures come over; skins and
// animations do not.
namespace docent::content {

// Whether the file's extension is one of .obj, .ply, .stl, .fbx, .dae, .3ds, .off.
bool IsAssimpFormat(const std::filesystem::path& path);

struct ConvertedGltf {
  std::vector<std::uint8_t> glb;      // textures by relative URI, beside the source file
  std::vector<std::string> warnings;  // what did not come over, a sentence each
};

// assimp itself opens only files inside the model's own folder. Throws Error when it cannot read the file or
// the result is beyond the limits.
ConvertedGltf GltfFromAssimp(const std::filesystem::path& path, const LoadLimits& limits);

}  // namespace docent::content
