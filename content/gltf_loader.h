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

// Reads glTF 2.0. The file is input and may be hostile. Steps, each relying on the one before:
//   gltf_container   chunks of a GLB
//   gltf_json        JSON under limits
//   gltf_schema      types, ranges and indices of everything that is read
//   gltf_resources   other files and data URIs gathered into one buffer
//   gltf_check       buffer views, accessors, meshes, nodes, skins and animations against true sizes
//   tinygltf         JSON to structs; it opens no file and meets only checked numbers
//   gltf_mesh, gltf_material, gltf_images, gltf_nodes, gltf_animation    structs to Model
// Free of state: any thread may call it. Everything that is wrong with a file throws Error with one sentence.
namespace docent::content {

struct LoadedGltf {
  std::shared_ptr<Model> model;
  // The same file as one GLB that needs no other file: the input itself if it was one. Images keep their
  // encoding.
  std::vector<std::uint8_t> glb;
};

// `name` stands in sentences and becomes the model's name. `folder` is where relative URIs may lead; without
// it (bytes that come from a library) any URI but a data URI is refused.
LoadedGltf LoadGltf(const std::string& name, std::vector<std::uint8_t> bytes,
                    const std::optional<std::filesystem::path>& folder, const LoadLimits& limits = {});

}  // namespace docent::content
