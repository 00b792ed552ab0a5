// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "content/load_limits.h"
#include "content/model.h"

// Reads glTF 2.0. The file is untrusted input and may be hostile. The steps, each of which relies on the
// previous ones:
//   container   chunks of a GLB
//   json        JSON under limits
//   schema      types, ranges and indices of everything that is read
//   resources   other files and data URIs gathered into one buffer
//   check       buffer views, accessors, meshes, nodes, skins and animations against true sizes
//   tinygltf         JSON to structs; it opens no file and meets only checked numbers
//   accessor, skinning    floats are finite, joints and weights in range, in all accessors and sets
//   mesh, material, images, nodes, animation    structs to Model
// Stateless and thread-safe. Every error in a file throws Error with a one-sentence message, except for those
// that cost only a texture or can be repaired, which become sentences in Model::warnings.
namespace docent::content {

struct LoadedGltf {
  std::shared_ptr<Model> model;
  // The file as one self-contained GLB: the input itself if it was one. Images keep their encoding.
  std::vector<std::uint8_t> glb;
};

// `name` is used in messages and becomes the model's name. Relative URIs may refer to files inside `folder`;
// without it (for bytes from a library) only data URIs are allowed.
LoadedGltf LoadGltf(const std::string& name, std::vector<std::uint8_t> bytes,
                    const std::optional<std::filesystem::path>& folder, const LoadLimits& limits = {});

}  // namespace docent::content
