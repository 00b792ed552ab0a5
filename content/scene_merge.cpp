// SPDX-License-Identifier: Apache-2.0
#include "content/scene_merge.h"

#include <algorithm>

#include "content/entity_codec.h"

namespace docent::content {

namespace {

// Equal for entities that are stored equally. The name is left out.
std::string StoredForm(Entity entity) {
  entity.name = "entity";
  return EntityToJson(entity).dump();
}

// Whether both are missing or stored equally.
bool IsSame(const Entity* a, const Entity* b) {
  if (a == nullptr || b == nullptr) return a == b;
  return StoredForm(*a) == StoredForm(*b);
}

// Adds my version of an entity that both sides have changed, unless an equal one is there: an earlier merge
// may have been interrupted after it was saved.
void KeepBoth(const Entity& mine, SceneMerge* merge) {
  const std::string form = StoredForm(mine);
  const bool is_there = std::any_of(merge->scene.entities.begin(), merge->scene.entities.end(),
                                    [&](const Entity& entity) { return StoredForm(entity) == form; });
  if (is_there) return;
  Entity copy = mine;
  copy.name = merge->scene.FreeName(mine.name);
  merge->conflicts.push_back("'" + mine.name + "' was changed by both; the other version is '" + mine.name +
                             "', and this one is '" + copy.name + "'");
  merge->scene.entities.push_back(std::move(copy));
}

MapSettings MergeSettings(const MapSettings& base, const MapSettings& mine, const MapSettings& theirs,
                          std::vector<std::string>* conflicts) {
  if (theirs == base || theirs == mine) return mine;
  if (mine != base)
    conflicts->push_back(
        "the up direction or the scale of the map was changed by both; the other version is kept, and this "
        "one "
        "was " +
        SettingsToJson(mine).dump());
  return theirs;
}

}  // namespace

SceneMerge MergeScenes(const Scene& base, const Scene& mine, const Scene& theirs) {
  SceneMerge merge;
  merge.scene.settings = MergeSettings(base.settings, mine.settings, theirs.settings, &merge.conflicts);
  std::vector<const Entity*> in_conflict;
  for (const Entity& their : theirs.entities) {
    const Entity* const before = base.Find(their.name);
    const Entity* const my = mine.Find(their.name);
    if (IsSame(&their, before)) {
      // Nobody but me may have changed it; if I removed it, it is gone.
      if (my != nullptr) merge.scene.entities.push_back(*my);
      continue;
    }
    merge.scene.entities.push_back(their);
    if (my != nullptr && !IsSame(my, before) && !IsSame(my, &their)) in_conflict.push_back(my);
  }
  for (const Entity& my : mine.entities) {
    if (theirs.Find(my.name) == nullptr && !IsSame(&my, base.Find(my.name)))
      merge.scene.entities.push_back(my);
  }
  // Last, so that no new name is that of another entity.
  for (const Entity* my : in_conflict) KeepBoth(*my, &merge);
  return merge;
}

}  // namespace docent::content
