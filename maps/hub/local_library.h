// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "maps/hub/map_facts.h"
#include "maps/library/library.h"
#include "maps/library/session_lock.h"
#include "maps/storage/database.h"
#include "maps/storage/library_identity.h"

namespace docent::maps {

// Somebody else changed the map in the library while it was being synchronized; try again.
class LocalChange : public Error {
 public:
  using Error::Error;
};

// The rows of a device's library, as a hub sends and receives them. Other programs may use the library at the
// same time: each function is one transaction. Not thread-safe. Errors throw docent::Error.
class LocalLibrary {
 public:
  // Opens a library for writing; creates it if that is asked for.
  LocalLibrary(const std::filesystem::path& path, CreateIfMissing create, SceneTools scenes);

  // The same library with its own verbs.
  Library& library() { return library_; }
  const Library& library() const { return library_; }
  // Tells this library from every other one, and from its older copies (library_identity.h).
  const LibraryIdentity& identity() const { return identity_; }
  // Gives it a new one, and returns that.
  const std::string& RenewIdentity();

  // Keeps authoring sessions away while maps that they may have in memory are replaced. Throws
  // LibraryInSession if there is one. Not to be held during a transfer, which may take long.
  SessionLock LockForReplacing() const { return {file_, SessionLockKind::kReplace}; }
  // Throws LibraryInSession if LockForReplacing would now, so that nothing is transferred in vain.
  void CheckNoSession() const { const SessionLock lock = LockForReplacing(); }
  // Throws LocalChange unless the stored map has this stamp, empty for none.
  void CheckStamp(std::uint64_t key, const std::string& stamp) const;

  // Changes whenever the map does: its entry, content, structure or mesh. Empty if there is no such map.
  std::string StampOf(std::uint64_t key) const;
  // The key that the next new map gets; no map has it or a higher one.
  std::uint64_t NextKey() const;
  // The whole map with its state. Its signposts lead to what `to_hub` gives. Throws if it is damaged.
  LocalMap Read(std::uint64_t key, const Retarget& to_hub) const;
  // Adds or replaces a map with bytes that are not trusted: the whole map is decoded and checked before
  // anything becomes visible. `map.facts.info` has the key and the name here, and the signposts lead to what
  // `to_local` gives. Returns the state of the written map. Throws LocalChange unless the stored map has this
  // stamp, empty for none.
  LocalState Write(const LocalMap& map, const Retarget& to_local, const std::string& stamp);
  // Removes a map whatever its policy, because the hub did so. Signposts to it stay, and lead nowhere.
  void Remove(std::uint64_t key, const std::string& stamp);

 private:
  void WriteItems(const LocalMap& map, const Retarget& to_local);
  // Whether the library has the structure of the map already.
  bool HasStructure(const LocalMap& map) const;

  std::filesystem::path file_;
  SceneTools scenes_;
  Library library_;  // Opened first: it upgrades older formats.
  Database database_;
  LibraryIdentity identity_;
};

}  // namespace docent::maps
