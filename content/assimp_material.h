// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <assimp/material.h>
#include <assimp/scene.h>

#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "content/gltf_json.h"
#include "content/load_limits.h"

// The parts of assimp_loader that write materials; nobody else includes this.
namespace docent::content {

// A glTF while it is built.
struct GltfBuilder {
  Json json;
  std::vector<std::uint8_t> bin;

  // Appends an entry to one of the root's arrays and returns its index.
  int Add(const char* array, Json entry);
  // Appends bytes to the binary chunk, aligned, and returns the index of their buffer view.
  int AppendView(std::span<const std::uint8_t> bytes);
};

class AssimpMaterialWriter {
 public:
  // All must outlive the writer. `folder` is where texture files may lie.
  AssimpMaterialWriter(const std::filesystem::path& folder, const aiScene& scene, const LoadLimits& limits,
                       GltfBuilder* builder, std::vector<std::string>* warnings)
      : folder_(folder), scene_(scene), limits_(limits), builder_(*builder), warnings_(*warnings) {}

  // Appends one glTF material.
  void Write(const aiMaterial& source);

 private:
  // A glTF texture info, or null when the material has no such texture that can be shown.
  Json WriteTexture(const aiMaterial& source, aiTextureType type);
  // Index of the glTF texture that shows this image, -1 with a warning when it cannot be shown.
  int WriteImage(const std::string& path);
  Json EmbeddedImage(const aiTexture& texture);
  Json ExternalImage(const std::string& path);

  std::filesystem::path folder_;
  const aiScene& scene_;
  const LoadLimits& limits_;
  GltfBuilder& builder_;
  std::vector<std::string>& warnings_;
  std::map<std::string, int> textures_;  // by the image's path as the file names it
};

}  // namespace docent::content
