// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "engine/base/error.h"

// An authoring session keeps maps in memory and saves them over what the library has, so that nothing else
// may replace maps of the library meanwhile, and no second session may begin. The file NAME.docent.session
// beside the library says so: a session has a shared lock on it, and whoever replaces maps an exclusive one.
// The system releases the lock when a process ends, however it ends, and the last holder removes the file.
namespace docent::maps {

// An authoring session has the library open, so that its maps cannot be replaced now.
class LibraryInSession : public Error {
 public:
  using Error::Error;
};

// Who holds the lock.
enum class SessionLockKind {
  kSession,  // An authoring session.
  kReplace,  // An exchange with a hub, or a command, while it replaces maps or their content.
};

// The lock, from its construction to its destruction. It may not be used by two threads at once.
class SessionLock {
 public:
  // Throws LibraryInSession if a session holds the lock. Waits up to ten seconds for a replacement to end,
  // and then throws docent::Error.
  SessionLock(const std::filesystem::path& library, SessionLockKind kind);
  ~SessionLock();
  SessionLock(const SessionLock&) = delete;
  SessionLock& operator=(const SessionLock&) = delete;

 private:
  std::filesystem::path path_;
  int file_ = -1;
};

}  // namespace docent::maps
