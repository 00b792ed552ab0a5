// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "content/load_limits.h"
#include "content/scene.h"

// Makes an Asset, which can be placed in a map, from a file or from bytes that a library stores. The
// functions are stateless and thread-safe. Every error in the file throws Error with a one-sentence message
// that names the file.
namespace docent::content {

// Reads a model file: .gltf and .glb with the glTF loader, other formats (.obj, .ply, .stl, .fbx, .dae, .3ds,
// .off) with assimp. The asset is self-contained; its id is the SHA-256 of its GLB bytes.
Asset ImportAsset(const std::filesystem::path& path, const LoadLimits& limits = {});

// Reads an image to be placed: PNG or JPEG, within the limits of flat_image.h.
Asset ImportImage(const std::filesystem::path& path);
// Reads a sound: WAV, FLAC or Ogg, within the limits of sound.h. All of it is decoded once, so that a damaged
// file is refused here.
Asset ImportSound(const std::filesystem::path& path);

// Makes an asset of stored bytes, whose kind is known by how they begin. They are checked as thoroughly as
// any other file and must not refer to other files; of a sound, only the header is read.
Asset AssetFromBytes(const std::string& name, std::vector<std::uint8_t> bytes, const LoadLimits& limits = {});

}  // namespace docent::content
