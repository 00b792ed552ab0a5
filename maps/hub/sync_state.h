// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "maps/storage/byte_stream.h"
#include "maps/storage/database.h"

// What a device knows of its hub: the file NAME.docent.hub beside the library, an SQLite database. It is
// written after the library, so that a crash between the two leaves an older state here; then the next
// synchronization finds that library and hub agree already. It says which
// library the links were made for, because another one may later have this name, and under which restoration
// of the hub, because the numbers of revisions mean other states after one. Not thread-safe. Errors throw
// docent::Error.
namespace docent::maps {

// A map of the library on the hub, and what it was when both last agreed.
struct MapLink {
  std::uint64_t key = 0;      // In the library.
  std::string id;             // On the hub.
  std::int64_t revision = 0;  // On the hub; 0 if the map was never there.
  std::string stamp;          // LocalLibrary::StampOf.
  std::string structure;      // StructureDigest.
  std::string scene_hash;     // Of the text of the scene in the library.
  std::string scene;          // Its text on the hub: the common ancestor when both sides change it.
  std::string name;           // On the hub.
  std::string local_name;     // In the library, where another map may have had the name.
  std::string policy;         // As in policy.h.
  std::int64_t created = 0;   // MapInfo::created, ns; 0 if not known. Counts only without LibraryIdentity.
  std::string restoration;    // Hub::restoration at that time.
};

// A tour of the library on the hub, and what it was when both last agreed.
struct TourLink {
  std::string name;           // On both.
  std::int64_t revision = 0;  // On the hub.
  std::string content;        // Language, minutes and stops as one text; empty if it was removed.
  std::string restoration;    // As MapLink::restoration.
};

// The open file.
class SyncState {
 public:
  // Opens the file beside a library, or creates it. Throws if it is damaged or belongs to another hub.
  SyncState(const std::filesystem::path& library, const std::string& hub_id);

  std::vector<MapLink> Links() const;  // By key.
  // Adds or replaces the link of a map.
  void Put(const MapLink& link);
  // Adds links to those of these maps of the hub that have none, with keys that `reserve` returns the first
  // of, and returns all links. Two programs do so one after the other, so that a map has one key only.
  std::vector<MapLink> AddLinks(const std::vector<std::string>& ids,
                                const std::function<std::uint64_t(std::size_t count)>& reserve);
  void RemoveLink(std::uint64_t key);

  std::vector<TourLink> Tours() const;  // By name.
  void Put(const TourLink& tour);
  void RemoveTour(const std::string& name);

  // The identity of the library for which the links were made (library_identity.h); empty if an older program
  // made them.
  std::string LibraryIdentity() const;
  void SetLibraryIdentity(const std::string& identity);
  // Sets the one that `renew` gives the library. Two programs do so one after the other. If it is interrupted
  // between the two files, this one has the previous identity of the library.
  void RenewLibraryIdentity(const std::function<std::string()>& renew);
  // Removes all links of maps and tours, and sets the identity of the library for the next ones.
  void StartAnew(const std::string& identity);

  // Bytes that were received for a map that is not complete yet, so that an interrupted transfer goes on.
  std::optional<Bytes> Received(const std::string& hash) const;
  void KeepReceived(const std::string& hash, const Bytes& bytes);
  void ForgetReceived();

 private:
  Database database_;
};

// The file beside this library.
std::filesystem::path SyncStatePath(const std::filesystem::path& library);

}  // namespace docent::maps
