// SPDX-License-Identifier: Apache-2.0
#include "tests/hub/private_server.h"

#include <fcntl.h>
#include <grp.h>
#include <pwd.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <pqxx/pqxx>
#include <sstream>

#include "engine/base/error.h"
#include "maps/hub/administration.h"
#include "tests/support/wait_until.h"

namespace docent::maps {

namespace {

namespace fs = std::filesystem;

constexpr const char* kPrograms = "/usr/lib/postgresql/15/bin/";

// Who runs the server: whoever runs the tests, or else this user.
const passwd* ServerUser() {
  if (geteuid() != 0) return nullptr;
  const passwd* user = getpwnam("nobody");  // NOLINT(concurrency-mt-unsafe): before there are threads.
  if (user == nullptr) throw Error("there is no user 'nobody' who could run PostgreSQL");
  return user;
}

}  // namespace

PrivateServer::PrivateServer() {
  if (!fs::exists(fs::path(kPrograms) / "initdb")) throw Error("PostgreSQL 15 is not installed");
  std::string pattern = (fs::temp_directory_path() / "docent-hub-XXXXXX").string();
  if (mkdtemp(pattern.data()) == nullptr) throw Error("no temporary folder can be made");
  folder_ = pattern;
  if (const passwd* user = ServerUser();
      user != nullptr && chown(folder_.c_str(), user->pw_uid, user->pw_gid) != 0)
    throw Error("the temporary folder cannot be given to another user");
  if (Run({"initdb", "-D", (folder_ / "data").string(), "-A", "trust", "-U", "postgres", "--no-sync", "-E",
           "UTF8", "--locale=C"}) != 0)
    throw Error("initdb failed: " + Log());
  Start();
}

PrivateServer::~PrivateServer() {
  if (folder_.empty()) return;
  Run({"pg_ctl", "-D", (folder_ / "data").string(), "-m", "immediate", "-w", "stop"});
  std::error_code error;
  fs::remove_all(folder_, error);
}

void PrivateServer::Start() {
  // Without fsync it is fast, and still survives when its processes are killed, as nothing else fails here.
  const std::string options =
      "-k " + folder_.string() + " -c listen_addresses='' -c fsync=off -c shared_buffers=32MB";
  if (Run({"pg_ctl", "-D", (folder_ / "data").string(), "-o", options, "-l", (folder_ / "log").string(), "-w",
           "-t", "180", "start"}) != 0)
    throw Error("PostgreSQL cannot be started: " + Log());
}

void PrivateServer::Stop() {
  Run({"pg_ctl", "-D", (folder_ / "data").string(), "-m", "fast", "-w", "stop"});
}

void PrivateServer::Kill() {
  pid_t postmaster = 0;
  std::ifstream(folder_ / "data" / "postmaster.pid") >> postmaster;
  if (postmaster <= 1) throw Error("the server has no process");
  kill(postmaster, SIGKILL);
}

void PrivateServer::Restart() {
  // The children of a killed server end by themselves once they notice; until then another one refuses to
  // start.
  const auto has_started = [this] {
    try {
      Start();
      return true;
    } catch (const Error&) {
      return false;
    }
  };
  if (!WaitUntil(has_started)) throw Error("the server does not start after it was killed: " + Log());
}

std::string PrivateServer::Url(const std::string& database, const std::string& user) const {
  std::string host;
  for (const char c : folder_.string()) host += c == '/' ? std::string("%2F") : std::string(1, c);
  return "postgresql://" + user + "@" + host + "/" + database;
}

int PrivateServer::Run(const std::vector<std::string>& command) const {
  const passwd* user = ServerUser();
  const pid_t child = fork();
  if (child == 0) {
    if (user != nullptr &&
        (setgroups(0, nullptr) != 0 || setgid(user->pw_gid) != 0 || setuid(user->pw_uid) != 0))
      _exit(126);
    const int log = open((folder_ / "output").c_str(), O_WRONLY | O_CREAT | O_APPEND, 0600);
    dup2(log, STDOUT_FILENO);
    dup2(log, STDERR_FILENO);
    if (chdir(folder_.c_str()) != 0) _exit(126);
    const std::string program = kPrograms + command.front();
    std::vector<char*> arguments;
    for (const std::string& argument : command) arguments.push_back(const_cast<char*>(argument.c_str()));
    arguments.push_back(nullptr);
    execv(program.c_str(), arguments.data());
    _exit(127);
  }
  int status = -1;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128;
}

std::string PrivateServer::Log() const {
  std::ostringstream text;
  for (const char* name : {"output", "log"}) text << std::ifstream(folder_ / name).rdbuf();
  return text.str();
}

std::string RunHubSql(const std::string& url, const std::string& sql) {
  try {
    pqxx::connection connection(url);
    pqxx::work work(connection);
    const pqxx::result rows = work.exec(sql);
    work.commit();
    return rows.empty() || rows[0].size() == 0 || rows[0][0].is_null() ? "" : rows[0][0].c_str();
  } catch (const pqxx::failure& error) {
    throw Error(error.what());
  }
}

void RunHubSqlAlone(const std::string& url, const std::string& sql) {
  try {
    pqxx::connection connection(url);
    pqxx::nontransaction work(connection);
    work.exec(sql);
  } catch (const pqxx::failure& error) {
    throw Error(error.what());
  }
}

std::string ErrorOfHubSql(const std::string& url, const std::string& sql) {
  try {
    RunHubSql(url, sql);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

std::unique_ptr<PrivateServer> WithHubServer::server_;
std::string WithHubServer::problem_;

void WithHubServer::SetUpTestSuite() {
  try {
    server_ = std::make_unique<PrivateServer>();
  } catch (const Error& error) {
    problem_ = error.what();
  }
}

void WithHubServer::TearDownTestSuite() {
  server_.reset();
}

void WithHubServer::SetUp() {
  if (!server_) GTEST_SKIP() << "no PostgreSQL server can be started: " << problem_;
  static int count = 0;
  database_ = "hub" + std::to_string(++count);
  ASSERT_TRUE(InitHub(Url()).created_database);
}

std::string WithHubServer::AddUser(const std::string& word, const std::string& role) const {
  const std::string name = word + "-" + database_;
  AddHubUser(Url(), name, role, std::nullopt);
  return name;
}

}  // namespace docent::maps
