// SPDX-License-Identifier: Apache-2.0
#include "maps/hub/local_library.h"

#include <algorithm>
#include <array>
#include <set>
#include <utility>

#include "maps/hub/sha256.h"
#include "maps/library/verify.h"
#include "maps/storage/block_checks.h"
#include "maps/storage/history_rows.h"
#include "maps/storage/library_identity.h"
#include "maps/storage/rows.h"
#include "maps/storage/tour_rows.h"

namespace docent::maps {

namespace {

constexpr std::array<std::string_view, 5> kHubParts = {"cameras", "keyframes", "points", "observations",
                                                       "panoramas"};
constexpr std::array<const char*, 2> kHubTables = {"thumbnails", "words"};
constexpr int kCheckThreads = 2;  // Images are decoded beside a tour, which needs the other processors.
constexpr std::size_t kImagePrefix = 6, kAssetPrefix = 6;  // Of "image/" and "asset/".

LibraryOptions OptionsOf(const SceneTools& scenes) {
  LibraryOptions options;
  options.scenes = scenes;
  return options;
}

std::int64_t AsKey(std::uint64_t key) {
  return static_cast<std::int64_t>(key);
}

// The row of a map in `thumbnails` or `words`.
Bytes ReadTableRow(const Database& database, const char* table, std::uint64_t key) {
  Statement query = database.Prepare(std::string("SELECT data FROM ") + table + " WHERE map_key = ?");
  query.Bind(1, AsKey(key));
  if (!query.Step()) throw Error("its " + std::string(table) + " are missing");
  return {query.Blob(0).begin(), query.Blob(0).end()};
}

void WriteTableRow(const Database& database, const char* table, std::uint64_t key, const Bytes& bytes) {
  database
      .Prepare(std::string("INSERT INTO ") + table +
               " (map_key, data) VALUES (?, ?) ON CONFLICT (map_key) DO UPDATE SET data = excluded.data "
               "WHERE data "
               "IS NOT excluded.data")
      .Bind(1, AsKey(key))
      .Bind(2, std::span<const std::uint8_t>(bytes))
      .Run();
}

// The checksum of a map's entry, which has the time of the last change, and that of its mesh.
std::string ReadStamp(const Database& database, std::uint64_t key) {
  Statement query = database.Prepare(
      "SELECT checksum, (SELECT substr(data, -8) FROM parts WHERE map_key = key AND part = 'mesh') FROM maps "
      "WHERE "
      "key = ?");
  query.Bind(1, AsKey(key));
  if (!query.Step()) return "";
  return std::to_string(query.Integer(0)) + (query.IsNull(1) ? "" : " " + HashOf(query.Blob(1)));
}

void ReadHubImages(const Database& database, std::uint64_t key, ItemBytes* items) {
  Statement query = database.Prepare("SELECT keyframe, data FROM pictures WHERE map_key = ?");
  query.Bind(1, AsKey(key));
  while (query.Step()) {
    const Bytes bytes(query.Blob(1).begin(), query.Blob(1).end());
    (*items)["image/" + std::to_string(query.Integer(0))] = WithKey(bytes, kHubKey);
  }
}

// Stores the images that differ and removes those that the map does not have.
void WriteHubImages(const Database& database, std::uint64_t key, const ItemBytes& items) {
  std::set<std::int64_t> kept;
  Statement insert = database.Prepare(
      "INSERT INTO pictures (map_key, keyframe, data) VALUES (?, ?, ?) ON CONFLICT (map_key, keyframe) DO "
      "UPDATE SET "
      "data = excluded.data WHERE data IS NOT excluded.data");
  for (const auto& [item, bytes] : items) {
    if (!item.starts_with("image/")) continue;
    const std::int64_t keyframe = std::stoll(item.substr(kImagePrefix));
    const Bytes own = FromHub(bytes, key);
    insert.Reset();
    insert.Bind(1, AsKey(key)).Bind(2, keyframe).Bind(3, std::span<const std::uint8_t>(own)).Run();
    kept.insert(keyframe);
  }
  std::vector<std::int64_t> stale;
  Statement stored = database.Prepare("SELECT keyframe FROM pictures WHERE map_key = ?");
  stored.Bind(1, AsKey(key));
  while (stored.Step()) {
    if (!kept.contains(stored.Integer(0))) stale.push_back(stored.Integer(0));
  }
  for (const std::int64_t keyframe : stale)
    database.Prepare("DELETE FROM pictures WHERE map_key = ? AND keyframe = ?")
        .Bind(1, AsKey(key))
        .Bind(2, keyframe)
        .Run();
}

void RemovePart(const Database& database, std::uint64_t key, std::string_view part) {
  database.Prepare("DELETE FROM parts WHERE map_key = ? AND part = ?")
      .Bind(1, AsKey(key))
      .Bind(2, part)
      .Run();
}

const Bytes& ItemOf(const LocalMap& map, std::string_view item) {
  const auto found = map.items.find(std::string(item));
  if (found == map.items.end()) throw Error("its part '" + std::string(item) + "' is missing");
  return found->second;
}

// The identity of a library, which gets one if it has none.
LibraryIdentity IdentityOf(const Database& database) {
  {
    const Transaction transaction(database, Transaction::Kind::kRead);
    if (LibraryIdentity identity = ReadLibraryIdentity(database); !identity.current.empty()) return identity;
  }
  Transaction transaction(database, Transaction::Kind::kWrite);
  // Another program may have given it one meanwhile.
  if (ReadLibraryIdentity(database).current.empty()) RenewLibraryIdentity(database, NewMapId());
  LibraryIdentity identity = ReadLibraryIdentity(database);
  transaction.Commit();
  return identity;
}

std::string Retargeted(const SceneTools& scenes, const std::string& text, const Retarget& retarget) {
  if (text.empty() || !scenes.retarget) return text;
  return scenes.retarget(text, retarget).value_or(text);
}

}  // namespace

LocalLibrary::LocalLibrary(const std::filesystem::path& path, CreateIfMissing create, SceneTools scenes)
    : file_(path),
      scenes_(std::move(scenes)),
      library_(Library::Open(path, Access::kReadWrite, create, OptionsOf(scenes_))),
      database_(Database::OpenReadWrite(path, false)) {
  database_.StartWriting();
  identity_ = IdentityOf(database_);
}

const std::string& LocalLibrary::RenewIdentity() {
  Transaction transaction(database_, Transaction::Kind::kWrite);
  RenewLibraryIdentity(database_, NewMapId());
  identity_ = ReadLibraryIdentity(database_);
  transaction.Commit();
  return identity_.current;
}

std::string LocalLibrary::StampOf(std::uint64_t key) const {
  const Transaction transaction(database_, Transaction::Kind::kRead);
  return ReadStamp(database_, key);
}

std::uint64_t LocalLibrary::NextKey() const {
  const Transaction transaction(database_, Transaction::Kind::kRead);
  return ReadLibraryRow(database_).next_key;
}

LocalMap LocalLibrary::Read(std::uint64_t key, const Retarget& to_hub) const {
  const Transaction transaction(database_, Transaction::Kind::kRead);
  const std::optional<MapInfo> info = ReadMapRow(database_, key);
  if (!info) throw LocalChange(database_.file() + " has no map with the key " + std::to_string(key));
  LocalMap map;
  map.state.stamp = ReadStamp(database_, key);
  WithMapContext(database_, *info, [&] {
    map.facts.info = *info;
    for (const std::string_view part : kHubParts)
      map.items[std::string(part)] = WithKey(ReadPart(database_, key, part), kHubKey);
    for (const char* table : kHubTables)
      map.items[table] = WithKey(ReadTableRow(database_, table, key), kHubKey);
    if (const auto mesh = FindPart(database_, key, "mesh")) map.items["mesh"] = WithKey(*mesh, kHubKey);
    ReadHubImages(database_, key, &map.items);
    const ScenePart scene = ReadScenePart(database_, key);
    map.state.scene_hash = HashOf(scene.text);
    const std::string text = Retargeted(scenes_, scene.text, to_hub);
    map.items["scene"] = Bytes(text.begin(), text.end());
    for (const std::string& id : scene.asset_ids) {
      const AssetRecord asset = ReadAsset(database_, id);
      map.items["asset/" + id] = *asset.bytes;
      map.facts.asset_names[id] = asset.name;
    }
  });
  for (const auto& [item, bytes] : map.items) map.manifest[item] = HashOf(bytes);
  return map;
}

void LocalLibrary::CheckStamp(std::uint64_t key, const std::string& stamp) const {
  if (ReadStamp(database_, key) != stamp)
    throw LocalChange(database_.file() + ": a map was changed by another program meanwhile");
}

bool LocalLibrary::HasStructure(const LocalMap& map) const {
  const std::uint64_t key = map.facts.info.key;
  std::size_t images = 0;
  for (const auto& [item, bytes] : map.items) {
    if (item == "scene" || IsContentItem(item)) continue;
    std::optional<Bytes> stored;
    if (item.starts_with("image/")) {
      ++images;
      Statement query = database_.Prepare("SELECT data FROM pictures WHERE map_key = ? AND keyframe = ?");
      query.Bind(1, AsKey(key)).Bind(2, std::int64_t{std::stoll(item.substr(kImagePrefix))});
      if (query.Step()) stored = Bytes(query.Blob(0).begin(), query.Blob(0).end());
    } else if (item == "thumbnails" || item == "words") {
      stored = ReadTableRow(database_, item.c_str(), key);
    } else {
      stored = FindPart(database_, key, item);
    }
    if (!stored || *stored != WithKey(bytes, key)) return false;
  }
  // The facts are not covered by the bytes of the columns, and a map with wrong ones could not be loaded.
  const MapInfo& wanted = map.facts.info;
  const std::optional<MapInfo> info = ReadMapRow(database_, key);
  return info && info->keyframes == images && wanted.keyframes == images && info->points == wanted.points &&
         info->observations == wanted.observations && info->next_keyframe == wanted.next_keyframe &&
         info->next_point == wanted.next_point;
}

void LocalLibrary::WriteItems(const LocalMap& map, const Retarget& to_local) {
  const std::uint64_t key = map.facts.info.key;
  for (const std::string_view part : kHubParts) {
    const Bytes own = FromHub(ItemOf(map, part), key);
    WritePart(database_, key, part, own);
    if (std::find(kPartsInBlocks.begin(), kPartsInBlocks.end(), part) != kPartsInBlocks.end())
      WritePart(database_, key, BlockChecksOf(part), EncodeBlockChecks(key, own));
  }
  for (const char* table : kHubTables) WriteTableRow(database_, table, key, FromHub(ItemOf(map, table), key));
  if (map.items.contains("mesh")) {
    WritePart(database_, key, "mesh", FromHub(ItemOf(map, "mesh"), key));
  } else {
    RemovePart(database_, key, "mesh");
  }
  WriteHubImages(database_, key, map.items);
  const Bytes& text = ItemOf(map, "scene");
  ScenePart scene{Retargeted(scenes_, {text.begin(), text.end()}, to_local), {}};
  for (const auto& [id, name] : map.facts.asset_names) {
    WriteAsset(database_, {id, name, std::make_shared<const Bytes>(ItemOf(map, "asset/" + id))});
    scene.asset_ids.push_back(id);
  }
  const std::optional<Bytes> before = FindPart(database_, key, "scene");
  // An undo history belongs to one state of the scene.
  if (before && DecodeScene(key, *before).text != scene.text) RemoveHistory(database_, key);
  WriteScenePart(database_, key, scene);
}

LocalState LocalLibrary::Write(const LocalMap& map, const Retarget& to_local, const std::string& stamp) {
  Transaction transaction(database_, Transaction::Kind::kWrite);
  const MapInfo& info = map.facts.info;
  CheckStamp(info.key, stamp);
  WithMapContext(database_, info, [&] {
    const bool known_structure = !stamp.empty() && HasStructure(map);
    WriteItems(map, to_local);
    LibraryRow library = ReadLibraryRow(database_);
    if (info.key >= library.next_key) throw Error("its key was not issued by this library");
    if (stamp.empty()) ++library.map_count;
    WriteLibraryRow(database_, library);
    WriteMapRow(database_, info);
    // Decoding every image takes long, and was done when this structure was written.
    const std::vector<std::string> problems = known_structure
                                                  ? VerifyScene(database_, info, scenes_)
                                                  : VerifyMap(database_, info, kCheckThreads, scenes_);
    if (!problems.empty()) throw Error("the hub sent a damaged map, which was refused: " + problems.front());
    RemoveUnusedAssets(database_);
  });
  // Of this transaction: after it, somebody else may change the map.
  const LocalState state{ReadStamp(database_, info.key), HashOf(ReadScenePart(database_, info.key).text)};
  transaction.Commit();
  return state;
}

void LocalLibrary::Remove(std::uint64_t key, const std::string& stamp) {
  Transaction transaction(database_, Transaction::Kind::kWrite);
  CheckStamp(key, stamp);
  RemoveMapRows(database_, key);
  ReplaceStop(database_, key, std::nullopt);
  LibraryRow library = ReadLibraryRow(database_);
  --library.map_count;
  WriteLibraryRow(database_, library);
  RemoveUnusedAssets(database_);
  transaction.Commit();
}

}  // namespace docent::maps
