// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/hub_command.h"

#include <termios.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "app/command_line/text_table.h"
#include "engine/base/error.h"
#include "maps/hub/administration.h"
#include "maps/hub/hub_backup.h"
#include "maps/hub/hub_visits.h"

namespace docent::app {

namespace {

using Json = nlohmann::ordered_json;

struct HubOptions {
  std::string hub;
  std::string name, role;
  std::filesystem::path file;
  std::int64_t revision = 0;
  int changes = 10;
  bool with_password = false, as_json = false;
  Verbosity verbosity = Verbosity::kNormal;
};
using HubAction = void (*)(const HubOptions& options);

// Hides what is typed while it exists. Keys that interrupt, end or suspend the program are characters then,
// or the terminal would go on hiding.
class NoEcho {
 public:
  NoEcho() : is_terminal_(tcgetattr(STDIN_FILENO, &before_) == 0) {
    termios hidden = before_;
    hidden.c_lflag &= ~static_cast<tcflag_t>(ECHO | ISIG);
    hidden.c_cc[VEOL] = before_.c_cc[VINTR];  // It ends the line, so that it is read at once.
    if (is_terminal_) tcsetattr(STDIN_FILENO, TCSAFLUSH, &hidden);
  }
  ~NoEcho() {
    if (is_terminal_) tcsetattr(STDIN_FILENO, TCSAFLUSH, &before_);
  }
  NoEcho(const NoEcho&) = delete;
  NoEcho& operator=(const NoEcho&) = delete;
  bool is_terminal() const { return is_terminal_; }
  // Whether the character is one of those keys.
  bool Interrupts(char c) const {
    const auto key = static_cast<cc_t>(c);
    return is_terminal_ &&
           (key == before_.c_cc[VINTR] || key == before_.c_cc[VQUIT] || key == before_.c_cc[VSUSP]);
  }

 private:
  termios before_{};
  bool is_terminal_;
};

std::string AskedLine(const std::string& question, const NoEcho& hidden) {
  if (hidden.is_terminal()) std::fprintf(stderr, "%s: ", question.c_str());
  std::string line;
  bool is_interrupted = false;
  for (int c = 0; !is_interrupted && (c = std::fgetc(stdin)) != EOF && c != '\n';) {
    line += static_cast<char>(c);
    is_interrupted = hidden.Interrupts(line.back());
  }
  if (hidden.is_terminal()) std::fputc('\n', stderr);
  if (is_interrupted) throw Error("Interrupted; the user was not added.");
  if (line.empty()) throw Error("No password was given on standard input; the user was not added.");
  return line;
}

// From the terminal, or the first line of standard input. It is never an argument, which others could read.
std::string ReadPassword(const std::string& user) {
  const NoEcho hidden;
  const std::string password = AskedLine("Password of " + user, hidden);
  if (hidden.is_terminal() && AskedLine("Once more", hidden) != password)
    throw Error("The two passwords differ; the user was not added.");
  return password;
}

void Init(const HubOptions& options) {
  const maps::HubInit init = maps::InitHub(options.hub);
  if (options.verbosity == Verbosity::kQuiet) return;
  if (init.version_before == init.version) {
    std::printf("The hub already exists, in version %d.\n", init.version);
  } else if (init.version_before == 0) {
    std::printf(
        "The hub is ready%s, in version %d. Add users next: docent hub user add NAME --role curator\n",
        init.created_database ? " in a new database" : "", init.version);
  } else {
    std::printf("The hub was upgraded from version %d to %d.\n", init.version_before, init.version);
  }
}

void Status(const HubOptions& options) {
  const maps::HubStatus status = maps::StatusOf(options.hub, options.changes);
  if (options.as_json) {
    Json json = {{"user", status.user},           {"role", status.role},
                 {"encrypted", status.encrypted}, {"version", status.version},
                 {"maps", status.maps},           {"tours", status.tours},
                 {"revisions", status.revisions}, {"kept_revisions", status.kept_revisions},
                 {"bytes", status.bytes},         {"changes", Json::array()}};
    for (const maps::HubChange& change : status.changes)
      json["changes"].push_back({{"change", change.change},
                                 {"when", change.when},
                                 {"who", change.who},
                                 {"what", change.what},
                                 {"subject", change.subject},
                                 {"revision", change.revision}});
    std::printf("%s\n", json.dump(2, ' ', false, Json::error_handler_t::replace).c_str());
    return;
  }
  std::printf("%-12s %s, %s; the connection is %sencrypted\n", "you are", status.user.c_str(),
              status.role.empty() ? "without a role" : status.role.c_str(), status.encrypted ? "" : "not ");
  std::printf("%-12s %lld maps in %lld revisions (%lld kept of each), %lld tours, %.1f MB; version %lld\n",
              "the hub has", static_cast<long long>(status.maps), static_cast<long long>(status.revisions),
              static_cast<long long>(status.kept_revisions), static_cast<long long>(status.tours),
              1e-6 * static_cast<double>(status.bytes), static_cast<long long>(status.version));
  std::vector<std::vector<std::string>> rows;
  for (const maps::HubChange& change : status.changes)
    rows.push_back({std::to_string(change.change), change.when, change.who, change.what, change.subject,
                    change.revision > 0 ? "revision " + std::to_string(change.revision) : ""});
  std::fputs(FormatColumns({{8, Alignment::kRight}, {22}, {16}, {16}, {24}, {}}, rows).c_str(), stdout);
}

void AddUser(const HubOptions& options) {
  std::optional<std::string> password;
  if (options.with_password) password = ReadPassword(options.name);
  maps::AddHubUser(options.hub, options.name, options.role, password);
}

void RemoveUser(const HubOptions& options) {
  maps::RemoveHubUser(options.hub, options.name);
}

void ListUsers(const HubOptions& options) {
  const std::vector<maps::HubUser> users = maps::ListHubUsers(options.hub);
  if (options.as_json) {
    Json json = {{"users", Json::array()}};
    for (const maps::HubUser& user : users)
      json["users"].push_back({{"name", user.name}, {"role", user.role}});
    std::printf("%s\n", json.dump(2, ' ', false, Json::error_handler_t::replace).c_str());
    return;
  }
  std::vector<std::vector<std::string>> rows;
  for (const maps::HubUser& user : users) rows.push_back({user.name, user.role});
  std::fputs(FormatColumns({{24}, {}}, rows).c_str(), stdout);
}

void Revert(const HubOptions& options) {
  const std::int64_t revision = maps::RevertHubMap(options.hub, options.name, options.revision);
  if (options.verbosity != Verbosity::kQuiet)
    std::printf("'%s' was put back to revision %lld and saved as revision %lld.\n", options.name.c_str(),
                static_cast<long long>(options.revision), static_cast<long long>(revision));
}

void Backup(const HubOptions& options) {
  maps::BackUpHub(options.hub, options.file);
}

void Restore(const HubOptions& options) {
  const std::vector<std::string> unknown = maps::RestoreHub(options.hub, options.file);
  if (options.verbosity == Verbosity::kQuiet) return;
  std::puts("The hub was restored from the backup.");
  for (const std::string& name : unknown)
    std::printf("This server has no user '%s'; add it again with docent hub user add\n", name.c_str());
}

void HandIn(const HubOptions& options) {
  const maps::HandedInVisits visits = maps::HandInVisits(options.hub, options.file);
  if (options.verbosity != Verbosity::kQuiet) std::printf("Records of visits handed in: %zu\n", visits.added);
  if (visits.skipped > 0)
    std::fprintf(stderr, "Warning: %zu lines in '%s' are not records of visits and were left out\n",
                 visits.skipped, options.file.c_str());
}

void Collect(const HubOptions& options) {
  const std::size_t added = maps::CollectVisits(options.hub, options.file);
  if (options.verbosity != Verbosity::kQuiet) std::printf("Records of visits added: %zu\n", added);
}

// Adds a subcommand that connects to a hub.
CLI::App* AddHubSubcommand(CLI::App* group, Invocation* invocation,
                           const std::shared_ptr<HubOptions>& options, const char* name,
                           const char* description, const char* example, HubAction action) {
  CLI::App* command = AddSubcommand(group, name, description, example);
  command->callback([=] {
    invocation->run = [=] {
      options->verbosity = invocation->verbosity;
      action(*options);
    };
  });
  return command;
}

void AddUserCommands(CLI::App* group, Invocation* invocation, const std::shared_ptr<HubOptions>& options) {
  CLI::App* users = AddSubcommand(group, "user", "Manage the users of a hub",
                                  "docent hub user list --hub postgresql://admin@museum.example/docent");
  users->require_subcommand(1);
  CLI::App* add = AddHubSubcommand(
      users, invocation, options, "add", "Add a user: visitor (a device), curator or admin",
      "docent hub user add anna --role curator --password --hub postgresql://admin@museum.example/docent",
      AddUser);
  AddHubOption(add, &options->hub)->required();
  add->add_option("NAME", options->name, "Name of the user")->required();
  add->add_option("--role", options->role, "visitor, curator or admin")
      ->required()
      ->check(CLI::IsMember({"visitor", "curator", "admin"}));
  add->add_flag("--password", options->with_password,
                "Ask for a password, or read it from the first line of standard input");
  CLI::App* remove = AddHubSubcommand(
      users, invocation, options, "remove", "Remove a user; what the user did stays in the log",
      "docent hub user remove anna --hub postgresql://admin@museum.example/docent", RemoveUser);
  AddHubOption(remove, &options->hub)->required();
  remove->add_option("NAME", options->name, "Name of the user")->required();
  CLI::App* list =
      AddHubSubcommand(users, invocation, options, "list", "List the users with their roles",
                       "docent hub user list --hub postgresql://admin@museum.example/docent", ListUsers);
  AddHubOption(list, &options->hub)->required();
  list->add_flag("--json", options->as_json, "Print JSON");
}

}  // namespace

CLI::Option* AddHubOption(CLI::App* command, std::string* hub) {
  return command
      ->add_option("--hub", *hub,
                   "Address of the hub, postgresql://user@host/database; DOCENT_HUB if not given")
      ->envname("DOCENT_HUB");
}

void AddHubCommand(CLI::App* program, Invocation* invocation) {
  CLI::App* group = AddSubcommand(program, "hub", "Manage a hub, through which devices share maps",
                                  "docent hub init postgresql:///docent");
  group->require_subcommand(1);
  const auto options = std::make_shared<HubOptions>();
  AddHubSubcommand(group, invocation, options, "init", "Make a hub of a PostgreSQL database, or upgrade it",
                   "docent hub init postgresql:///docent", Init)
      ->add_option("URL", options->hub, "Address of the database, which is created if it does not exist")
      ->required();
  CLI::App* status = AddHubSubcommand(
      group, invocation, options, "status", "Show who you are on a hub, what it has, and the last changes",
      "docent hub status --hub postgresql://anna@museum.example/docent", Status);
  AddHubOption(status, &options->hub)->required();
  status->add_option("--changes", options->changes, "Number of the newest changes to show (default 10)")
      ->check(CLI::Range(0, 100000));
  status->add_flag("--json", options->as_json, "Print JSON");
  CLI::App* revert =
      AddHubSubcommand(group, invocation, options, "revert", "Put a map back to an earlier revision",
                       "docent hub revert Kiosk 3 --hub postgresql://anna@museum.example/docent", Revert);
  AddHubOption(revert, &options->hub)->required();
  revert->add_option("MAP", options->name, "Name of the map")->required();
  revert->add_option("REVISION", options->revision, "The revision, which docent hub status lists")
      ->required()
      ->check(CLI::Range(std::int64_t{1}, std::int64_t{1} << 53));
  CLI::App* backup =
      AddHubSubcommand(group, invocation, options, "backup", "Save a hub to a file (with pg_dump)",
                       "docent hub backup museum.hub --hub postgresql:///docent", Backup);
  AddHubOption(backup, &options->hub)->required();
  backup->add_option("FILE", options->file, "The new file")->required();
  CLI::App* restore =
      AddHubSubcommand(group, invocation, options, "restore",
                       "Make a hub of a backup, in a database that has none (with pg_restore)",
                       "docent hub restore museum.hub --hub postgresql:///docent", Restore);
  AddHubOption(restore, &options->hub)->required();
  restore->add_option("FILE", options->file, "The file that docent hub backup has made")->required();
  CLI::App* hand_in =
      AddHubSubcommand(group, invocation, options, "hand-in",
                       "Hand in the records of visits that docent tour --log has written",
                       "docent hub hand-in visits --hub postgresql://kiosk@museum.example/docent", HandIn);
  AddHubOption(hand_in, &options->hub)->required();
  hand_in->add_option("DIR", options->file, "Folder of the records; they stay there, and are not added twice")
      ->required();
  CLI::App* collect = AddHubSubcommand(
      group, invocation, options, "collect", "Collect the records of visits, for docent report",
      "docent hub collect visits --hub postgresql://anna@museum.example/docent", Collect);
  AddHubOption(collect, &options->hub)->required();
  collect->add_option("DIR", options->file, "Folder to which records are added that are not there")
      ->required();
  AddUserCommands(group, invocation, options);
}

}  // namespace docent::app
