// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "maps/hub/hub_connection.h"
#include "maps/hub/map_facts.h"

// The maps of a museum in a PostgreSQL database, which many devices share (docs/hub.md). The database
// enforces roles and policies; the functions here check what it sends. Not thread-safe. Errors throw
// docent::Error.
namespace docent::maps {

inline constexpr int kHubVersion = 2;  // Of the tables; schema/version_N.sql makes the version N.

// A tour on a hub.
struct HubTour {
  std::string name;
  std::int64_t revision = 0;       // From 1.
  std::string language;            // As Tour::language, but other clients may have saved a longer one.
  int minutes = 0;                 // As Tour::minutes.
  std::vector<std::string> stops;  // Ids of maps.
  bool removed = false;
};

// A restoration of a hub from a backup. Revisions that were saved after the backup are lost, and their
// numbers are used again, so that a number alone does not say which state of a map it means.
struct HubRestoration {
  std::string id;                                   // A UUID, new with each restoration.
  std::map<std::string, std::int64_t> maps, tours;  // The newest revisions of the backup, by id and by name.
};

// The hub keeps a map that was to be removed, for instance because of its policy.
class HubRemovalRefused : public Error {
 public:
  using Error::Error;
};

// Opens a hub, and asks it for maps and saves them.
class Hub {
 public:
  // Connects. Throws HubUnreachable, or Error if the database holds no hub, or one of another version.
  explicit Hub(const std::string& url);

  const std::string& id() const { return id_; }  // Identifies the hub, wherever it moves.
  // The last restoration of the hub (HubRestoration::id); empty if there was none.
  const std::string& restoration() const { return restoration_; }
  bool may_save() const { return may_save_; }  // Whether this user may save maps, as curators may.
  // All restorations, the first one first.
  std::vector<HubRestoration> Restorations();
  // The number of the last change. It grows with each.
  std::int64_t LastChange();

  // The newest revisions of the maps that have changed since a change, in the order of their changes.
  std::vector<HubHead> Heads(std::int64_t since = 0);
  // A revision of a map; empty if the hub does not have it, or not any more.
  std::optional<HubRevision> Revision(const std::string& map, std::int64_t revision);
  // The bytes of an item. Throws Error if they do not have this hash.
  Bytes Blob(const std::string& hash);

  // Those of the hashes that the hub has no bytes for. It keeps the others for a day.
  std::vector<std::string> Missing(const Manifest& manifest);
  // Stores bytes, which a revision can then refer to.
  void PutBlob(std::span<const std::uint8_t> bytes);
  // Saves a map as the revision after `base`, 0 for a new map; returns the new revision. All its bytes must
  // be there. Throws HubConflict if `base` is not the newest one.
  std::int64_t SaveMap(const std::string& map, std::int64_t base, const MapFacts& facts,
                       const Manifest& manifest);
  // Removes a map after the revision `base`. Throws HubConflict as SaveMap does.
  std::int64_t RemoveMap(const std::string& map, std::int64_t base);
  // Removes the map `old` and saves another one, which may have its name, in one change: both or neither.
  // Otherwise as SaveMap. Throws HubRemovalRefused if the hub keeps `old`.
  std::int64_t ReplaceMap(const HubHead& old, const std::string& map, std::int64_t base,
                          const MapFacts& facts, const Manifest& manifest);
  // Puts a map back to an earlier revision, as a new one, which is returned.
  std::int64_t RevertMap(const std::string& map, std::int64_t base, std::int64_t to);

  // All tours by name, removed ones included.
  std::vector<HubTour> Tours();
  // Saves or removes a tour after the revision `base`, 0 for a new one. Throws HubConflict.
  void SaveTour(const HubTour& tour, std::int64_t base);

  // From now on, WaitForChange notices changes.
  void Listen() { connection_.Listen("docent_changes"); }
  // Waits until the hub was changed, at most this long. Returns whether it says so.
  bool WaitForChange(std::chrono::milliseconds longest) { return connection_.Wait(longest); }

 private:
  HubConnection connection_;
  std::string id_, restoration_;
  bool may_save_ = false;
};

}  // namespace docent::maps
