// SPDX-License-Identifier: Apache-2.0
#include "content/edit_history.h"

#include <algorithm>
#include <iterator>
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

// Moves what is stored of an entity, and follows it through changes from its state after one to that before
// it (or the other way round if not `backwards`), until it begins.
class StoredStates {
 public:
  // name: of the entity where the first change is entered.
  StoredStates(const engine::Sim3& motion, bool backwards, std::string name)
      : motion_(motion), backwards_(backwards), name_(std::move(name)) {}

  // The last changes come first. Both return false once the entity begins.
  bool Move(SceneChange* change) { return Move(change, backwards_ ? change->entities.size() : 0); }
  // Only those before the one with this index, or from it on.
  bool Move(SceneChange* change, std::size_t index) {
    const auto step = [this](EntityChange& entity) { return Move(&entity); };
    auto& entities = change->entities;
    const auto place = entities.begin() + static_cast<Difference>(index);
    return backwards_ ? std::all_of(std::make_reverse_iterator(place), entities.rend(), step)
                      : std::all_of(place, entities.end(), step);
  }

 private:
  bool Move(EntityChange* entity) {
    std::optional<Entity>& known = backwards_ ? entity->after : entity->before;
    std::optional<Entity>& other = backwards_ ? entity->before : entity->after;
    if (!known || known->name != name_) return true;
    MoveWithAnchor(motion_, &*known);
    if (!other) return false;
    MoveWithAnchor(motion_, &*other);
    name_ = other->name;
    return true;
  }

  const engine::Sim3 motion_;
  const bool backwards_;
  std::string name_;
};

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
  StoredStates earlier(motion, true, name), later(motion, false, name);
  for (auto change = done_.rbegin(); change != done_.rend() && earlier.Move(&*change);) ++change;
  for (auto change = undone_.rbegin(); change != undone_.rend() && later.Move(&*change);) ++change;
}

std::vector<AbsentEntity> EditHistory::Absent(std::size_t most) const {
  std::vector<AbsentEntity> absent;
  for (const bool undone : {false, true}) {
    const std::vector<SceneChange>& changes = undone ? undone_ : done_;
    const std::size_t end = absent.size() + most;
    for (std::size_t i = changes.size(); i-- > 0 && absent.size() < end;) {
      const auto& entities = changes[i].entities;
      for (std::size_t k = 0; k < entities.size(); ++k) {
        const std::optional<Entity>& here = undone ? entities[k].before : entities[k].after;
        if (!here) absent.push_back({undone ? *entities[k].after : *entities[k].before, undone, i, k});
      }
    }
    if (absent.size() > end) absent.resize(end);
  }
  return absent;
}

void EditHistory::MoveWithAnchor(const AbsentEntity& absent, const engine::Sim3& motion) {
  std::vector<SceneChange>& changes = absent.undone ? undone_ : done_;
  EntityChange& end = changes[absent.change].entities[absent.index];
  Entity& state = absent.undone ? *end.after : *end.before;
  content::MoveWithAnchor(motion, &state);
  StoredStates others(motion, !absent.undone, state.name);
  bool goes_on = others.Move(&changes[absent.change], absent.index + (absent.undone ? 1 : 0));
  for (std::size_t i = absent.change; goes_on && i-- > 0;) goes_on = others.Move(&changes[i]);
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

void EditHistory::AddSettings(const MapSettings& gained) {
  for (std::vector<SceneChange>* const changes : {&done_, &undone_}) {
    for (SceneChange& change : *changes) {
      if (!change.settings) continue;
      for (MapSettings* const state : {&change.settings->before, &change.settings->after}) {
        if (!state->up) state->up = gained.up;
        if (state->metres_per_unit == 0) state->metres_per_unit = gained.metres_per_unit;
      }
    }
  }
}

std::set<std::string> EditHistory::Names() const {
  std::set<std::string> names;
  for (const auto* changes : {&done_, &undone_}) {
    for (const SceneChange& change : *changes) {
      for (const EntityChange& entity : change.entities) {
        for (const auto* state : {&entity.before, &entity.after}) {
          if (*state) names.insert((*state)->name);
        }
      }
    }
  }
  return names;
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
