// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

struct sqlite3;
struct sqlite3_stmt;

// A thin owner of one SQLite connection: opening in a way that changes nothing by accident, statements and
// transactions that clean up after themselves, and every failure as a docent::Error whose sentence begins
// with the file's name. Not thread-safe: whoever owns a Database lets one thread at a time use it.
namespace docent::maps {

// A prepared statement. Parameters count from 1, columns from 0, as in SQLite.
class Statement {
 public:
  Statement(sqlite3* connection, const std::string& file, std::string_view sql);

  Statement& Bind(int parameter, std::int64_t value);
  Statement& Bind(int parameter, std::string_view text);
  // The bytes must live until the statement was run.
  Statement& Bind(int parameter, std::span<const std::uint8_t> bytes);
  Statement& BindNull(int parameter);

  // True when there is a row to read; false at the end.
  bool Step();
  // For a statement without rows.
  void Run();
  // Ready to be bound and run again.
  void Reset();

  // Each throws when the column holds another type, which only a damaged file does.
  std::int64_t Integer(int column) const;
  std::string Text(int column) const;
  // Valid until the next Step or Reset.
  std::span<const std::uint8_t> Blob(int column) const;
  bool IsNull(int column) const;

 private:
  struct Finalizer {
    void operator()(sqlite3_stmt* statement) const;
  };
  void Check(int result) const;
  void CheckType(int column, int type) const;

  sqlite3* connection_;
  std::string file_;
  std::unique_ptr<sqlite3_stmt, Finalizer> statement_;
};

class Database {
 public:
  // For reading while another process may write. The file is opened read only; where its log is at rest no
  // file appears beside it.
  static Database OpenReadOnly(const std::filesystem::path& path);
  // For reading what a damaged file still holds: pages that it should have and has not are no reason to give
  // up before the others were read.
  static Database OpenDamaged(const std::filesystem::path& path);
  // For writing; the file is created (empty) when `create` is set and it is missing. Nothing in it is changed
  // before StartWriting, not even on close.
  static Database OpenReadWrite(const std::filesystem::path& path, bool create);
  Database(Database&&) = default;
  Database& operator=(Database&&) = delete;
  // A connection that was writing moves its log into the file, if nobody else is reading, so that the file
  // alone holds everything and can be read from a folder that may not be written to.
  ~Database();

  // Switches to the write-ahead log: readers go on while a transaction is written, and what was committed
  // survives a crash at any moment. To be called once the file is known to be ours.
  void StartWriting();
  // Called before each use of a read-only connection. A file whose log was not there when it was opened is
  // opened again, because the connection could not see that another process writes now.
  void Refresh();

  Statement Prepare(std::string_view sql) const { return {connection_.get(), file_, sql}; }
  void Execute(const char* sql) const;
  // The single number that a query gives.
  std::int64_t Number(std::string_view sql) const;
  // Rows that the last statement changed.
  std::int64_t Changes() const;

  // False when the file ends within a page, as one that was cut off does. (With a log beside it the last page
  // may be on its way.) SQLite itself would take the missing bytes for zeros.
  bool EndsWithWholePage() const;
  // How much the file holds, its log included.
  std::int64_t Bytes() const;

  // Copies the whole file as it is now, log included, into a new one, which is on disk when this returns.
  // Not inside a transaction.
  void CopyTo(const std::filesystem::path& path) const;

  const std::string& file() const { return file_; }
  bool read_only() const { return read_only_; }

 private:
  struct Closer {
    void operator()(sqlite3* connection) const;
  };
  Database(std::string file, bool read_only) : file_(std::move(file)), read_only_(read_only) {}
  void OpenConnection(const std::string& name, int flags);
  void ConnectReadOnly();

  std::string file_;  // as the user named it
  bool read_only_;
  bool writing_ = false;
  bool immutable_ = false;
  std::unique_ptr<sqlite3, Closer> connection_;
};

// One transaction: everything or nothing. Rolls back unless it was committed.
class Transaction {
 public:
  enum class Kind { kRead, kWrite };
  Transaction(const Database& database, Kind kind);
  ~Transaction();
  Transaction(const Transaction&) = delete;
  Transaction& operator=(const Transaction&) = delete;
  void Commit();

 private:
  const Database& database_;
  bool open_ = true;
};

}  // namespace docent::maps
