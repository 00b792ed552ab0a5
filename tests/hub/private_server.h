// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>
#include <sys/types.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

// A PostgreSQL server of the tests' own: in a temporary folder, on a socket in it, by another user when the
// tests run as root, which PostgreSQL refuses. Nothing else on the machine is used or changed.
namespace docent::maps {

// A running server, which the destructor stops and removes.
class PrivateServer {
 public:
  // Throws docent::Error with the reason when there is no PostgreSQL 15 or it cannot be started.
  PrivateServer();
  ~PrivateServer();
  PrivateServer(const PrivateServer&) = delete;
  PrivateServer& operator=(const PrivateServer&) = delete;

  // The address of a database for this user; "postgres" may do everything.
  std::string Url(const std::string& database, const std::string& user = "postgres") const;
  // Ends the server at once, as a power cut does, and starts it again after that.
  void Kill();
  void Restart();
  // Stops and starts it in good order.
  void Stop();
  void Start();

 private:
  // Runs a program of PostgreSQL as the user of the server; returns its exit status.
  int Run(const std::vector<std::string>& command) const;
  std::string Log() const;

  std::filesystem::path folder_;
};

// A statement by hand, as somebody with psql would send it. Returns the first value; throws docent::Error
// with the server's message.
std::string RunHubSql(const std::string& url, const std::string& sql);
// The same outside of a transaction, as statements about databases need it.
void RunHubSqlAlone(const std::string& url, const std::string& sql);
// The message of that error; empty if there was none.
std::string ErrorOfHubSql(const std::string& url, const std::string& sql);

// The base of suites that need a server: one for all tests of the suite, and a new database for each.
class WithHubServer : public testing::Test {
 protected:
  static void SetUpTestSuite();
  static void TearDownTestSuite();
  void SetUp() override;

  static PrivateServer& server() { return *server_; }
  // The address of the hub of this test, which SetUp has made.
  std::string Url(const std::string& user = "postgres") const { return server_->Url(database_, user); }
  const std::string& Database() const { return database_; }
  // Adds a user with a role, whose name is this word with the number of the test.
  std::string AddUser(const std::string& word, const std::string& role) const;

 private:
  static std::unique_ptr<PrivateServer> server_;
  static std::string problem_;
  std::string database_;
};

}  // namespace docent::maps
