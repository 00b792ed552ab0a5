// SPDX-License-Identifier: Apache-2.0
#include "app/files/write_confinement.h"

#include <fcntl.h>
#include <linux/landlock.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <system_error>

namespace docent::app {

namespace {

// Newer than the headers of Debian 12.
constexpr std::uint64_t kTruncate = std::uint64_t{1} << 14;  // LANDLOCK_ACCESS_FS_TRUNCATE, Linux 6.2

// All rights to write that the kernel knows; zero if it knows none.
std::uint64_t WritingRights() {
  const long version = syscall(SYS_landlock_create_ruleset, nullptr, 0, LANDLOCK_CREATE_RULESET_VERSION);
  if (version < 1) return 0;
  std::uint64_t rights = LANDLOCK_ACCESS_FS_WRITE_FILE | LANDLOCK_ACCESS_FS_REMOVE_DIR |
                         LANDLOCK_ACCESS_FS_REMOVE_FILE | LANDLOCK_ACCESS_FS_MAKE_CHAR |
                         LANDLOCK_ACCESS_FS_MAKE_DIR | LANDLOCK_ACCESS_FS_MAKE_REG |
                         LANDLOCK_ACCESS_FS_MAKE_SOCK | LANDLOCK_ACCESS_FS_MAKE_FIFO |
                         LANDLOCK_ACCESS_FS_MAKE_BLOCK | LANDLOCK_ACCESS_FS_MAKE_SYM;
  if (version >= 2) rights |= LANDLOCK_ACCESS_FS_REFER;
  if (version >= 3) rights |= kTruncate;
  return rights;
}

// A file descriptor that is closed at the end.
class Descriptor {
 public:
  explicit Descriptor(long number) : number_(static_cast<int>(number)) {}
  ~Descriptor() {
    if (number_ >= 0) close(number_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int number() const { return number_; }

 private:
  int number_;
};

// The value of an environment variable; empty if it is not set.
std::filesystem::path PathFrom(const char* variable) {
  const char* const value = std::getenv(variable);
  return value ? value : "";
}

}  // namespace

std::filesystem::path ExistingFolderOf(const std::filesystem::path& path) {
  std::error_code error;
  std::filesystem::path folder = std::filesystem::absolute(path, error);
  while (!std::filesystem::is_directory(folder, error) && folder.has_relative_path())
    folder = folder.parent_path();
  return folder;
}

bool ConfineWritesTo(std::span<const std::filesystem::path> folders) {
  const std::uint64_t rights = WritingRights();
  if (rights == 0) return false;
  landlock_ruleset_attr attributes{};
  attributes.handled_access_fs = rights;
  const Descriptor rules(syscall(SYS_landlock_create_ruleset, &attributes, sizeof(attributes), 0));
  if (rules.number() < 0) return false;
  for (const std::filesystem::path& folder : folders) {
    const Descriptor opened(open(folder.c_str(), O_PATH | O_CLOEXEC | O_DIRECTORY));
    if (opened.number() < 0) continue;
    landlock_path_beneath_attr rule{};
    rule.allowed_access = rights;
    rule.parent_fd = opened.number();
    if (syscall(SYS_landlock_add_rule, rules.number(), LANDLOCK_RULE_PATH_BENEATH, &rule, 0) != 0)
      return false;
  }
  return prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 &&
         syscall(SYS_landlock_restrict_self, rules.number(), 0) == 0;
}

std::vector<std::filesystem::path> SystemFolders() {
  std::vector<std::filesystem::path> folders = {"/dev", "/proc/self"};
  std::error_code error;
  const std::filesystem::path temporary = std::filesystem::temp_directory_path(error);
  if (!error) folders.push_back(temporary);
  folders.push_back(PathFrom("XDG_RUNTIME_DIR"));
  const std::filesystem::path cache = PathFrom("XDG_CACHE_HOME"), home = PathFrom("HOME");
  folders.push_back(cache.empty() ? home / ".cache" : cache);
  return folders;
}

}  // namespace docent::app
