// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "content/scene.h"
#include "engine/dense/surface_mesh.h"

namespace docent::ui {

// The surfaces that hide the content of a scene behind them: those that the map measured, and the occluders
// that its author placed. Where both stand for the same surface, the occluder counts. Single thread.
class HidingSurfaces {
 public:
  // In the map; null for none.
  struct Surfaces {
    std::shared_ptr<const engine::SurfaceMesh> measured, placed;
  };
  // `occluders`: whether those of the scene count. They are only computed anew when they change.
  const Surfaces& Of(const content::Scene& scene, bool occluders,
                     const std::shared_ptr<const engine::SurfaceMesh>& measured);

 private:
  // All numbers of the occluders that count.
  void WriteKey(const content::Scene& scene, bool occluders, std::vector<double>* key) const;

  std::shared_ptr<const engine::SurfaceMesh> measured_;
  std::vector<double> key_, next_key_;
  Surfaces surfaces_;
};

}  // namespace docent::ui
