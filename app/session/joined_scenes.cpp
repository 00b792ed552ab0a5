// SPDX-License-Identifier: Apache-2.0
#include "app/session/joined_scenes.h"

#include <algorithm>
#include <map>
#include <memory>
#include <string>
#include <utility>

#include "app/session/content_follower.h"
#include "maps/library/signposts.h"

namespace docent::app {

namespace {

bool LeadsToMap(const content::Entity& entity, const maps::MapInfo& map) {
  return entity.kind == content::Entity::Kind::kSignpost &&
         maps::LeadsTo({entity.signpost.to_key, entity.signpost.to_map}, map);
}

bool HasGroup(const content::Scene& scene, const std::string& group) {
  return std::ranges::any_of(scene.entities,
                             [&](const content::Entity& entity) { return entity.group == group; });
}

std::string FreeName(const content::Scene& scene, const std::set<std::string>& taken,
                     const std::string& base) {
  std::string name = base;
  for (int number = 2; scene.Find(name) != nullptr || taken.contains(name); ++number)
    name = base + "-" + std::to_string(number);
  return name;
}

// New names for the groups of B that A has too, by their old ones. What was not grouped together stays apart.
std::map<std::string, std::string> FreeGroups(const content::Scene& a, const content::Scene& b) {
  std::map<std::string, std::string> groups;
  for (const content::Entity& entity : b.entities) {
    const std::string& group = entity.group;
    if (group.empty() || groups.contains(group) || !HasGroup(a, group)) continue;
    std::string name;
    int number = 2;
    do {
      name = group + "-" + std::to_string(number++);
    } while (HasGroup(a, name) || HasGroup(b, name));
    groups[group] = name;
  }
  return groups;
}

}  // namespace

void MergeScene(const content::Scene& b, const maps::MapInfo& map_a, const maps::MapInfo& map_b,
                const engine::JoinedMap& joined, const std::set<std::string>& taken, content::Scene* scene) {
  content::Scene aligned = b;
  for (content::Entity& entity : aligned.entities) content::MoveWithAnchor(joined.a_from_b, &entity);
  const auto moved = Moved(aligned, ContentFollower().Follow(aligned, *joined.aligned, *joined.map));
  const std::map<std::string, std::string> groups = FreeGroups(*scene, b);
  for (content::Entity entity : moved->entities) {
    entity.name = FreeName(*scene, taken, entity.name);
    if (const auto group = groups.find(entity.group); group != groups.end()) entity.group = group->second;
    scene->entities.push_back(std::move(entity));
  }
  const content::MapSettings settings = content::Transformed(joined.a_from_b, b.settings);
  if (!scene->settings.up) scene->settings.up = settings.up;
  if (scene->settings.metres_per_unit == 0) scene->settings.metres_per_unit = settings.metres_per_unit;
  for (content::Entity& entity : scene->entities) {
    if (!LeadsToMap(entity, map_a) && !LeadsToMap(entity, map_b)) continue;
    content::LeadNowhere(&entity.signpost);
  }
}

content::Scene JoinScenes(const content::Scene& a, const content::Scene& b, const maps::MapInfo& map_a,
                          const maps::MapInfo& map_b, const engine::JoinedMap& joined) {
  content::Scene both = *Moved(a, ContentFollower().Follow(a, *joined.aligned, *joined.map));
  MergeScene(b, map_a, map_b, joined, {}, &both);
  return both;
}

bool RedirectSceneSignposts(const maps::MapInfo& from, const maps::MapInfo& into, content::Scene* scene) {
  bool changed = false;
  for (content::Entity& entity : scene->entities) {
    if (!LeadsToMap(entity, from)) continue;
    entity.signpost.to_map = into.name;
    entity.signpost.to_key = into.key;
    changed = true;
  }
  return changed;
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
        RecordFromScene(JoinScenes(scene_of(into), scene_of(from), into.info, from.info, joined)));
  };
  return joiner;
}

}  // namespace docent::app
