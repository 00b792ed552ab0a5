// SPDX-License-Identifier: Apache-2.0
#include "app/session/joined_scenes.h"

#include <memory>
#include <utility>

#include "app/session/content_follower.h"
#include "content/scene_codec.h"

namespace docent::app {

content::Scene JoinScenes(const content::Scene& a, const content::Scene& b, const std::string& name_of_a,
                          const std::string& name_of_b, const engine::JoinedMap& joined) {
  content::Scene both = a;
  for (content::Entity entity : b.entities) {
    content::MoveAlong(joined.a_from_b, &entity);
    entity.name = both.FreeName(entity.name);
    both.entities.push_back(std::move(entity));
  }
  for (content::Entity& entity : both.entities) {
    if (entity.signpost.to_map == name_of_a || entity.signpost.to_map == name_of_b)
      entity.signpost.to_map.clear();
  }
  return *Moved(both, ContentFollower().Follow(both, *joined.aligned, *joined.map));
}

std::optional<std::string> RedirectSignposts(const std::string& text, const std::string& from,
                                             const std::string& into) {
  if (text.empty()) return std::nullopt;
  // Only their ids are written again.
  content::Scene scene = content::DecodeScene(text, "its scene", [](const std::string& id) {
    auto asset = std::make_shared<content::Asset>();
    asset->id = id;
    return asset;
  });
  bool changed = false;
  for (content::Entity& entity : scene.entities) {
    if (entity.signpost.to_map != from) continue;
    entity.signpost.to_map = into;
    changed = true;
  }
  if (!changed) return std::nullopt;
  return content::EncodeScene(scene);
}

maps::SceneJoiner LibrarySceneJoiner(const std::string& file) {
  maps::SceneJoiner joiner;
  joiner.join = [file](const maps::StoredMap& into, const maps::StoredMap& from,
                       const engine::JoinedMap& joined) {
    AssetCache assets;
    const auto scene_of = [&](const maps::StoredMap& map) {
      return SceneFromRecord(map.scene, file + ", map '" + map.info.name + "'", &assets);
    };
    return std::make_shared<maps::SceneRecord>(
        RecordFromScene(JoinScenes(scene_of(into), scene_of(from), into.info.name, from.info.name, joined)));
  };
  joiner.redirect = RedirectSignposts;
  return joiner;
}

}  // namespace docent::app
