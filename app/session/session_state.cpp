// SPDX-License-Identifier: Apache-2.0
#include "app/session/session_state.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "engine/base/error.h"
#include "engine/base/utf8.h"
#include "maps/library/library.h"

namespace docent::app {

namespace {

// The map that a signpost leads to, even if it no longer exists; null if it leads to none of these.
const SessionMap* MapOf(const content::Signpost& signpost, const std::map<std::uint64_t, SessionMap>& maps) {
  if (signpost.to_key != 0) {
    const auto found = maps.find(signpost.to_key);
    return found != maps.end() ? &found->second : nullptr;
  }
  const SessionMap* joined = nullptr;
  for (const auto& [key, map] : maps) {
    if (signpost.to_map.empty() || map.name != signpost.to_map) continue;
    if (map.Exists()) return &map;
    if (map.joined_into != 0) joined = &map;
  }
  return joined;
}

}  // namespace

void SessionCamera::Advise(const std::string& sentence) {
  constexpr Timestamp kShown = std::chrono::seconds(15);
  advice = sentence;
  advice_end = last_time + kShown;
}

SessionState::SessionState(std::vector<std::shared_ptr<const engine::CameraModel>> models) {
  for (auto& model : models) {
    SessionCamera camera;
    camera.model = std::move(model);
    cameras.push_back(std::move(camera));
  }
}

void SessionState::AddEvent(Timestamp time, std::string event, std::string detail) {
  events.push_back({time, std::move(event), std::move(detail)});
}

Timestamp SessionState::LastTime() const {
  Timestamp time{};
  for (const SessionCamera& camera : cameras) time = std::max(time, camera.last_time);
  return time;
}

std::string SessionState::CameraPrefix(std::size_t camera) const {
  return cameras.size() > 1 ? "camera " + std::to_string(camera) + ": " : std::string();
}

SessionMap& SessionState::AddMap(std::uint64_t key, const std::string& name) {
  SessionMap& map = maps[key];
  map.key = key;
  map.name = name;
  map.changed = true;
  return map;
}

SessionMap* SessionState::FindMap(std::uint64_t key) {
  const auto found = maps.find(key);
  return found == maps.end() ? nullptr : &found->second;
}

SessionMap* SessionState::FindByName(const std::string& name) {
  for (auto& [key, map] : maps) {
    if (map.Exists() && map.name == name) return &map;
  }
  return nullptr;
}

SessionMap& SessionState::InitializedMap(const std::string& name) {
  SessionMap* const map = FindByName(name);
  if (map == nullptr) throw Error("there is no map '" + name + "'");
  if (!map->snapshot)
    throw Error("the map '" + name + "' has only just been started; move the camera sideways first");
  return *map;
}

std::string SessionState::NameOf(std::uint64_t key) const {
  const auto found = maps.find(key);
  return found != maps.end() ? found->second.name : std::string();
}

bool SessionState::Resolve(content::Signpost* signpost) const {
  const SessionMap* map = MapOf(*signpost, maps);
  if (map == nullptr) return false;
  while (map->joined_into != 0) {
    const auto into = maps.find(map->joined_into);
    if (into == maps.end()) return false;
    map = &into->second;
  }
  if (map->discarded) {
    content::LeadNowhere(signpost);
    return true;
  }
  if (signpost->to_key == map->key && signpost->to_map == map->name) return false;
  signpost->to_key = map->key;
  signpost->to_map = map->name;
  return true;
}

std::string SessionState::FreeMapName(const std::string& name) const {
  std::string stem = name;
  const std::size_t space = name.rfind(' ');
  if (space != std::string::npos && space + 1 < name.size() &&
      name.find_first_not_of("0123456789", space + 1) == std::string::npos)
    stem = name.substr(0, space);
  for (int number = 2;; ++number) {
    const std::string suffix = " " + std::to_string(number);
    const std::string candidate = Shortened(stem, maps::kMaxMapNameBytes - suffix.size()) + suffix;
    const bool taken = std::any_of(maps.begin(), maps.end(), [&](const auto& entry) {
      return !entry.second.discarded && entry.second.name == candidate;
    });
    if (!taken) return candidate;
  }
}

void SessionState::Retarget(std::uint64_t from_key, const std::string& from, std::uint64_t to_key,
                            const std::string& to) {
  const auto retarget = [&](content::Signpost* signpost) {
    const bool leads = signpost->to_key != 0 ? signpost->to_key == from_key : signpost->to_map == from;
    if (!leads) return false;
    signpost->to_key = to_key;
    signpost->to_map = to;
    if (to_key == 0 && to.empty()) content::LeadNowhere(signpost);
    return true;
  };
  for (auto& [key, map] : maps) {
    if (!map.Exists() || !maps::MayChangeContent(map.policy)) continue;
    auto scene = std::make_shared<content::Scene>(*map.scene);
    bool changed = map.history.RetargetSignposts(retarget);
    for (content::Entity& entity : scene->entities) {
      if (entity.kind != content::Entity::Kind::kSignpost) continue;
      changed = retarget(&entity.signpost) || changed;
    }
    // The history is saved with the scene.
    if (changed) map.Follow(std::move(scene));
  }
}

}  // namespace docent::app
