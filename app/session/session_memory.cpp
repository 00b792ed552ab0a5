// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "app/session/session.h"

// Which maps of the library are in memory: the pager loads and evicts maps, the session tells it which are in
// use.
namespace docent::app {

void Session::LoadMaps() {
  for (const maps::MapInfo& info : library_->List()) {
    SessionMap& map = maps_[info.key];
    map.key = info.key;
    map.name = info.name;
    map.policy = info.policy;
    map.bounds = info.bounds;
    map.saved_scene = map.scene;
    map.in_library = true;
    system_.AddMap(map.key, nullptr, PermissionsOf(map));
  }
  maps::MapPager::Callbacks callbacks;
  callbacks.loaded = [this](const maps::StoredMap& stored) { AddLoadedMap(stored); };
  callbacks.evict = [this](std::uint64_t key) { return Evict(key); };
  callbacks.failed = [this](std::uint64_t, const std::string& problem) {
    const std::scoped_lock lock(mutex_);
    AddEvent(LastTime(), "warning", problem);
  };
  pager_.emplace(library_, &system_.place_index(), options_.memory, std::move(callbacks));
  system_.SetPlaceFinder(&*pager_);
  pager_->Open();
}

void Session::AddLoadedMap(const maps::StoredMap& stored) {
  AssetCache assets;
  {
    const std::scoped_lock lock(mutex_);
    assets = assets_;
  }
  // Models are decoded without the lock, so that frames are processed meanwhile.
  auto scene = std::make_shared<const content::Scene>(
      SceneFromRecord(stored.scene, library_->file() + ", map '" + stored.info.name + "'", &assets));
  const std::scoped_lock lock(mutex_);
  assets_.merge(assets);
  // A map that another process saved since the session began is not part of the session.
  const auto found = maps_.find(stored.info.key);
  if (found == maps_.end() || found->second.changed) return;
  SessionMap& map = found->second;
  map.snapshot = map.saved_snapshot = stored.snapshot;
  map.scene = map.saved_scene = std::move(scene);
  system_.SetSnapshot(map.key, map.snapshot);
  UpdatePermissions(map);
}

bool Session::Evict(std::uint64_t key) {
  const std::scoped_lock lock(mutex_);
  const auto found = maps_.find(key);
  if (found == maps_.end()) return true;
  SessionMap& map = found->second;
  if (map.changed || map.NeedsSave() || system_.IsInUse(key)) return false;
  system_.SetSnapshot(key, nullptr);
  map.snapshot.reset();
  map.saved_snapshot.reset();
  map.scene = map.saved_scene = std::make_shared<content::Scene>();
  std::erase_if(assets_, [](const auto& asset) { return asset.second.use_count() == 1; });
  return true;
}

// Loads the map that a command names, if the command needs the map itself.
void Session::LoadIntoMemory(const Command& command) {
  const std::string* name = nullptr;
  if (const auto* use = std::get_if<UseMap>(&command)) name = &use->name;
  if (const auto* policy = std::get_if<SetPolicy>(&command)) name = &policy->name;
  if (const auto* paste = std::get_if<PasteEntities>(&command)) name = &paste->from_map;
  if (!pager_ || name == nullptr) return;
  std::uint64_t key = 0;
  {
    const std::scoped_lock lock(mutex_);
    const SessionMap* const map = FindByName(*name);
    if (map != nullptr && map->in_library && !map->snapshot) key = map->key;
  }
  if (key != 0) pager_->Load(key);
}

void Session::PinMapsInUse() {
  if (!pager_) return;
  pager_->Pin(system_.MapsInUse());
}

// A camera is likely to go where the signposts of its map lead.
void Session::ExpectNeighbours(const SessionMap& map) {
  if (!pager_) return;
  std::vector<std::uint64_t> keys;
  for (const content::Entity& entity : map.scene->entities) {
    if (entity.kind != content::Entity::Kind::kSignpost || entity.signpost.to_map.empty()) continue;
    const SessionMap* const neighbour = FindByName(entity.signpost.to_map);
    if (neighbour != nullptr && neighbour->in_library) keys.push_back(neighbour->key);
  }
  pager_->Prefetch(keys);
}

}  // namespace docent::app
