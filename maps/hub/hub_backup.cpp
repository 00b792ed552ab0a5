// SPDX-License-Identifier: Apache-2.0
#include "maps/hub/hub_backup.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>

#include "maps/hub/administration.h"
#include "maps/hub/hub_connection.h"

extern char** environ;

namespace docent::maps {

namespace {

// Runs a program of PostgreSQL and returns what it says on standard error; empty if it succeeds.
std::string RunPostgresProgram(std::vector<std::string> command) {
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) throw Error(command.front() + " cannot be started");
  std::vector<char*> arguments;
  for (std::string& argument : command) arguments.push_back(argument.data());
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, ends[1], STDERR_FILENO);
  pid_t child = 0;
  const int spawned = posix_spawnp(&child, arguments[0], &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  close(ends[1]);
  std::string said;
  std::array<char, 4096> part{};
  for (ssize_t size = 0; spawned == 0 && (size = read(ends[0], part.data(), part.size())) > 0;)
    said.append(part.data(), static_cast<std::size_t>(size));
  close(ends[0]);
  if (spawned != 0) throw Error(command.front() + " cannot be started; install postgresql-client");
  int status = 0;
  waitpid(child, &status, 0);
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return "";
  std::replace(said.begin(), said.end(), '\n', ' ');
  return said.empty() ? command.front() + " was ended" : said;
}

// Whether somebody has saved something on the hub in this database.
bool IsInUse(const std::string& url) {
  HubConnection connection(url);
  bool is_used = false;
  connection.Transact(HubAccess::kRead, [&](HubTransaction& work) {
    const HubRows rows = work.Query(
        "SELECT FROM docent.maps UNION ALL SELECT FROM docent.tours UNION ALL SELECT FROM docent.visits "
        "LIMIT 1");
    is_used = rows.size() > 0;
  });
  return is_used;
}

// Notes that the hub was restored and what it has, see HubRestoration. Only a restored hub has the column, so
// that programs and hubs without it need no new version of the tables.
void NoteRestoration(const std::string& url) {
  HubConnection connection(url);
  connection.Transact(HubAccess::kWrite, [](HubTransaction& work) {
    work.Execute(
        "ALTER TABLE docent.hub ADD COLUMN IF NOT EXISTS restorations jsonb NOT NULL DEFAULT '[]';"
        "UPDATE docent.hub SET restorations = restorations || jsonb_build_array(jsonb_build_object("
        "'id', gen_random_uuid(), "
        "'maps', (SELECT coalesce(jsonb_object_agg(m.id, m.revision), '{}') FROM docent.maps m), "
        "'tours', (SELECT coalesce(jsonb_object_agg(t.name, t.revision), '{}') FROM docent.tours t)))");
  });
}

}  // namespace

void BackUpHub(const std::string& url, const std::filesystem::path& file) {
  const std::string address = CheckedHubAddress(url);
  std::error_code error;
  if (std::filesystem::exists(file, error))
    throw Error(file.string() + " exists already; choose a new file name");
  std::filesystem::path unfinished = file;
  unfinished += ".part";
  // The images in it are not for everybody on this machine.
  const mode_t before = umask(0077);
  const std::string problem = RunPostgresProgram({"pg_dump", "--format=custom", "--schema=docent",
                                                  "--file=" + unfinished.string(), "--dbname=" + address});
  umask(before);
  if (!problem.empty()) {
    std::filesystem::remove(unfinished, error);
    throw Error("the hub cannot be saved to a file: " + problem);
  }
  std::filesystem::rename(unfinished, file);
}

std::vector<std::string> RestoreHub(const std::string& url, const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) throw Error(file.string() + " does not exist");
  // It makes the database and the roles, to which the backup refers.
  InitHub(url);
  if (IsInUse(url))
    throw Error(
        "the database has a hub with maps, tours or records of visits; restore the backup into another "
        "database");
  HubConnection(url).ExecuteAlone("DROP SCHEMA docent CASCADE");
  const std::string problem =
      RunPostgresProgram({"pg_restore", "--single-transaction", "--exit-on-error", "--no-owner",
                          "--dbname=" + CheckedHubAddress(url), file.string()});
  if (!problem.empty())
    throw Error("the backup cannot be restored, and the database has no hub now: " + problem);
  NoteRestoration(url);
  InitHub(url);  // Upgrades a backup of an older version.
  std::vector<std::string> unknown;
  HubConnection connection(url);
  connection.Transact(HubAccess::kWrite, [&](HubTransaction& work) {
    const HubRows rows = work.Query(
        "DELETE FROM docent.users WHERE name NOT IN (SELECT rolname FROM pg_roles) RETURNING name");
    for (std::size_t i = 0; i < rows.size(); ++i) unknown.push_back(rows.Text(i, 0));
  });
  std::sort(unknown.begin(), unknown.end());
  return unknown;
}

}  // namespace docent::maps
