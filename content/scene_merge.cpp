// SPDX-License-Identifier: Apache-2.0
#include "content/scene_merge.h"

#include <algorithm>
#include <map>

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

bool HasGroup(const Scene& scene, const std::string& group) {
  return std::any_of(scene.entities.begin(), scene.entities.end(),
                     [&](const Entity& entity) { return entity.group == group; });
}

std::string FormWithoutGroup(Entity entity) {
  entity.group.clear();
  return StoredForm(std::move(entity));
}

// The groups of theirs that are not in the base.
class NewGroups {
 public:
  NewGroups(const Scene& base, const Scene& theirs) : base_(base) {
    for (const Entity& their : theirs.entities) {
      if (!IsNew(their.group)) continue;
      if (base.Find(their.name) != nullptr) {
        by_name_.emplace(their.name, their.group);
      } else {
        by_form_.emplace(FormWithoutGroup(their), their.group);
      }
    }
  }
  bool IsNew(const std::string& group) const { return !group.empty() && !HasGroup(base_, group); }
  // Their new group of an entity of mine; null if they have put it into none. One that the base does not have
  // may have got another name in an earlier merge.
  const std::string* Find(const Entity& my) const {
    if (const auto found = by_name_.find(my.name); found != by_name_.end()) return &found->second;
    const auto found = by_form_.find(FormWithoutGroup(my));
    return found == by_form_.end() ? nullptr : &found->second;
  }

 private:
  const Scene& base_;
  std::map<std::string, std::string> by_name_, by_form_;
};

// Whether a group of mine and one of theirs are the same if both have the same entity: they have one name, or
// theirs has the one that an earlier merge gave to mine.
bool IsSameGroup(const std::string& mine, const std::string& their, const Scene& theirs) {
  if (their == mine) return true;
  const std::string stem = mine + "-";
  return their.starts_with(stem) && their.size() > stem.size() &&
         their.find_first_not_of("0123456789", stem.size()) == std::string::npos && HasGroup(theirs, mine);
}

// My scene, in which a new group has the name of a group of theirs only if both sides have put the same
// entity into it: authors who do not know of each other choose the same names for their groups.
Scene WithGroupsApart(const Scene& base, Scene mine, const Scene& theirs) {
  const NewGroups new_groups(base, theirs);
  std::map<std::string, std::string> names;  // By the name that I have given.
  for (const Entity& my : mine.entities) {
    if (!new_groups.IsNew(my.group) || names.contains(my.group)) continue;
    const std::string* const their = new_groups.Find(my);
    if (their != nullptr && IsSameGroup(my.group, *their, theirs)) names[my.group] = *their;
  }
  const auto is_taken = [&](const std::string& name) {
    return HasGroup(base, name) || HasGroup(mine, name) || HasGroup(theirs, name) ||
           std::any_of(names.begin(), names.end(), [&](const auto& given) { return given.second == name; });
  };
  for (const Entity& my : mine.entities) {
    if (!new_groups.IsNew(my.group) || names.contains(my.group) || !HasGroup(theirs, my.group)) continue;
    int number = 2;
    while (is_taken(my.group + "-" + std::to_string(number))) ++number;
    names[my.group] = my.group + "-" + std::to_string(number);
  }
  for (Entity& my : mine.entities) {
    if (const auto name = names.find(my.group); name != names.end()) my.group = name->second;
  }
  return mine;
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
  const Scene grouped = WithGroupsApart(base, mine, theirs);
  SceneMerge merge;
  merge.scene.settings = MergeSettings(base.settings, mine.settings, theirs.settings, &merge.conflicts);
  std::vector<const Entity*> in_conflict;
  for (const Entity& their : theirs.entities) {
    const Entity* const before = base.Find(their.name);
    const Entity* const my = grouped.Find(their.name);
    if (IsSame(&their, before)) {
      // Nobody but me may have changed it; if I removed it, it is gone.
      if (my != nullptr) merge.scene.entities.push_back(*my);
      continue;
    }
    merge.scene.entities.push_back(their);
    if (my != nullptr && !IsSame(my, before) && !IsSame(my, &their)) in_conflict.push_back(my);
  }
  for (const Entity& my : grouped.entities) {
    if (theirs.Find(my.name) == nullptr && !IsSame(&my, base.Find(my.name)))
      merge.scene.entities.push_back(my);
  }
  // Last, so that no new name is that of another entity.
  for (const Entity* my : in_conflict) KeepBoth(*my, &merge);
  return merge;
}

}  // namespace docent::content
