// SPDX-License-Identifier: Apache-2.0
#include "maps/storage/schema.h"

#include <array>
#include <string>
#include <string_view>

#include "engine/base/error.h"
#include "maps/storage/rows.h"

namespace docent::maps {

namespace {

struct Table {
  std::int64_t since;  // The first format with this table.
  const char* name;
  const char* sql;
};

// Never edit these: a change of the tables needs a new schema version and an upgrade step.
constexpr std::array<Table, 9> kTables = {{
    {1, "library",
     "CREATE TABLE library (id INTEGER PRIMARY KEY CHECK (id = 1), next_key INTEGER NOT NULL, map_count "
     "INTEGER NOT "
     "NULL, checksum INTEGER NOT NULL) STRICT"},
    {1, "maps",
     "CREATE TABLE maps (key INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE, policy TEXT NOT NULL, "
     "created_ns INTEGER "
     "NOT NULL, modified_ns INTEGER NOT NULL, revision INTEGER NOT NULL, next_keyframe INTEGER NOT NULL, "
     "next_point "
     "INTEGER NOT NULL, keyframe_count INTEGER NOT NULL, point_count INTEGER NOT NULL, observation_count "
     "INTEGER NOT "
     "NULL, bounds BLOB, checksum INTEGER NOT NULL) STRICT"},
    {1, "parts",
     "CREATE TABLE parts (map_key INTEGER NOT NULL, part TEXT NOT NULL, data BLOB NOT NULL, PRIMARY KEY "
     "(map_key, "
     "part)) STRICT"},
    {1, "pictures",
     "CREATE TABLE pictures (map_key INTEGER NOT NULL, keyframe INTEGER NOT NULL, data BLOB NOT NULL, "
     "PRIMARY KEY "
     "(map_key, keyframe)) STRICT"},
    {1, "assets",
     "CREATE TABLE assets (id TEXT PRIMARY KEY, name TEXT NOT NULL, data BLOB NOT NULL, checksum INTEGER NOT "
     "NULL) "
     "STRICT"},
    {kThumbnailsSince, "thumbnails",
     "CREATE TABLE thumbnails (map_key INTEGER PRIMARY KEY, data BLOB NOT NULL) STRICT"},
    {kWordsSince, "words", "CREATE TABLE words (map_key INTEGER PRIMARY KEY, data BLOB NOT NULL) STRICT"},
    {kLensesSince, "lenses",
     "CREATE TABLE lenses (camera TEXT PRIMARY KEY, data BLOB NOT NULL, checksum INTEGER NOT NULL) STRICT"},
    {kToursSince, "tours",
     "CREATE TABLE tours (name TEXT PRIMARY KEY, language TEXT NOT NULL, minutes INTEGER NOT NULL, stops "
     "BLOB NOT NULL, checksum INTEGER NOT NULL) STRICT"},
}};

}  // namespace

bool IsBlank(const Database& database) {
  return database.Number("PRAGMA page_count") == 0;
}

void CreateSchema(const Database& database) {
  Transaction transaction(database, Transaction::Kind::kWrite);
  // Starting to write allocates the first page, so only the tables show whether another process was first.
  if (database.Number("SELECT count(*) FROM sqlite_schema") != 0) return;
  for (const Table& table : kTables) database.Execute(table.sql);
  WriteLibraryRow(database, {});
  database.Execute(("PRAGMA application_id = " + std::to_string(kApplicationId)).c_str());
  SetSchemaVersion(database, kSchemaVersion);
  transaction.Commit();
}

std::int64_t SchemaVersion(const Database& database) {
  return database.Number("PRAGMA user_version");
}

void SetSchemaVersion(const Database& database, std::int64_t version) {
  database.Execute(("PRAGMA user_version = " + std::to_string(version)).c_str());
}

void CreateTable(const Database& database, std::string_view name) {
  for (const Table& table : kTables) {
    if (table.name == name) database.Execute(table.sql);
  }
}

void CheckIsLibrary(const Database& database) {
  Transaction transaction(database, Transaction::Kind::kRead);
  const std::string& file = database.file();
  if (IsBlank(database)) throw Error(file + " is empty, not a library of maps");
  if (database.Number("PRAGMA application_id") != kApplicationId) {
    throw Error(file + " is not a library of maps (it is an SQLite file of another program)");
  }
  const std::int64_t version = SchemaVersion(database);
  if (version > kSchemaVersion) {
    throw Error(file + " was written by a newer Docent (format " + std::to_string(version) +
                "; this program knows formats up to " + std::to_string(kSchemaVersion) +
                "); update Docent to open it");
  }
  if (version < 1) throw Error(file + " is damaged: its format version is not valid");
  if (!database.EndsWithWholePage())
    throw Error(file + " is damaged: it is cut off; use docent maps recover to save what is still readable");
  Statement entries = database.Prepare("SELECT type, name, sql FROM sqlite_schema WHERE sql IS NOT NULL");
  std::size_t found = 0, expected = 0;
  for (const Table& table : kTables) expected += table.since <= version ? 1 : 0;
  while (entries.Step()) {
    const std::string type = entries.Text(0), name = entries.Text(1), sql = entries.Text(2);
    bool known = false;
    for (const Table& table : kTables) {
      known |= table.since <= version && type == "table" && name == table.name && sql == table.sql;
    }
    if (!known) throw Error(file + " is damaged: its table '" + name + "' is not one of a library of maps");
    ++found;
  }
  if (found != expected) throw Error(file + " is damaged: a table of the library is missing");
}

}  // namespace docent::maps
