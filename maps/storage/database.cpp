// SPDX-License-Identifier: Apache-2.0
#include "maps/storage/database.h"

#include <sqlite3.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <system_error>
#include <utility>

#include "engine/base/error.h"

namespace docent::maps {

namespace {

namespace fs = std::filesystem;

constexpr int kBusyTimeoutMs = 5000;  // Another process's transaction takes milliseconds.
// Moving the log into the file on close is optional, so it is not worth a long wait.
constexpr int kCloseTimeoutMs = 200;
constexpr int kMaxValueBytes = 512 << 20;  // Limit for one blob or text.

// The system's error for the last failed call, if SQLite still has it, as " (File too large)".
std::string SystemReason(sqlite3* connection) {
  if (!connection) return "";
  int number = sqlite3_system_errno(connection);
  // A failed commit leaves the error only with the file or journal.
  for (const int which : {SQLITE_FCNTL_JOURNAL_POINTER, SQLITE_FCNTL_FILE_POINTER}) {
    sqlite3_file* file = nullptr;
    if (number == 0 && sqlite3_file_control(connection, "main", which, &file) == SQLITE_OK && file &&
        file->pMethods) {
      file->pMethods->xFileControl(file, SQLITE_FCNTL_LAST_ERRNO, &number);
    }
  }
  return number == 0 ? "" : " (" + std::generic_category().message(number) + ")";
}

std::string Reason(sqlite3* connection, int result) {
  switch (result & 0xFF) {
    case SQLITE_NOTADB:
      return "is not a library of maps (it is not an SQLite file)";
    case SQLITE_CORRUPT:
      return "is damaged (" + std::string(sqlite3_errmsg(connection)) +
             "); use docent maps recover to save what is still readable";
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return "is being written by another program; try again when that program has ended";
    case SQLITE_READONLY:
      if (result == SQLITE_READONLY_ROLLBACK || result == SQLITE_READONLY_RECOVERY) {
        return "was left incomplete by a program that was killed; open it once for writing to "
               "repair it";
      }
      return "is not writable";
    case SQLITE_FULL:
      return "cannot be saved because the disk is full";
    case SQLITE_CANTOPEN:
      return "cannot be opened";
    case SQLITE_IOERR:
      return "cannot be read or written" + SystemReason(connection);
    case SQLITE_TOOBIG:
      return "cannot hold an image, model or table above " + std::to_string(kMaxValueBytes >> 20) + " MiB";
    default:
      return "cannot be used (" +
             std::string(connection ? sqlite3_errmsg(connection) : sqlite3_errstr(result)) + ")";
  }
}

[[noreturn]] void Fail(const std::string& file, sqlite3* connection, int result) {
  throw Error(file + " " + Reason(connection, result));
}

fs::path Beside(const fs::path& path, const char* suffix) {
  fs::path result = path;
  result += suffix;
  return result;
}

void CheckIsFile(const fs::path& path, const std::string& file) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (status.type() == fs::file_type::not_found) throw Error(file + " does not exist");
  if (status.type() == fs::file_type::directory) throw Error(file + " is a folder, not a library of maps");
  if (status.type() != fs::file_type::regular)
    throw Error(file + " cannot be opened: it is not a plain file");
}

// A "file:" URI of an absolute path (RFC 3986: everything except unreserved characters and slashes is
// escaped).
std::string Uri(const fs::path& path, const char* query) {
  constexpr std::string_view kHex = "0123456789ABCDEF";
  constexpr std::string_view kPlain = "-._~/";
  std::string uri = "file:";
  for (const char character : path.string()) {
    const auto byte = static_cast<unsigned char>(character);
    const bool alphanumeric =
        (byte >= '0' && byte <= '9') || (byte >= 'A' && byte <= 'Z') || (byte >= 'a' && byte <= 'z');
    if (alphanumeric || kPlain.find(character) != std::string_view::npos) {
      uri += character;
    } else {
      uri += {'%', kHex[byte >> 4], kHex[byte & 15]};
    }
  }
  return uri + query;
}

// SQLite's own file descriptor. All checks use this one, because closing a second descriptor would release
// this process's locks on the file.
sqlite3_file* OpenFile(sqlite3* connection) {
  sqlite3_file* file = nullptr;
  if (sqlite3_file_control(connection, "main", SQLITE_FCNTL_FILE_POINTER, &file) != SQLITE_OK) return nullptr;
  return file && file->pMethods ? file : nullptr;
}

// Whether the file's header says that it uses a write-ahead log (file format, offset 19).
bool UsesWriteAheadLog(sqlite3* connection) {
  sqlite3_file* const file = OpenFile(connection);
  if (!file) return false;
  std::array<unsigned char, 20> header{};
  if (file->pMethods->xRead(file, header.data(), static_cast<int>(header.size()), 0) != SQLITE_OK)
    return false;
  return header[19] == 2;
}

// Whether the file is smaller than the page size in its header (file format, offset 16), for which SQLite
// would allocate memory. A new file is empty and therefore valid.
bool IsSmallerThanOnePage(sqlite3* connection) {
  sqlite3_file* const file = OpenFile(connection);
  sqlite3_int64 size = 0;
  std::array<unsigned char, 18> header{};
  if (!file || file->pMethods->xFileSize(file, &size) != SQLITE_OK || size == 0) return false;
  if (file->pMethods->xRead(file, header.data(), static_cast<int>(header.size()), 0) != SQLITE_OK)
    return false;
  const int page = header[16] << 8 | header[17];
  return std::memcmp(header.data(), "SQLite format 3", 16) == 0 && size < (page == 1 ? 65536 : page);
}

// Whether there is no active log beside the file: a process that writes keeps both -wal and -shm there.
bool HasNoActiveLog(const fs::path& path) {
  std::error_code error;
  if (fs::exists(Beside(path, "-shm"), error)) return false;
  const fs::path log = Beside(path, "-wal");
  return !fs::exists(log, error) || fs::file_size(log, error) == 0;
}

}  // namespace

Statement::Statement(sqlite3* connection, const std::string& file, std::string_view sql)
    : connection_(connection), file_(file) {
  sqlite3_stmt* statement = nullptr;
  const int result =
      sqlite3_prepare_v2(connection, sql.data(), static_cast<int>(sql.size()), &statement, nullptr);
  statement_.reset(statement);
  Check(result);
}

void Statement::Finalizer::operator()(sqlite3_stmt* statement) const {
  sqlite3_finalize(statement);
}

void Statement::Check(int result) const {
  if (result != SQLITE_OK) Fail(file_, connection_, sqlite3_extended_errcode(connection_));
}

Statement& Statement::Bind(int parameter, std::int64_t value) {
  Check(sqlite3_bind_int64(statement_.get(), parameter, value));
  return *this;
}

Statement& Statement::Bind(int parameter, std::string_view text) {
  Check(sqlite3_bind_text64(statement_.get(), parameter, text.data() ? text.data() : "", text.size(),
                            SQLITE_TRANSIENT, SQLITE_UTF8));
  return *this;
}

Statement& Statement::Bind(int parameter, std::span<const std::uint8_t> bytes) {
  static constexpr std::uint8_t kNothing = 0;  // Binding a null pointer would store NULL.
  Check(sqlite3_bind_blob64(statement_.get(), parameter, bytes.empty() ? &kNothing : bytes.data(),
                            bytes.size(), SQLITE_STATIC));
  return *this;
}

Statement& Statement::BindNull(int parameter) {
  Check(sqlite3_bind_null(statement_.get(), parameter));
  return *this;
}

bool Statement::Step() {
  const int result = sqlite3_step(statement_.get());
  if (result == SQLITE_ROW) return true;
  if (result != SQLITE_DONE) Fail(file_, connection_, sqlite3_extended_errcode(connection_));
  return false;
}

void Statement::Run() {
  while (Step()) continue;
}

void Statement::Reset() {
  sqlite3_reset(statement_.get());
  sqlite3_clear_bindings(statement_.get());
}

void Statement::CheckType(int column, int type) const {
  if (sqlite3_column_type(statement_.get(), column) == type) return;
  const char* name = sqlite3_column_name(statement_.get(), column);
  throw Error(file_ + " is damaged: a value of column '" + (name ? name : "?") + "' has the wrong type");
}

std::int64_t Statement::Integer(int column) const {
  CheckType(column, SQLITE_INTEGER);
  return sqlite3_column_int64(statement_.get(), column);
}

std::string Statement::Text(int column) const {
  CheckType(column, SQLITE_TEXT);
  const unsigned char* text = sqlite3_column_text(statement_.get(), column);
  if (!text) Fail(file_, connection_, SQLITE_NOMEM);
  const int size = sqlite3_column_bytes(statement_.get(), column);
  return {reinterpret_cast<const char*>(text), static_cast<std::size_t>(size)};
}

std::span<const std::uint8_t> Statement::Blob(int column) const {
  CheckType(column, SQLITE_BLOB);
  const void* bytes = sqlite3_column_blob(statement_.get(), column);
  const int size = sqlite3_column_bytes(statement_.get(), column);
  if (!bytes) {
    // An overflow page that cannot be read is reported here and not by a failed step.
    const int code = sqlite3_extended_errcode(connection_);
    if (size > 0 || (code != SQLITE_OK && code != SQLITE_ROW)) Fail(file_, connection_, code);
    return {};
  }
  return {static_cast<const std::uint8_t*>(bytes), static_cast<std::size_t>(size)};
}

bool Statement::IsNull(int column) const {
  return sqlite3_column_type(statement_.get(), column) == SQLITE_NULL;
}

void Database::Closer::operator()(sqlite3* connection) const {
  sqlite3_close_v2(connection);
}

void Database::OpenConnection(const std::string& name, int flags) {
  // Otherwise SQLite would first allocate memory for twenty pages of the size that the file's header gives.
  static const int configured = sqlite3_config(SQLITE_CONFIG_PAGECACHE, nullptr, 0, 0);
  static_cast<void>(configured);
  sqlite3* connection = nullptr;
  const int result = sqlite3_open_v2(name.c_str(), &connection,
                                     flags | SQLITE_OPEN_FULLMUTEX | SQLITE_OPEN_EXRESCODE, nullptr);
  connection_.reset(connection);
  if (result != SQLITE_OK) Fail(file_, connection, result);
  sqlite3_busy_timeout(connection, kBusyTimeoutMs);
  sqlite3_limit(connection, SQLITE_LIMIT_LENGTH, kMaxValueBytes);
  // The file is untrusted input: its schema must not run code, and its pages are checked as they are read.
  sqlite3_db_config(connection, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  sqlite3_db_config(connection, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  sqlite3_db_config(connection, SQLITE_DBCONFIG_ENABLE_TRIGGER, 0, nullptr);
  sqlite3_db_config(connection, SQLITE_DBCONFIG_ENABLE_VIEW, 0, nullptr);
  sqlite3_db_config(connection, SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, nullptr);
  if (IsSmallerThanOnePage(connection))
    throw Error(file_ + " is damaged: it is truncated within its first page");
}

void Database::ConnectReadOnly() {
  const fs::path path = fs::absolute(file_);
  CheckIsFile(path, file_);
  immutable_ = false;
  const bool no_active_log = HasNoActiveLog(path);
  OpenConnection(path.string(), SQLITE_OPEN_READONLY);
  if (no_active_log && UsesWriteAheadLog(connection_.get())) {
    // The file was left by a process that could not close it properly, or it was copied without its log.
    // SQLite would now create a log beside it. Opening it as immutable leaves the folder unchanged.
    OpenConnection(Uri(path, "?immutable=1"), SQLITE_OPEN_READONLY | SQLITE_OPEN_URI);
    immutable_ = true;
  }
  Execute("PRAGMA cell_size_check = ON");
}

Database Database::OpenReadOnly(const fs::path& path) {
  Database database(path.string(), true);
  database.ConnectReadOnly();
  return database;
}

Database Database::OpenDamaged(const fs::path& path) {
  Database database = OpenReadOnly(path);
  // With a writable schema SQLite accepts a file that is shorter than its header says. The connection is
  // still read-only.
  sqlite3_db_config(database.connection_.get(), SQLITE_DBCONFIG_DEFENSIVE, 0, nullptr);
  sqlite3_db_config(database.connection_.get(), SQLITE_DBCONFIG_WRITABLE_SCHEMA, 1, nullptr);
  return database;
}

Database Database::OpenReadWrite(const fs::path& path, bool create) {
  Database database(path.string(), false);
  const fs::path absolute = fs::absolute(path);
  std::error_code error;
  if (!create || fs::exists(absolute, error)) {
    CheckIsFile(absolute, database.file_);
  } else if (!fs::is_directory(absolute.parent_path(), error)) {
    throw Error(database.file_ + " cannot be created: there is no folder " + absolute.parent_path().string());
  }
  database.OpenConnection(absolute.string(), SQLITE_OPEN_READWRITE | (create ? SQLITE_OPEN_CREATE : 0));
  if (sqlite3_db_readonly(database.connection_.get(), "main") == 1) {
    throw Error(database.file_ + " is not writable; open it read-only or change its permissions");
  }
  database.Execute("PRAGMA cell_size_check = ON");
  return database;
}

void Database::StartWriting() {
  Statement mode = Prepare("PRAGMA journal_mode = WAL");
  if (!mode.Step() || mode.Text(0) != "wal") {
    throw Error(file_ + " cannot be written safely here: its file system does not support a write-ahead log");
  }
  mode.Run();
  Execute("PRAGMA synchronous = FULL");
  sqlite3_db_config(connection_.get(), SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 0, nullptr);
  writing_ = true;
}

Database::~Database() {
  if (!connection_ || !writing_) return;
  // A failure here loses nothing: the log is left for the next process that writes.
  sqlite3_busy_timeout(connection_.get(), kCloseTimeoutMs);
  sqlite3_exec(connection_.get(), "PRAGMA wal_checkpoint(TRUNCATE); PRAGMA journal_mode = DELETE", nullptr,
               nullptr, nullptr);
}

void Database::Refresh() {
  if (immutable_) ConnectReadOnly();
}

void Database::Execute(const char* sql) const {
  if (sqlite3_exec(connection_.get(), sql, nullptr, nullptr, nullptr) != SQLITE_OK) {
    Fail(file_, connection_.get(), sqlite3_extended_errcode(connection_.get()));
  }
}

std::int64_t Database::Number(std::string_view sql) const {
  Statement query = Prepare(sql);
  if (!query.Step()) throw Error(file_ + " is damaged: an entry of the library is missing");
  return query.Integer(0);
}

void Database::CopyTo(const fs::path& path) const {
  Database copy(path.string(), false);
  copy.OpenConnection(fs::absolute(path).string(), SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE);
  copy.Execute("PRAGMA synchronous = FULL");
  const std::unique_ptr<sqlite3_backup, int (*)(sqlite3_backup*)> backup(
      sqlite3_backup_init(copy.connection_.get(), "main", connection_.get(), "main"), sqlite3_backup_finish);
  if (!backup) Fail(copy.file_, copy.connection_.get(), sqlite3_extended_errcode(copy.connection_.get()));
  const int result = sqlite3_backup_step(backup.get(), -1);
  if (result != SQLITE_DONE) Fail(copy.file_, copy.connection_.get(), result);
}

std::int64_t Database::Bytes() const {
  const std::int64_t stated = Number("PRAGMA page_count") * Number("PRAGMA page_size");
  // The pages of a transaction that writes are in memory until it is committed.
  if (sqlite3_txn_state(connection_.get(), "main") == SQLITE_TXN_WRITE) return stated;
  sqlite3_file* const file = OpenFile(connection_.get());
  sqlite3_int64 size = 0;
  if (!file || file->pMethods->xFileSize(file, &size) != SQLITE_OK) return 0;
  const fs::path log = Beside(fs::absolute(file_), "-wal");
  std::error_code error;
  const std::uintmax_t log_size = fs::file_size(log, error);
  // Neither the size in the file's header nor the size of an old log proves how much data there is, so the
  // smaller estimate counts.
  return std::min<std::int64_t>(size + (error ? 0 : static_cast<std::int64_t>(log_size)), stated);
}

bool Database::EndsWithWholePage() const {
  sqlite3_file* const file = OpenFile(connection_.get());
  sqlite3_int64 size = 0;
  if (!file || file->pMethods->xFileSize(file, &size) != SQLITE_OK) return false;
  if (size % Number("PRAGMA page_size") == 0) return true;
  const fs::path log = Beside(fs::absolute(file_), "-wal");
  std::error_code error;
  return fs::exists(log, error) && fs::file_size(log, error) > 0;
}

Transaction::Transaction(const Database& database, Kind kind) : database_(database) {
  database_.Execute(kind == Kind::kWrite ? "BEGIN IMMEDIATE" : "BEGIN");
}

Transaction::~Transaction() {
  if (!open_) return;
  try {
    database_.Execute("ROLLBACK");
  } catch (const Error&) {
    // After some failures SQLite has already rolled back, which is the intended result.
  }
}

void Transaction::Commit() {
  database_.Execute("COMMIT");
  open_ = false;
}

}  // namespace docent::maps
