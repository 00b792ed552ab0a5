// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "content/load_limits.h"

// Reads model files that are not glTF with assimp and converts them to glTF, so that the result passes
// through the glTF loader's checks like any other file. Triangles, normals, two sets of texture coordinates,
// vertex colours, the node tree, material colours and PNG or JPEG textures are converted; skins and
// animations are not. The result is in metres where the format tells its unit (FBX and Collada); else a unit
// of the file counts as a metre. Vertex colours of OBJ, PLY, STL and OFF are converted from sRGB to linear.
namespace docent::content {

// Whether the file's extension is one of .obj, .ply, .stl, .fbx, .dae, .3ds, .off.
bool IsAssimpFormat(const std::filesystem::path& path);

struct ConvertedGltf {
  std::vector<std::uint8_t> glb;      // Refers to textures by URIs relative to the source file.
  std::vector<std::string> warnings;  // One sentence for each feature that was not converted.
};

// assimp opens only files inside the model's own folder. Throws Error when the file cannot be read or the
// result exceeds the limits.
ConvertedGltf GltfFromAssimp(const std::filesystem::path& path, const LoadLimits& limits);

}  // namespace docent::content
