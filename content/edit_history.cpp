// SPDX-License-Identifier: Apache-2.0
#include "content/edit_history.h"

#include <algorithm>
#include <map>
#include <utility>

#include "engine/base/error.h"

namespace docent::content {
namespace {

using Difference = std::vector<Entity>::difference_type;

// The index of the entity that a change refers to; throws Error when there is none.
std::size_t IndexOfChanged(const Scene& scene, const EntityChange& change) {
  const std::string& name = change.before->name;
  if (change.index < scene.entities.size() && scene.entities[change.index].name == name) return change.index;
  const Entity* const found = scene.Find(name);
  if (found == nullptr) throw Error("There is no '" + name + "' in this map.");
  return static_cast<std::size_t>(found - scene.entities.data());
}

void ApplyToList(const EntityChange& change, Scene* scene) {
  std::vector<Entity>& entities = scene->entities;
  if (!change.before) {
    const std::size_t index = std::min(change.index, entities.size());
    entities.insert(entities.begin() + static_cast<Difference>(index), *change.after);
    return;
  }
  const std::size_t index = IndexOfChanged(*scene, change);
  if (change.after) {
    entities[index] = *change.after;
  } else {
    entities.erase(entities.begin() + static_cast<Difference>(index));
  }
}

// Follows an entity through one change, from its state after the change to that before it (or the other way
// round for a reversed one), and moves what is stored of it. `name` is its name before the change afterwards.
// Returns false where the entity begins.
bool MoveStored(const engine::Sim3& motion, bool backwards, SceneChange* change, std::string* name) {
  const auto step = [&](EntityChange* entity) {
    std::optional<Entity>& known = backwards ? entity->after : entity->before;
    std::optional<Entity>& other = backwards ? entity->before : entity->after;
    if (!known || known->name != *name) return true;
    MoveWithAnchor(motion, &*known);
    if (!other) return false;
    MoveWithAnchor(motion, &*other);
    *name = other->name;
    return true;
  };
  auto& entities = change->entities;
  if (backwards) {
    return std::all_of(entities.rbegin(), entities.rend(), [&](EntityChange& e) { return step(&e); });
  }
  return std::all_of(entities.begin(), entities.end(), [&](EntityChange& e) { return step(&e); });
}

}  // namespace

SceneChange Reversed(const SceneChange& change) {
  SceneChange reversed{change.label, {change.entities.rbegin(), change.entities.rend()}};
  for (EntityChange& entity : reversed.entities) std::swap(entity.before, entity.after);
  if (change.settings) reversed.settings = {change.settings->after, change.settings->before};
  return reversed;
}

void ApplyChange(const SceneChange& change, Scene* scene) {
  Scene changed = *scene;
  for (const EntityChange& entity : change.entities) ApplyToList(entity, &changed);
  if (change.settings) changed.settings = change.settings->after;
  if (const std::string problem = Validate(changed); !problem.empty()) throw Error(problem);
  *scene = std::move(changed);
}

void EditHistory::Do(SceneChange change, Scene* scene) {
  ApplyChange(change, scene);
  done_.push_back(std::move(change));
  undone_.clear();
}

bool EditHistory::Undo(Scene* scene) {
  if (done_.empty()) return false;
  ApplyChange(Reversed(done_.back()), scene);
  undone_.push_back(std::move(done_.back()));
  done_.pop_back();
  return true;
}

bool EditHistory::Redo(Scene* scene) {
  if (undone_.empty()) return false;
  ApplyChange(undone_.back(), scene);
  done_.push_back(std::move(undone_.back()));
  undone_.pop_back();
  return true;
}

void EditHistory::MoveWithAnchor(const std::string& name, const engine::Sim3& motion) {
  std::string earlier = name;
  for (auto change = done_.rbegin(); change != done_.rend(); ++change) {
    if (!MoveStored(motion, true, &*change, &earlier)) break;
  }
  std::string later = name;
  for (auto change = undone_.rbegin(); change != undone_.rend(); ++change) {
    if (!MoveStored(motion, false, &*change, &later)) break;
  }
}

bool EditHistory::RetargetSignposts(const std::function<bool(Signpost*)>& retarget) {
  bool any = false;
  for (std::vector<SceneChange>* const changes : {&done_, &undone_}) {
    for (SceneChange& change : *changes) {
      for (EntityChange& entity : change.entities) {
        for (std::optional<Entity>* const state : {&entity.before, &entity.after}) {
          if (!*state || (*state)->kind != Entity::Kind::kSignpost) continue;
          any = retarget(&(*state)->signpost) || any;
        }
      }
    }
  }
  return any;
}

std::vector<std::shared_ptr<const Asset>> EditHistory::Assets() const {
  std::map<std::string, std::shared_ptr<const Asset>> by_id;
  for (const auto* changes : {&done_, &undone_}) {
    for (const SceneChange& change : *changes) {
      for (const EntityChange& entity : change.entities) {
        for (const auto* state : {&entity.before, &entity.after}) {
          if (const auto asset = *state ? AssetOf(**state) : nullptr) by_id.emplace(asset->id, asset);
        }
      }
    }
  }
  std::vector<std::shared_ptr<const Asset>> assets;
  for (const auto& [id, asset] : by_id) assets.push_back(asset);
  return assets;
}

}  // namespace docent::content
