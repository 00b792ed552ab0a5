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

#include "content/gltf/json.h"
#include "content/load_limits.h"

// Converts assimp's materials. Private to assimp_loader.
namespace docent::content {

// A glTF under construction.
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
  // All references must outlive the writer. `folder` is the folder that may contain texture files.
  AssimpMaterialWriter(const std::filesystem::path& folder, const aiScene& scene, const LoadLimits& limits,
                       GltfBuilder* builder, std::vector<std::string>* warnings)
      : folder_(folder), scene_(scene), limits_(limits), builder_(*builder), warnings_(*warnings) {}

  // Appends one glTF material.
  void Write(const aiMaterial& source);

 private:
  // Returns a glTF texture info, or null when the material has no usable texture of this type.
  Json WriteTexture(const aiMaterial& source, aiTextureType type);
  // Returns the index of the glTF texture with this image, or -1 with a warning when it is unusable.
  int WriteImage(const std::string& path);
  Json EmbeddedImage(const aiTexture& texture);
  Json ExternalImage(const std::string& path);

  std::filesystem::path folder_;
  const aiScene& scene_;
  const LoadLimits& limits_;
  GltfBuilder& builder_;
  std::vector<std::string>& warnings_;
  std::map<std::string, int> textures_;  // By the image's path in the file.
};

}  // namespace docent::content
