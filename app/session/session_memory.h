// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "app/script/commands.h"
#include "app/session/session_assets.h"
#include "app/session/session_options.h"
#include "app/session/session_state.h"
#include "content/edit_history.h"
#include "engine/system/system.h"
#include "maps/library/library.h"
#include "maps/library/map_pager.h"

namespace docent::app {

// Which maps of the library are in memory: the pager loads and evicts maps, the session tells it which are in
// use. Until Open is called, the session has no library, and every function does nothing.
class SessionMemory {
 public:
  // All pointers must outlive this; library may be null.
  SessionMemory(const SessionOptions& options, const maps::Library* library, engine::System* system,
                std::mutex* mutex, SessionState* state, SessionAssets* assets)
      : options_(options),
        library_(library),
        system_(*system),
        mutex_(*mutex),
        state_(*state),
        assets_(*assets) {}

  // Makes the maps of the library known, and loads those that the options ask for. Call it once, before the
  // first frame and without the mutex. Throws Error when a map that is read now is invalid.
  void Open();
  // Loads the map that a command names, if the command needs the map itself, and waits for it. Without the
  // session's mutex. Throws Error when it cannot be read.
  void LoadFor(const Command& command);
  // Reads the content of a map in memory again, because another program has changed it in the library. Other
  // maps are read when they are needed, and maps whose keyframes have changed too when they are loaded anew.
  // Returns the name of the map if its content is now another one. Without the session's mutex, on any
  // thread. Only for sessions that do not write. Throws Error when it cannot be read.
  std::optional<std::string> ReloadContent(std::uint64_t key);

  // With the session's mutex held: keeps the maps that cameras are in, and prepares for going where the
  // signposts of a map lead.
  void PinMapsInUse();
  void ExpectNeighbours(const SessionMap& map);

 private:
  // On the pager's thread, without the mutex.
  void AddLoadedMap(const maps::StoredMap& stored);
  // With the session's mutex held.
  void Install(const maps::StoredMap& stored, std::shared_ptr<content::Scene> scene,
               content::EditHistory history, const std::shared_ptr<const engine::LightEstimate>& light,
               bool content_left_out);
  void ReloadIfChangedSince(const maps::MapInfo& read);
  content::EditHistory StoredHistory(std::uint64_t key, const std::string& where, AssetCache* assets,
                                     std::vector<std::string>* problems) const;
  bool Evict(std::uint64_t key);
  // The name that the session has for a map.
  std::string NameOf(const maps::MapInfo& info) const;
  // With it.
  void ResolveSignposts(content::Scene* scene) const;

  const SessionOptions& options_;
  const maps::Library* const library_;
  engine::System& system_;
  std::mutex& mutex_;  // the session's; guards the next two
  SessionState& state_;
  SessionAssets& assets_;
  // On a tour, the older ones of maps that are copies of each other, each with the newest.
  std::map<std::uint64_t, std::uint64_t> replaced_;
  // On a tour, the names of copies that visitors are not to read; see maps::NamesForVisitors.
  std::map<std::string, std::string> names_for_visitors_;
  std::mutex reloading_mutex_;           // Held while content is read again; taken before the session's.
  std::optional<maps::MapPager> pager_;  // last, because its thread calls back into the other members
};

}  // namespace docent::app
