// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/hub_command.h"

#include <signal.h>
#include <termios.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <array>
#include <atomic>
#include <cerrno>
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

// What the handler of signals needs while a NoEcho exists.
termios g_shown_terminal, g_hidden_terminal;
std::atomic<bool> g_hides_typed = false;
std::atomic<const std::string*> g_prompt = nullptr;  // Null unless an answer is awaited.
static_assert(std::atomic<const std::string*>::is_always_lock_free,
              "a signal handler may only use lock-free atomics");

// In the handler of a signal that ends or stops the program: the terminal shows what is typed before. After a
// stop it hides again, and the question is asked anew, since what was typed of the answer is lost.
void OnEndOrStop(int signal) {
  const int error = errno;
  // In the background, others use the terminal. One that does not control the program has no foreground.
  const pid_t foreground = tcgetpgrp(STDIN_FILENO);
  if (foreground < 0 || foreground == getpgrp()) tcsetattr(STDIN_FILENO, TCSAFLUSH, &g_shown_terminal);
  struct sigaction usual {};
  struct sigaction present {};
  usual.sa_handler = SIG_DFL;
  sigaction(signal, &usual, &present);
  sigset_t only, blocked;
  sigemptyset(&only);
  sigaddset(&only, signal);
  raise(signal);
  pthread_sigmask(SIG_UNBLOCK, &only, &blocked);  // Here the signal ends or stops the program.
  pthread_sigmask(SIG_SETMASK, &blocked, nullptr);
  sigaction(signal, &present, nullptr);
  // In the background, this stops the program until it is in the foreground again.
  if (g_hides_typed) tcsetattr(STDIN_FILENO, TCSAFLUSH, &g_hidden_terminal);
  if (const std::string* const prompt = g_prompt) {
    const auto ignored = write(STDERR_FILENO, prompt->data(), prompt->size());
    static_cast<void>(ignored);
  }
  errno = error;
}

// Hides what is typed while it exists, but not while the program is stopped or after a signal has ended it.
// The key that interrupts the program is a character then, which ends the question. One instance at a time.
class NoEcho {
 public:
  NoEcho() : is_terminal_(tcgetattr(STDIN_FILENO, &before_) == 0) {
    if (!is_terminal_) return;
    g_shown_terminal = g_hidden_terminal = before_;
    g_hidden_terminal.c_lflag &= ~static_cast<tcflag_t>(ECHO);
    g_hidden_terminal.c_cc[VEOL] = before_.c_cc[VINTR];  // It ends the line, so that it is read at once.
    g_hidden_terminal.c_cc[VINTR] = _POSIX_VDISABLE;
    struct sigaction handled {};
    handled.sa_handler = OnEndOrStop;
    handled.sa_flags = SA_RESTART;
    sigemptyset(&handled.sa_mask);
    for (std::size_t i = 0; i < kSignals.size(); ++i) {
      sigaction(kSignals[i], nullptr, &actions_before_[i]);
      if (actions_before_[i].sa_handler != SIG_IGN) sigaction(kSignals[i], &handled, nullptr);
    }
    g_hides_typed = true;
    tcsetattr(STDIN_FILENO, TCSAFLUSH, &g_hidden_terminal);
  }
  ~NoEcho() {
    if (!is_terminal_) return;
    g_hides_typed = false;
    tcsetattr(STDIN_FILENO, TCSAFLUSH, &before_);
    for (std::size_t i = 0; i < kSignals.size(); ++i) sigaction(kSignals[i], &actions_before_[i], nullptr);
  }
  NoEcho(const NoEcho&) = delete;
  NoEcho& operator=(const NoEcho&) = delete;
  bool is_terminal() const { return is_terminal_; }
  // Whether the character is that key.
  bool Interrupts(char c) const { return is_terminal_ && static_cast<cc_t>(c) == before_.c_cc[VINTR]; }

 private:
  static constexpr std::array kSignals = {SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGTSTP};

  termios before_{};
  bool is_terminal_;
  std::array<struct sigaction, kSignals.size()> actions_before_{};
};

std::string AskedLine(const std::string& question, const NoEcho& hidden) {
  const std::string prompt = question + ": ";
  g_prompt = &prompt;  // Before it is shown: a signal may come at once.
  if (hidden.is_terminal()) std::fputs(prompt.c_str(), stderr);
  std::string line;
  bool is_interrupted = false;
  for (int c = 0; !is_interrupted && (c = std::fgetc(stdin)) != EOF && c != '\n';) {
    line += static_cast<char>(c);
    is_interrupted = hidden.Interrupts(line.back());
  }
  g_prompt = nullptr;
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
