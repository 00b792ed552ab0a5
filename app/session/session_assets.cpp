// SPDX-License-Identifier: Apache-2.0
#include "app/session/session_assets.h"

#include <system_error>
#include <utility>
#include <variant>

namespace docent::app {

namespace {

std::filesystem::path PathOf(const std::filesystem::path& folder, const std::string& file) {
  std::error_code error;
  return std::filesystem::exists(folder / file, error) ? folder / file : std::filesystem::path(file);
}

}  // namespace

std::optional<AssetFile> FileOf(const Command& command) {
  if (const auto* model = std::get_if<PlaceModel>(&command))
    return AssetFile{model->file, content::AssetKind::kModel};
  if (const auto* image = std::get_if<PlaceImage>(&command))
    return AssetFile{image->file, content::AssetKind::kImage};
  if (const auto* sound = std::get_if<PlaceSound>(&command))
    return AssetFile{sound->file, content::AssetKind::kSound};
  return std::nullopt;
}

std::shared_ptr<const content::Asset> SessionAssets::Load(const std::string& file, content::AssetKind kind) {
  if (const auto known = Find(file, kind)) return known;
  return Keep(file, kind, Decode(folder_, file, kind));
}

std::shared_ptr<const content::Asset> SessionAssets::Find(const std::string& file,
                                                          content::AssetKind kind) const {
  const auto found = files_.find({(folder_ / file).string(), kind});
  if (found == files_.end() || found->second.stamp != StampOf(PathOf(folder_, file))) return nullptr;
  return found->second.asset;
}

SessionAssets::Decoded SessionAssets::Decode(const std::filesystem::path& folder, const std::string& file,
                                             content::AssetKind kind) {
  const std::filesystem::path path = PathOf(folder, file);
  const FileStamp stamp = StampOf(path);
  return {std::make_shared<content::Asset>(kind == content::AssetKind::kImage   ? content::ImportImage(path)
                                           : kind == content::AssetKind::kSound ? content::ImportSound(path)
                                                                                : content::ImportAsset(path)),
          stamp};
}

std::shared_ptr<const content::Asset> SessionAssets::Keep(const std::string& file, content::AssetKind kind,
                                                          Decoded decoded) {
  if (decoded.asset->model) {
    for (const std::string& warning : decoded.asset->model->warnings)
      warnings_.push_back(decoded.asset->name + ": " + warning);
  }
  // The same bytes may already be in use in a map: one copy is shared.
  auto& kept = assets_[decoded.asset->id];
  if (!kept) kept = std::move(decoded.asset);
  files_[{(folder_ / file).string(), kind}] = {kept, decoded.stamp};
  return kept;
}

void SessionAssets::EvictUnused() {
  std::erase_if(assets_, [](const auto& asset) { return asset.second.use_count() == 1; });
}

}  // namespace docent::app
