// SPDX-License-Identifier: Apache-2.0
#include "maps/library/session_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <system_error>
#include <thread>

namespace docent::maps {

namespace {

using namespace std::chrono_literals;
constexpr auto kLongestWait = 10s;  // Most replacements take a second or two.
constexpr auto kBetweenAttempts = 50ms;
// A session keeps its lock, while another process that wants to replace looks only for a moment.
constexpr int kAttemptsBesideSessions = 3;

// Whether the open file is still the one with this name: its last holder may have removed it.
bool IsStillAt(int file, const std::filesystem::path& path) {
  struct stat open_file {
  }, named{};
  return fstat(file, &open_file) == 0 && stat(path.c_str(), &named) == 0 &&
         open_file.st_ino == named.st_ino && open_file.st_dev == named.st_dev;
}

// Returns the locked file, or -1 if another holder is in the way. operation: LOCK_SH or LOCK_EX.
int TryLock(const std::filesystem::path& path, int operation) {
  while (true) {
    const int file = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0666);
    if (file < 0)
      throw Error(path.string() + " cannot be created: " + std::generic_category().message(errno));
    if (flock(file, operation | LOCK_NB) != 0) {
      const int error = errno;
      close(file);
      if (error == EWOULDBLOCK) return -1;
      throw Error(path.string() + " cannot be locked: " + std::generic_category().message(error));
    }
    if (IsStillAt(file, path)) return file;
    close(file);
  }
}

// Whether the lock is held in shared mode, and therefore by a session.
bool IsShared(const std::filesystem::path& path) {
  const int file = TryLock(path, LOCK_SH);
  if (file >= 0) close(file);
  return file >= 0;
}

int TryLockFor(SessionLockKind kind, const std::filesystem::path& path) {
  const int file = TryLock(path, LOCK_EX);
  if (file < 0 || kind == SessionLockKind::kReplace) return file;
  // Who may hold it exclusively is the only session, and shows with a shared lock that it is one. The system
  // may give the lock to another in between.
  if (flock(file, LOCK_SH | LOCK_NB) == 0 && IsStillAt(file, path)) return file;
  close(file);
  return -1;
}

}  // namespace

SessionLock::SessionLock(const std::filesystem::path& library, SessionLockKind kind)
    : path_(library.string() + ".session") {
  const auto end = std::chrono::steady_clock::now() + kLongestWait;
  int shared = 0;
  while ((file_ = TryLockFor(kind, path_)) < 0) {
    if (IsShared(path_) && ++shared == kAttemptsBesideSessions) {
      throw LibraryInSession(
          library.string() +
          (kind == SessionLockKind::kSession
               ? " is already open in docent author; end that session first, because two would "
                 "save over each other's maps"
               : " is open in docent author, which could save its maps over the change; do "
                 "it again when that session has ended"));
    }
    if (std::chrono::steady_clock::now() > end)
      throw Error(library.string() +
                  " is being changed by another command or from a hub; try again when that has ended");
    std::this_thread::sleep_for(kBetweenAttempts);
  }
}

SessionLock::~SessionLock() {
  // Only whoever holds it alone may remove it.
  if (flock(file_, LOCK_EX | LOCK_NB) == 0) unlink(path_.c_str());
  close(file_);
}

}  // namespace docent::maps
