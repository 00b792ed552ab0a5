// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "maps/storage/byte_stream.h"

// One connection to the PostgreSQL database of a hub. Only hub_connection.cpp knows libpqxx. The server is
// not trusted: whoever reads its rows checks every value. Not thread-safe. Errors throw docent::Error with
// one sentence.
namespace docent::maps {

// Somebody else saved the map or tour first; read it again.
class HubConflict : public Error {
 public:
  using Error::Error;
};

// There is no connection, or it was lost. What was being written was written completely or not at all.
class HubUnreachable : public Error {
 public:
  using Error::Error;
};

// Checks the address of a hub and adds what a safe connection needs. A connection that leaves this machine
// must be encrypted. Passwords may not be part of an address, because others can see the command line; libpq
// finds them in ~/.pgpass, in a service file or in PGPASSWORD. Throws Error.
std::string CheckedHubAddress(const std::string& url);

// What a server stores instead of a password (SCRAM-SHA-256), so that the password itself never reaches it.
// Connects to the hub. Throws Error.
std::string VerifierOf(const std::string& url, const std::string& user, const std::string& password);

// The rows that a query returned. Rows and columns count from 0. Every function throws Error if the server
// sent something else than what is asked for.
class HubRows {
 public:
  class Impl;
  explicit HubRows(std::shared_ptr<const Impl> impl) : impl_(std::move(impl)) {}

  std::size_t size() const;                             // Number of rows.
  bool IsNull(std::size_t row, int column) const;       // Whether there is no value.
  std::string Text(std::size_t row, int column) const;  // UTF-8, as the server sent it.
  std::int64_t Integer(std::size_t row, int column) const;
  double Number(std::size_t row, int column) const;  // Always finite.
  bool Truth(std::size_t row, int column) const;
  Bytes Blob(std::size_t row, int column) const;

 private:
  std::shared_ptr<const Impl> impl_;
};

// A transaction that HubConnection::Transact runs.
class HubTransaction {
 public:
  class Impl;
  explicit HubTransaction(Impl* impl) : impl_(impl) {}

  // Runs one statement with these parameters, $1, $2 and so on. Texts never become part of the statement.
  HubRows Query(const std::string& sql, const std::vector<std::string>& parameters = {});
  // The same with bytes as the only parameter.
  HubRows QueryWithBytes(const std::string& sql, std::span<const std::uint8_t> bytes);
  // Runs several statements without parameters.
  void Execute(const std::string& script);

 private:
  Impl* impl_;
};

// What a transaction may do. One that reads sees a single state of the database.
enum class HubAccess { kRead, kWrite };

// A connection, which is open until it is destroyed or lost.
class HubConnection {
 public:
  // Connects. Throws HubUnreachable, or Error when the address is not allowed or the server refuses.
  explicit HubConnection(const std::string& url);
  ~HubConnection();
  HubConnection(const HubConnection&) = delete;
  HubConnection& operator=(const HubConnection&) = delete;

  // Runs `body` in one transaction and commits it; what throws rolls it back.
  void Transact(HubAccess access, const std::function<void(HubTransaction&)>& body);
  // Runs one statement outside of a transaction, as those that create databases must.
  void ExecuteAlone(const std::string& statement);
  // From now on, Wait notices what other connections send on this channel.
  void Listen(const std::string& channel);
  // Waits until something was sent, at most this long; returns whether something was. Throws HubUnreachable.
  bool Wait(std::chrono::milliseconds longest);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace docent::maps
