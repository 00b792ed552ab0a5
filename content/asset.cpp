// SPDX-License-Identifier: Apache-2.0
#include "content/asset.h"

#include <optional>
#include <utility>

#include "content/assimp_loader.h"
#include "content/gltf/loader.h"
#include "content/gltf/resources.h"
#include "content/sha256.h"

namespace docent::content {
namespace {

Asset MakeAsset(const std::string& name, LoadedGltf loaded) {
  Asset asset;
  asset.id = Sha256Hex(loaded.glb);
  asset.name = name;
  asset.glb = std::move(loaded.glb);
  asset.model = std::move(loaded.model);
  return asset;
}

}  // namespace

Asset ImportAsset(const std::filesystem::path& path, const LoadLimits& limits) {
  const std::string name = path.filename().string();
  const std::optional<std::filesystem::path> folder = path.parent_path();
  if (IsAssimpFormat(path)) {
    // The converted file passes through the same checks as any other glTF file.
    ConvertedGltf converted = GltfFromAssimp(path, limits);
    LoadedGltf loaded = LoadGltf(name, std::move(converted.glb), folder, limits);
    loaded.model->warnings.insert(loaded.model->warnings.end(), converted.warnings.begin(),
                                  converted.warnings.end());
    return MakeAsset(name, std::move(loaded));
  }
  std::vector<std::uint8_t> bytes = ReadFileBytes(path, limits.max_file_bytes);
  return MakeAsset(name, LoadGltf(name, std::move(bytes), folder, limits));
}

Asset AssetFromGlb(const std::string& name, std::vector<std::uint8_t> glb, const LoadLimits& limits) {
  return MakeAsset(name, LoadGltf(name, std::move(glb), std::nullopt, limits));
}

}  // namespace docent::content
