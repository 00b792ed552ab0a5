// SPDX-License-Identifier: Apache-2.0
#include "content/bent_models.h"

#include "content/warp.h"

namespace docent::content {

std::shared_ptr<const Model> BentModels::ShapeOf(const PlacedModel& placed) {
  if (placed.asset == nullptr || placed.asset->model == nullptr) return nullptr;
  if (placed.warp == nullptr) return placed.asset->model;
  Bent& bent = bent_[{placed.asset.get(), placed.warp.get()}];
  if (bent.model == nullptr) bent = {placed.asset, placed.warp, Warped(*placed.asset->model, *placed.warp)};
  bent.used = true;
  return bent.model;
}

void BentModels::EndFrame() {
  std::erase_if(bent_, [](const auto& entry) { return !entry.second.used; });
  for (auto& [key, bent] : bent_) bent.used = false;
}

}  // namespace docent::content
