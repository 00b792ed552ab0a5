// SPDX-License-Identifier: Apache-2.0
#include "app/session/session_memory.h"

#include <memory>
#include <utility>
#include <variant>

#include "app/session/library_scene.h"
#include "engine/base/error.h"
#include "maps/library/map_copies.h"
#include "maps/storage/checksum.h"

namespace docent::app {

void SessionMemory::Open() {
  maps::PagerOptions paging = options_.memory;
  const std::vector<maps::MapCopy> copies = maps::FindCopies(*library_);
  if (options_.may_write) {
    // An author decides which one to keep.
    for (const maps::MapCopy& copy : copies)
      state_.AddEvent(state_.LastTime(), "warning", maps::TextOf(copy));
  } else {
    replaced_ = maps::ReplacedByCopies(copies);
    names_for_visitors_ = maps::NamesForVisitors(library_->List(), copies);
    for (const auto& [older, newer] : replaced_) paging.left_out.push_back(older);
  }
  for (const maps::MapInfo& info : library_->List()) {
    SessionMap& map = state_.maps[info.key];
    map.key = info.key;
    map.name = NameOf(info);
    map.policy = info.policy;
    map.bounds = info.bounds;
    map.saved_scene = map.scene;
    map.in_library = true;
    system_.AddMap(map.key, nullptr, map.Permissions());
  }
  maps::MapPager::Callbacks callbacks;
  callbacks.loaded = [this](const maps::StoredMap& stored) { AddLoadedMap(stored); };
  callbacks.exists = [this](std::uint64_t key) {
    const std::scoped_lock lock(mutex_);
    const SessionMap* const map = state_.FindMap(key);
    return map != nullptr && map->Exists();
  };
  callbacks.evict = [this](std::uint64_t key) { return Evict(key); };
  callbacks.failed = [this](std::uint64_t, const std::string& problem) {
    const std::scoped_lock lock(mutex_);
    state_.AddEvent(state_.LastTime(), "warning", problem);
  };
  pager_.emplace(library_, &system_.place_index(), paging, std::move(callbacks));
  system_.SetPlaceFinder(&*pager_);
  pager_->Open();
}

void SessionMemory::AddLoadedMap(const maps::StoredMap& stored) {
  AssetCache assets;
  {
    const std::scoped_lock lock(mutex_);
    assets = assets_.all();
  }
  // Models are decoded without the lock, so that frames are processed meanwhile.
  const std::string where = library_->file() + ", map '" + stored.info.name + "'";
  std::vector<std::string> problems = stored.lost_content;
  auto scene = std::make_shared<content::Scene>(ReadableScene(stored.scene, where, &assets, &problems));
  const bool content_left_out = !problems.empty();
  content::EditHistory history;
  if (options_.may_write && !content_left_out)
    history = StoredHistory(stored.info.key, where, &assets, &problems);
  const std::shared_ptr<const engine::LightEstimate> light =
      stored.mesh && options_.room_light ? LightOn(*stored.snapshot, *stored.mesh) : nullptr;
  {
    const std::scoped_lock lock(mutex_);
    for (const std::string& problem : problems) state_.AddEvent(state_.LastTime(), "warning", problem);
    assets_.Merge(&assets);
    Install(stored, std::move(scene), std::move(history), light, content_left_out);
  }
  if (!options_.may_write) ReloadIfChangedSince(stored.info);
}

// A hub's update that landed while the map was read did not find the map in memory.
void SessionMemory::ReloadIfChangedSince(const maps::MapInfo& read) {
  try {
    if (library_->Find(read.key) != read) ReloadContent(read.key);
  } catch (const Error& error) {
    // A map that was removed stays until the session ends.
    const std::scoped_lock lock(mutex_);
    state_.AddEvent(state_.LastTime(), "warning", error.what());
  }
}

void SessionMemory::Install(const maps::StoredMap& stored, std::shared_ptr<content::Scene> scene,
                            content::EditHistory history,
                            const std::shared_ptr<const engine::LightEstimate>& light,
                            bool content_left_out) {
  // A map that another process saved since the session began is not part of the session. A known one may have
  // been removed while it was read.
  SessionMap* const known = state_.FindMap(stored.info.key);
  if (known == nullptr || !known->Exists() || known->changed) return;
  SessionMap& map = *known;
  map.snapshot = map.saved_snapshot = stored.snapshot;
  ResolveSignposts(scene.get());
  map.scene = map.saved_scene = std::move(scene);
  map.content_left_out = content_left_out;
  map.stored_scene = maps::SceneTextChecksum(stored.scene.text);
  history.RetargetSignposts([this](content::Signpost* signpost) { return state_.Resolve(signpost); });
  map.history = std::move(history);
  map.SetMesh(stored.mesh, light);
  system_.SetSnapshot(map.key, map.snapshot);
  system_.SetPermissions(map.key, map.Permissions());
}

std::optional<std::string> SessionMemory::ReloadContent(std::uint64_t key) {
  const auto find = [&]() -> SessionMap* {
    SessionMap* const map = library_ == nullptr ? nullptr : state_.FindMap(key);
    return map == nullptr || map->changed || !map->snapshot ? nullptr : map;
  };
  // The hub's thread and the pager's may both have a reason; the later one must find the newer content.
  const std::scoped_lock reloading(reloading_mutex_);
  AssetCache assets;
  if (pager_) pager_->MapHasChanged(key);
  const maps::MapInfo info = library_->Find(key);
  {
    const std::scoped_lock lock(mutex_);
    // Content in the coordinates of another state of the map could be shown in the wrong place.
    if (find() == nullptr || find()->snapshot->revision != info.revision) return std::nullopt;
    assets = assets_.all();
  }
  // Models are decoded without the lock, so that frames are processed meanwhile.
  const std::string where = library_->file() + ", map '" + info.name + "'";
  std::vector<std::string> problems;
  const maps::SceneRecord record = library_->LoadScene(key, &problems);
  auto scene = std::make_shared<content::Scene>(ReadableScene(record, where, &assets, &problems));
  const std::scoped_lock lock(mutex_);
  for (const std::string& problem : problems) state_.AddEvent(state_.LastTime(), "warning", problem);
  SessionMap* const map = find();
  if (map == nullptr || map->snapshot->revision != info.revision) return std::nullopt;
  assets_.Merge(&assets);
  map->name = NameOf(info);
  ResolveSignposts(scene.get());
  map->scene = map->saved_scene = std::move(scene);
  assets.clear();  // Otherwise all that were known would seem to be in use.
  assets_.EvictUnused();
  return map->name;
}

std::string SessionMemory::NameOf(const maps::MapInfo& info) const {
  const auto found = names_for_visitors_.find(info.name);
  return found == names_for_visitors_.end() ? info.name : found->second;
}

// Empty when the library has none, or a damaged one, which costs nothing else.
content::EditHistory SessionMemory::StoredHistory(std::uint64_t key, const std::string& where,
                                                  AssetCache* assets,
                                                  std::vector<std::string>* problems) const {
  try {
    const std::optional<maps::SceneRecord> record = library_->LoadHistory(key);
    if (record) return HistoryFromRecord(*record, where, assets);
  } catch (const Error& error) {
    problems->push_back(where + ": earlier changes cannot be undone: " + error.what());
  }
  return {};
}

// On a tour, signposts lead to the newest one of maps that are copies of each other.
void SessionMemory::ResolveSignposts(content::Scene* scene) const {
  for (content::Entity& entity : scene->entities) {
    if (entity.kind != content::Entity::Kind::kSignpost) continue;
    content::Signpost& signpost = entity.signpost;
    if (const auto copy = replaced_.find(signpost.to_key); copy != replaced_.end())
      signpost.to_key = copy->second;
    state_.Resolve(&signpost);
  }
}

bool SessionMemory::Evict(std::uint64_t key) {
  const std::scoped_lock lock(mutex_);
  SessionMap* const found = state_.FindMap(key);
  if (found == nullptr || found->discarded) return true;
  SessionMap& map = *found;
  if (map.changed || map.NeedsSave() || system_.IsInUse(key)) return false;
  system_.SetSnapshot(key, nullptr);
  map.snapshot.reset();
  map.saved_snapshot.reset();
  map.scene = map.saved_scene = std::make_shared<content::Scene>();
  map.history = {};
  map.mesh.reset();
  map.light.reset();
  assets_.EvictUnused();
  return true;
}

void SessionMemory::LoadFor(const Command& command) {
  const std::string* name = nullptr;
  if (const auto* use = std::get_if<UseMap>(&command)) name = &use->name;
  if (const auto* policy = std::get_if<SetPolicy>(&command)) name = &policy->name;
  if (const auto* join = std::get_if<JoinMap>(&command)) name = &join->name;
  if (const auto* paste = std::get_if<PasteEntities>(&command)) name = &paste->from_map;
  if (!pager_ || name == nullptr) return;
  std::uint64_t key = 0;
  {
    const std::scoped_lock lock(mutex_);
    const SessionMap* const map = state_.FindByName(*name);
    if (map != nullptr && map->in_library && !map->snapshot) key = map->key;
  }
  if (key != 0) pager_->Load(key);
}

void SessionMemory::PinMapsInUse() {
  if (!pager_) return;
  pager_->Pin(system_.MapsInUse());
}

// A camera is likely to go where the signposts of its map lead.
void SessionMemory::ExpectNeighbours(const SessionMap& map) {
  if (!pager_) return;
  std::vector<std::uint64_t> keys;
  for (const content::Entity& entity : map.scene->entities) {
    if (entity.kind != content::Entity::Kind::kSignpost) continue;
    const SessionMap* const neighbour = state_.FindMap(entity.signpost.to_key);
    if (neighbour != nullptr && neighbour->in_library) keys.push_back(neighbour->key);
  }
  pager_->Prefetch(keys);
}

}  // namespace docent::app
