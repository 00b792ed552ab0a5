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

// A RAII wrapper for one SQLite connection. Opening a file never modifies it, statements and transactions are
// released automatically, and every failure throws docent::Error with a message that begins with the file's
// name. Not thread-safe: the owner must serialize access.
namespace docent::maps {

// A prepared statement. Parameters are numbered from 1 and columns from 0, as in SQLite.
class Statement {
 public:
  Statement(sqlite3* connection, const std::string& file, std::string_view sql);

  Statement& Bind(int parameter, std::int64_t value);
  Statement& Bind(int parameter, std::string_view text);
  // The bytes must stay valid until the statement has run.
  Statement& Bind(int parameter, std::span<const std::uint8_t> bytes);
  Statement& BindNull(int parameter);

  // Returns true when there is a row to read, and false at the end.
  bool Step();
  // Runs a statement that returns no rows.
  void Run();
  // Resets the statement, so that it can be bound and run again.
  void Reset();

  // These throw when the column has another type, which happens only in damaged files.
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
  // Opens the file for reading while another process may write. If the file has no write-ahead log, no file
  // is created beside it.
  static Database OpenReadOnly(const std::filesystem::path& path);
  // Opens a damaged file to read what is still readable. Missing pages do not prevent reading the others.
  static Database OpenDamaged(const std::filesystem::path& path);
  // Opens the file for writing. If it is missing and `create` is set, an empty file is created. The contents
  // are not modified before StartWriting, not even on close.
  static Database OpenReadWrite(const std::filesystem::path& path, bool create);
  Database(Database&&) = default;
  Database& operator=(Database&&) = delete;
  // A writing connection moves its log into the file unless another process is reading. The file then is
  // complete without the log and can be read from a read-only folder.
  ~Database();

  // Switches to the write-ahead log: readers can continue while a transaction is written, and committed data
  // survives a crash at any moment. Call it once the file is known to be a library.
  void StartWriting();
  // Call this before each use of a read-only connection. A file that had no log when it was opened is
  // reopened, because the connection could not notice that another process has started to write.
  void Refresh();

  Statement Prepare(std::string_view sql) const { return {connection_.get(), file_, sql}; }
  void Execute(const char* sql) const;
  // Returns the single number that a query yields.
  std::int64_t Number(std::string_view sql) const;

  // Returns false when the file ends within a page, which means that it is truncated. SQLite itself would
  // read the missing bytes as zeros. When there is a log, the last page may not have been written yet, so the
  // answer is true.
  bool EndsWithWholePage() const;
  // The size of the library in bytes, including its log and what a transaction has written so far.
  std::int64_t Bytes() const;

  // Copies the current state of the file, including the log, to a new file, which is on disk when this
  // returns. Must not be called inside a transaction.
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

  std::string file_;  // The path as the user gave it.
  bool read_only_;
  bool writing_ = false;
  bool immutable_ = false;
  std::unique_ptr<sqlite3, Closer> connection_;
};

// A transaction, which is rolled back unless it was committed.
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
