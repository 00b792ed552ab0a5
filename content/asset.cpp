// SPDX-License-Identifier: Apache-2.0
#include "content/asset.h"

#include <optional>
#include <utility>

#include "content/assimp_loader.h"
#include "content/flat_image.h"
#include "content/gltf/loader.h"
#include "content/gltf/resources.h"
#include "content/sha256.h"
#include "content/sound.h"

namespace docent::content {
namespace {

Asset MakeAsset(const std::string& name, LoadedGltf loaded) {
  Asset asset;
  asset.id = Sha256Hex(loaded.glb);
  asset.name = name;
  asset.bytes = std::move(loaded.glb);
  asset.model = std::move(loaded.model);
  return asset;
}

// An asset of a file that is stored as it is.
Asset FileAsset(const std::string& name, AssetKind kind, std::vector<std::uint8_t> bytes) {
  Asset asset;
  asset.id = Sha256Hex(bytes);
  asset.name = name;
  asset.kind = kind;
  asset.bytes = std::move(bytes);
  return asset;
}

Asset ImageAsset(const std::string& name, std::vector<std::uint8_t> bytes) {
  auto model = FlatImageModel(name, bytes);
  Asset asset = FileAsset(name, AssetKind::kImage, std::move(bytes));
  asset.model = std::move(model);
  return asset;
}

Asset SoundAsset(const std::string& name, std::vector<std::uint8_t> bytes) {
  const double seconds = ReadSoundFormat(name, bytes).seconds();
  Asset asset = FileAsset(name, AssetKind::kSound, std::move(bytes));
  asset.seconds = seconds;
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

Asset ImportImage(const std::filesystem::path& path) {
  return ImageAsset(path.filename().string(), ReadFileBytes(path, kMaxImageFileBytes));
}

Asset ImportSound(const std::filesystem::path& path) {
  const std::string name = path.filename().string();
  std::vector<std::uint8_t> bytes = ReadFileBytes(path, kMaxSoundFileBytes);
  DecodeSound(name, bytes);
  return SoundAsset(name, std::move(bytes));
}

Asset AssetFromBytes(const std::string& name, std::vector<std::uint8_t> bytes, const LoadLimits& limits) {
  if (IsImageFile(bytes)) return ImageAsset(name, std::move(bytes));
  if (IsSoundFile(bytes)) return SoundAsset(name, std::move(bytes));
  return MakeAsset(name, LoadGltf(name, std::move(bytes), std::nullopt, limits));
}

}  // namespace docent::content
