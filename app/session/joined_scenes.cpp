// SPDX-License-Identifier: Apache-2.0
#include "app/session/joined_scenes.h"

#include <memory>
#include <utility>

#include "app/session/content_follower.h"
#include "content/scene_codec.h"

namespace docent::app {

void MergeScene(const content::Scene& b, const std::string& name_of_a, const std::string& name_of_b,
                const engine::JoinedMap& joined, content::Scene* scene) {
  content::Scene aligned = b;
  for (content::Entity& entity : aligned.entities) content::MoveWithAnchor(joined.a_from_b, &entity);
  const auto moved = Moved(aligned, ContentFollower().Follow(aligned, *joined.aligned, *joined.map));
  for (content::Entity entity : moved->entities) {
    entity.name = scene->FreeName(entity.name);
    scene->entities.push_back(std::move(entity));
  }
  for (content::Entity& entity : scene->entities) {
    if (entity.signpost.to_map == name_of_a || entity.signpost.to_map == name_of_b)
      entity.signpost.to_map.clear();
  }
}

content::Scene JoinScenes(const content::Scene& a, const content::Scene& b, const std::string& name_of_a,
                          const std::string& name_of_b, const engine::JoinedMap& joined) {
  content::Scene both = *Moved(a, ContentFollower().Follow(a, *joined.aligned, *joined.map));
  MergeScene(b, name_of_a, name_of_b, joined, &both);
  return both;
}

bool RedirectSceneSignposts(const std::string& from, const std::string& into, content::Scene* scene) {
  bool changed = false;
  for (content::Entity& entity : scene->entities) {
    if (entity.signpost.to_map != from) continue;
    entity.signpost.to_map = into;
    changed = true;
  }
  return changed;
}

std::optional<std::string> RedirectSignposts(const std::string& text, const std::string& from,
                                             const std::string& into) {
  if (text.empty()) return std::nullopt;
  // Encoding writes only the ids of assets, so their bytes are not needed.
  content::Scene scene = content::DecodeScene(text, "its scene", [](const std::string& id) {
    auto asset = std::make_shared<content::Asset>();
    asset->id = id;
    return asset;
  });
  if (!RedirectSceneSignposts(from, into, &scene)) return std::nullopt;
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
