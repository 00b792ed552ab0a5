// SPDX-License-Identifier: Apache-2.0
#include "app/session/session_assets.h"

#include <system_error>
#include <utility>

namespace docent::app {

std::shared_ptr<const content::Asset> SessionAssets::Load(const std::string& file, content::AssetKind kind) {
  std::filesystem::path path = folder_ / file;
  std::error_code error;
  if (!std::filesystem::exists(path, error)) path = file;
  LoadedFile& loaded = files_[{(folder_ / file).string(), kind}];
  const FileStamp stamp = StampOf(path);
  if (loaded.asset && loaded.stamp == stamp) return loaded.asset;
  auto asset =
      std::make_shared<content::Asset>(kind == content::AssetKind::kImage   ? content::ImportImage(path)
                                       : kind == content::AssetKind::kSound ? content::ImportSound(path)
                                                                            : content::ImportAsset(path));
  if (asset->model) {
    for (const std::string& warning : asset->model->warnings)
      warnings_.push_back(asset->name + ": " + warning);
  }
  // The same bytes may already be in use in a map: one copy is shared.
  auto& kept = assets_[asset->id];
  if (!kept) kept = std::move(asset);
  loaded = {kept, stamp};
  return kept;
}

void SessionAssets::EvictUnused() {
  std::erase_if(assets_, [](const auto& asset) { return asset.second.use_count() == 1; });
}

}  // namespace docent::app
