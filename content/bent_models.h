// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <utility>

#include "content/scene.h"

namespace docent::content {

// The shapes of bent models (content/warp.h), which are computed once and kept while they are drawn. Single
// thread.
class BentModels {
 public:
  // The shape of a placed model: its asset's model, bent if it has a warp. Null without a loaded asset.
  std::shared_ptr<const Model> ShapeOf(const PlacedModel& placed);
  // Forgets shapes that were not asked for since the last call.
  void EndFrame();

 private:
  struct Bent {
    std::shared_ptr<const Asset> asset;  // Keep the two alive, so that their addresses stay theirs.
    std::shared_ptr<const Warp> warp;
    std::shared_ptr<const Model> model;
    bool used = false;
  };
  std::map<std::pair<const Asset*, const Warp*>, Bent> bent_;
};

}  // namespace docent::content
