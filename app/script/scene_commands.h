// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/script/commands.h"
#include "content/edits.h"

// The changes of a scene that commands describe which need nothing but the scene: no image, no other map. The
// session and `docent content edit` both use them. They throw Error like content/edits.h. Pure functions.
namespace docent::app {

content::SceneChange EditFor(const content::Scene& scene, const MoveEntity& command);  // not to a pixel
content::SceneChange EditFor(const content::Scene& scene, const RotateEntity& command);
content::SceneChange EditFor(const content::Scene& scene, const ScaleEntity& command);
content::SceneChange EditFor(const content::Scene& scene, const TransformEntities& command);
content::SceneChange EditFor(const content::Scene& scene, const UnbendEntity& command);
content::SceneChange EditFor(const content::Scene& scene, const ShortenTrail& command);
content::SceneChange EditFor(const content::Scene& scene, const ResizeOccluder& command);
content::SceneChange EditFor(const content::Scene& scene, const SetLabelOffset& command);
content::SceneChange EditFor(const content::Scene& scene, const RemoveEntities& command);
content::SceneChange EditFor(const content::Scene& scene, const DuplicateEntities& command);
content::SceneChange EditFor(const content::Scene& scene, const RenameEntity& command);
content::SceneChange EditFor(const content::Scene& scene, const SetEntityText& command);
content::SceneChange EditFor(const content::Scene& scene, const SetEntityFlag& command);
content::SceneChange EditFor(const content::Scene& scene, const GroupEntities& command);

template <typename C>
concept SceneCommand = requires(const content::Scene& scene, const C& command) {
  EditFor(scene, command);
};

}  // namespace docent::app
