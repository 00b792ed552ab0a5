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

// Returns the locked file, or -1 if the other kind holds it.
int TryLock(const std::filesystem::path& path, SessionLockKind kind) {
  while (true) {
    const int file = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0666);
    if (file < 0)
      throw Error(path.string() + " cannot be created: " + std::generic_category().message(errno));
    const int operation = kind == SessionLockKind::kSession ? LOCK_SH : LOCK_EX;
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

// Whether those who hold the lock share it, and are therefore sessions.
bool IsShared(const std::filesystem::path& path) {
  const int file = TryLock(path, SessionLockKind::kSession);
  if (file >= 0) close(file);
  return file >= 0;
}

}  // namespace

SessionLock::SessionLock(const std::filesystem::path& library, SessionLockKind kind)
    : path_(library.string() + ".session") {
  const auto end = std::chrono::steady_clock::now() + kLongestWait;
  int shared = 0;
  while ((file_ = TryLock(path_, kind)) < 0) {
    if (kind == SessionLockKind::kReplace && IsShared(path_) && ++shared == kAttemptsBesideSessions)
      throw LibraryInSession(library.string() +
                             " is open in docent author, which could save its maps over the change; do it "
                             "again when that session has ended");
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
