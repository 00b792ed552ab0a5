// SPDX-License-Identifier: Apache-2.0
#include "maps/hub/sync_state.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <set>
#include <string_view>

#include "engine/base/error.h"
#include "maps/hub/map_facts.h"
#include "maps/hub/sha256.h"
#include "maps/library/library.h"
#include "maps/storage/policy.h"

namespace docent::maps {

namespace {

constexpr std::int64_t kStateId = 0x44634862;  // "DcHb", PRAGMA application_id
constexpr std::int64_t kStateVersion = 1;      // PRAGMA user_version

constexpr std::array<const char*, 4> kStateTables = {
    "CREATE TABLE hub (id TEXT NOT NULL) STRICT",
    "CREATE TABLE links (key INTEGER PRIMARY KEY, id TEXT NOT NULL UNIQUE, revision INTEGER NOT NULL, stamp "
    "TEXT NOT "
    "NULL, structure TEXT NOT NULL, scene_hash TEXT NOT NULL, scene TEXT NOT NULL, name TEXT NOT NULL, "
    "local_name TEXT "
    "NOT NULL, policy TEXT NOT NULL) STRICT",
    "CREATE TABLE tours (name TEXT PRIMARY KEY, revision INTEGER NOT NULL, content TEXT NOT NULL) STRICT",
    "CREATE TABLE received (hash TEXT PRIMARY KEY, data BLOB NOT NULL) STRICT"};

// Columns that the tables of older files lack. Older programs leave them as they are, or as by default.
struct LaterColumn {
  const char *table, *name, *type;
};
constexpr std::array<LaterColumn, 4> kLaterColumns = {{
    {"links", "created", "INTEGER NOT NULL DEFAULT 0"},
    {"links", "restoration", "TEXT NOT NULL DEFAULT ''"},
    {"tours", "restoration", "TEXT NOT NULL DEFAULT ''"},
    {"hub", "library", "TEXT NOT NULL DEFAULT ''"},
}};

bool HasColumn(const Database& database, const LaterColumn& column) {
  Statement query = database.Prepare("SELECT 1 FROM pragma_table_info(?) WHERE name = ?");
  return query.Bind(1, std::string_view(column.table)).Bind(2, std::string_view(column.name)).Step();
}

void AddLaterColumns(const Database& database) {
  const auto is_there = [&](const LaterColumn& column) { return HasColumn(database, column); };
  if (std::all_of(kLaterColumns.begin(), kLaterColumns.end(), is_there)) return;
  Transaction transaction(database, Transaction::Kind::kWrite);
  for (const LaterColumn& column : kLaterColumns) {
    if (is_there(column)) continue;  // Another program may have added it meanwhile.
    database.Execute(
        (std::string("ALTER TABLE ") + column.table + " ADD COLUMN " + column.name + " " + column.type)
            .c_str());
  }
  transaction.Commit();
}

void CreateState(const Database& database, const std::string& hub_id) {
  Transaction transaction(database, Transaction::Kind::kWrite);
  if (database.Number("SELECT count(*) FROM sqlite_schema") != 0) return;
  for (const char* sql : kStateTables) database.Execute(sql);
  database.Prepare("INSERT INTO hub (id) VALUES (?)").Bind(1, hub_id).Run();
  database.Execute(("PRAGMA application_id = " + std::to_string(kStateId)).c_str());
  database.Execute(("PRAGMA user_version = " + std::to_string(kStateVersion)).c_str());
  transaction.Commit();
}

void CheckState(const Database& database, const std::string& hub_id) {
  if (database.Number("PRAGMA application_id") != kStateId ||
      database.Number("PRAGMA user_version") != kStateVersion)
    throw Error(database.file() +
                " is not the record of a library's exchange with its hub; move it away and try again");
  Statement query = database.Prepare("SELECT id FROM hub");
  if (!query.Step() || !IsMapId(query.Text(0)))
    throw Error(database.file() +
                " is damaged; move it away, and the library is compared with its hub from the beginning");
  if (query.Text(0) != hub_id)
    throw Error(database.file() +
                " says that the library belongs to another hub; use another library for this one");
}

void CheckLink(const Database& database, const MapLink& link) {
  const bool valid = link.key != 0 && IsMapId(link.id) && link.revision >= 0 &&
                     (link.restoration.empty() || IsMapId(link.restoration)) &&
                     (link.revision == 0 || (IsHash(link.structure) && IsHash(link.scene_hash) &&
                                             ValidateMapName(link.name).empty() && ParsePolicy(link.policy)));
  if (!valid)
    throw Error(database.file() +
                " is damaged; move it away, and the library is compared with its hub from the beginning");
}

}  // namespace

std::filesystem::path SyncStatePath(const std::filesystem::path& library) {
  std::filesystem::path path = library;
  path += ".hub";
  return path;
}

SyncState::SyncState(const std::filesystem::path& library, const std::string& hub_id)
    : database_(Database::OpenReadWrite(SyncStatePath(library), true)) {
  if (database_.Number("PRAGMA page_count") == 0) CreateState(database_, hub_id);
  CheckState(database_, hub_id);
  database_.StartWriting();
  AddLaterColumns(database_);
}

std::vector<MapLink> SyncState::Links() const {
  Statement query = database_.Prepare(
      "SELECT key, id, revision, stamp, structure, scene_hash, scene, name, local_name, policy, created, "
      "restoration FROM links ORDER BY key");
  std::vector<MapLink> links;
  while (query.Step()) {
    links.push_back({static_cast<std::uint64_t>(query.Integer(0)), query.Text(1), query.Integer(2),
                     query.Text(3), query.Text(4), query.Text(5), query.Text(6), query.Text(7), query.Text(8),
                     query.Text(9), query.Integer(10), query.Text(11)});
    CheckLink(database_, links.back());
  }
  return links;
}

void SyncState::Put(const MapLink& link) {
  database_
      .Prepare(
          "INSERT OR REPLACE INTO links (key, id, revision, stamp, structure, scene_hash, scene, name, "
          "local_name, policy, created, restoration) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)")
      .Bind(1, static_cast<std::int64_t>(link.key))
      .Bind(2, link.id)
      .Bind(3, link.revision)
      .Bind(4, link.stamp)
      .Bind(5, link.structure)
      .Bind(6, link.scene_hash)
      .Bind(7, link.scene)
      .Bind(8, link.name)
      .Bind(9, link.local_name)
      .Bind(10, link.policy)
      .Bind(11, link.created)
      .Bind(12, link.restoration)
      .Run();
}

std::vector<MapLink> SyncState::AddLinks(const std::vector<std::string>& ids,
                                         const std::function<std::uint64_t(std::size_t count)>& reserve) {
  Transaction transaction(database_, Transaction::Kind::kWrite);
  std::vector<MapLink> links = Links();
  std::set<std::string> known;
  for (const MapLink& link : links) known.insert(link.id);
  std::vector<std::string> missing;
  std::copy_if(ids.begin(), ids.end(), std::back_inserter(missing),
               [&](const std::string& id) { return !known.contains(id); });
  if (missing.empty()) return links;
  std::uint64_t key = reserve(missing.size());
  for (const std::string& id : missing) {
    MapLink link;
    link.key = key++;
    link.id = id;
    Put(link);
    links.push_back(link);
  }
  transaction.Commit();
  return links;
}

void SyncState::RemoveLink(std::uint64_t key) {
  database_.Prepare("DELETE FROM links WHERE key = ?").Bind(1, static_cast<std::int64_t>(key)).Run();
}

std::vector<TourLink> SyncState::Tours() const {
  Statement query = database_.Prepare("SELECT name, revision, content, restoration FROM tours ORDER BY name");
  std::vector<TourLink> tours;
  while (query.Step()) tours.push_back({query.Text(0), query.Integer(1), query.Text(2), query.Text(3)});
  return tours;
}

void SyncState::Put(const TourLink& tour) {
  database_.Prepare("INSERT OR REPLACE INTO tours (name, revision, content, restoration) VALUES (?, ?, ?, ?)")
      .Bind(1, tour.name)
      .Bind(2, tour.revision)
      .Bind(3, tour.content)
      .Bind(4, tour.restoration)
      .Run();
}

void SyncState::RemoveTour(const std::string& name) {
  database_.Prepare("DELETE FROM tours WHERE name = ?").Bind(1, name).Run();
}

std::string SyncState::LibraryIdentity() const {
  Statement query = database_.Prepare("SELECT library FROM hub");
  return query.Step() ? query.Text(0) : "";
}

void SyncState::SetLibraryIdentity(const std::string& identity) {
  database_.Prepare("UPDATE hub SET library = ?").Bind(1, identity).Run();
}

void SyncState::RenewLibraryIdentity(const std::function<std::string()>& renew) {
  Transaction transaction(database_, Transaction::Kind::kWrite);
  SetLibraryIdentity(renew());
  transaction.Commit();
}

void SyncState::StartAnew(const std::string& identity) {
  Transaction transaction(database_, Transaction::Kind::kWrite);
  database_.Execute("DELETE FROM links");
  database_.Execute("DELETE FROM tours");
  SetLibraryIdentity(identity);
  transaction.Commit();
}

std::optional<Bytes> SyncState::Received(const std::string& hash) const {
  Statement query = database_.Prepare("SELECT data FROM received WHERE hash = ?");
  query.Bind(1, hash);
  if (!query.Step()) return std::nullopt;
  Bytes bytes(query.Blob(0).begin(), query.Blob(0).end());
  if (HashOf(bytes) != hash) return std::nullopt;  // Damaged bytes are received once more.
  return bytes;
}

void SyncState::KeepReceived(const std::string& hash, const Bytes& bytes) {
  database_.Prepare("INSERT OR REPLACE INTO received (hash, data) VALUES (?, ?)")
      .Bind(1, hash)
      .Bind(2, std::span<const std::uint8_t>(bytes))
      .Run();
}

void SyncState::ForgetReceived() {
  database_.Execute("DELETE FROM received");
}

}  // namespace docent::maps
