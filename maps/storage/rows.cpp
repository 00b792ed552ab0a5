// SPDX-License-Identifier: Apache-2.0
#include "maps/storage/rows.h"

#include <algorithm>
#include <limits>
#include <unordered_map>
#include <utility>

#include "engine/base/error.h"
#include "maps/storage/block_checks.h"
#include "maps/storage/checksum.h"
#include "maps/storage/history_rows.h"
#include "maps/storage/panorama_codec.h"
#include "maps/storage/schema.h"

namespace docent::maps {

namespace {

constexpr const char* kMapColumns =
    "key, name, policy, created_ns, modified_ns, revision, next_keyframe, next_point, keyframe_count, "
    "point_count, "
    "observation_count, bounds, checksum";

std::int64_t Signed(std::uint64_t value) {
  return static_cast<std::int64_t>(value);
}

Bytes EncodeBounds(const Bounds& bounds) {
  ByteWriter writer;
  writer.PutAll(bounds.min);
  writer.PutAll(bounds.max);
  return writer.Take();
}

std::uint64_t LibraryChecksum(const LibraryRow& row) {
  ByteWriter writer;
  writer.Put(row.next_key);
  writer.Put(row.map_count);
  return Checksum(writer.bytes());
}

std::uint64_t MapChecksum(const MapInfo& info) {
  ByteWriter writer;
  writer.Put(info.key);
  writer.PutText(info.name);
  writer.PutText(ToString(info.policy));
  writer.Put(std::int64_t{info.created.time_since_epoch().count()});
  writer.Put(std::int64_t{info.modified.time_since_epoch().count()});
  for (const std::uint64_t number :
       {info.revision, std::uint64_t{info.next_keyframe}, std::uint64_t{info.next_point}, info.keyframes,
        info.points, info.observations}) {
    writer.Put(number);
  }
  if (info.bounds) writer.PutBytes(EncodeBounds(*info.bounds));
  return Checksum(writer.bytes());
}

std::uint64_t AssetChecksum(const std::string& id, const std::string& name,
                            std::span<const std::uint8_t> bytes) {
  ByteWriter writer;
  writer.PutText(id);
  writer.PutText(name);
  return Checksum(bytes, Checksum(writer.bytes()));
}

std::uint32_t Id(std::int64_t value) {
  if (value < 0 || value > std::numeric_limits<std::uint32_t>::max()) throw Error("an id is out of range");
  return static_cast<std::uint32_t>(value);
}

MapInfo MapFromRow(const Statement& row) {
  MapRowValues values;
  values.key = row.Integer(0);
  values.name = row.Text(1);
  values.policy = row.Text(2);
  for (int i = 0; i < static_cast<int>(values.numbers.size()); ++i)
    values.numbers[static_cast<std::size_t>(i)] = row.Integer(3 + i);
  if (!row.IsNull(11)) values.bounds = Bytes(row.Blob(11).begin(), row.Blob(11).end());
  values.checksum = row.Integer(12);
  return CheckedMap(values);
}

MapInfo CheckedMapFromRow(const Database& database, const Statement& row) {
  const std::string key = std::to_string(row.Integer(0));
  try {
    return MapFromRow(row);
  } catch (const Error& error) {
    throw Error(database.file() + " is damaged: the entry of map " + key + ": " + error.what());
  }
}

}  // namespace

MapInfo CheckedMap(const MapRowValues& values) {
  MapInfo info;
  info.key = static_cast<std::uint64_t>(values.key);
  info.name = values.name;
  const std::optional<Policy> policy = ParsePolicy(values.policy);
  if (!policy) throw Error("its policy is unknown to this program");
  info.policy = *policy;
  info.created = WallTime(std::chrono::nanoseconds(values.numbers[0]));
  info.modified = WallTime(std::chrono::nanoseconds(values.numbers[1]));
  info.revision = static_cast<std::uint64_t>(values.numbers[2]);
  info.next_keyframe = Id(values.numbers[3]);
  info.next_point = Id(values.numbers[4]);
  info.keyframes = static_cast<std::uint64_t>(values.numbers[5]);
  info.points = static_cast<std::uint64_t>(values.numbers[6]);
  info.observations = static_cast<std::uint64_t>(values.numbers[7]);
  if (values.bounds) {
    ByteReader reader(*values.bounds);
    Bounds bounds;
    bounds.min = reader.GetAll<Eigen::Vector3d>();
    bounds.max = reader.GetAll<Eigen::Vector3d>();
    if (reader.failed() || reader.remaining() != 0 || !bounds.min.allFinite() || !bounds.max.allFinite() ||
        (bounds.min.array() > bounds.max.array()).any()) {
      throw Error("its bounds are not valid");
    }
    info.bounds = bounds;
  }
  if (info.key == 0 || info.name.empty()) throw Error("it has no key or no name");
  if (static_cast<std::uint64_t>(values.checksum) != MapChecksum(info))
    throw Error("its checksum does not match");
  return info;
}

void WritePart(const Database& database, std::uint64_t key, std::string_view part, const Bytes& bytes) {
  // The row stays in its page. A replaced one would move to the end of the file, which is lost first when the
  // file is cut off.
  database
      .Prepare(
          "INSERT INTO parts (map_key, part, data) VALUES (?, ?, ?) ON CONFLICT (map_key, part) DO UPDATE "
          "SET "
          "data = excluded.data WHERE data IS NOT excluded.data")
      .Bind(1, Signed(key))
      .Bind(2, part)
      .Bind(3, std::span<const std::uint8_t>(bytes))
      .Run();
}

std::optional<Bytes> FindPart(const Database& database, std::uint64_t key, std::string_view part) {
  Statement query = database.Prepare("SELECT data FROM parts WHERE map_key = ? AND part = ?");
  query.Bind(1, Signed(key)).Bind(2, part);
  if (!query.Step()) return std::nullopt;
  const std::span<const std::uint8_t> bytes = query.Blob(0);
  return Bytes(bytes.begin(), bytes.end());
}

Bytes ReadPart(const Database& database, std::uint64_t key, std::string_view part) {
  std::optional<Bytes> bytes = FindPart(database, key, part);
  if (!bytes) throw Error("its part '" + std::string(part) + "' is missing");
  return std::move(*bytes);
}

LibraryRow ReadLibraryRow(const Database& database) {
  Statement query = database.Prepare("SELECT next_key, map_count, checksum FROM library WHERE id = 1");
  if (!query.Step()) throw Error(database.file() + " is damaged: its first entry is missing");
  const LibraryRow row{static_cast<std::uint64_t>(query.Integer(0)),
                       static_cast<std::uint64_t>(query.Integer(1))};
  if (static_cast<std::uint64_t>(query.Integer(2)) != LibraryChecksum(row)) {
    throw Error(database.file() + " is damaged: the checksum of its first entry does not match");
  }
  return row;
}

void WriteLibraryRow(const Database& database, const LibraryRow& row) {
  database.Prepare("INSERT OR REPLACE INTO library (id, next_key, map_count, checksum) VALUES (1, ?, ?, ?)")
      .Bind(1, Signed(row.next_key))
      .Bind(2, Signed(row.map_count))
      .Bind(3, Signed(LibraryChecksum(row)))
      .Run();
}

std::vector<MapInfo> ReadMapRows(const Database& database) {
  const LibraryRow library = ReadLibraryRow(database);
  Statement query = database.Prepare(std::string("SELECT ") + kMapColumns + " FROM maps ORDER BY key");
  std::vector<MapInfo> maps;
  while (query.Step()) maps.push_back(CheckedMapFromRow(database, query));
  if (maps.size() != library.map_count) {
    throw Error(database.file() + " is damaged: its first entry gives " + std::to_string(library.map_count) +
                " maps but " + std::to_string(maps.size()) + " are there");
  }
  return maps;
}

std::optional<MapInfo> ReadMapRow(const Database& database, std::uint64_t key) {
  Statement query = database.Prepare(std::string("SELECT ") + kMapColumns + " FROM maps WHERE key = ?");
  query.Bind(1, Signed(key));
  if (!query.Step()) return std::nullopt;
  return CheckedMapFromRow(database, query);
}

void WriteMapRow(const Database& database, const MapInfo& info) {
  // INSERT OR REPLACE would also remove another map with the same name.
  database.Prepare("DELETE FROM maps WHERE key = ?").Bind(1, Signed(info.key)).Run();
  Statement insert = database.Prepare(std::string("INSERT INTO maps (") + kMapColumns +
                                      ") VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)");
  const Bytes bounds = info.bounds ? EncodeBounds(*info.bounds) : Bytes{};
  insert.Bind(1, Signed(info.key)).Bind(2, info.name).Bind(3, std::string_view(ToString(info.policy)));
  insert.Bind(4, std::int64_t{info.created.time_since_epoch().count()});
  insert.Bind(5, std::int64_t{info.modified.time_since_epoch().count()});
  insert.Bind(6, Signed(info.revision));
  insert.Bind(7, std::int64_t{info.next_keyframe}).Bind(8, std::int64_t{info.next_point});
  insert.Bind(9, Signed(info.keyframes)).Bind(10, Signed(info.points)).Bind(11, Signed(info.observations));
  if (info.bounds) {
    insert.Bind(12, std::span<const std::uint8_t>(bounds));
  } else {
    insert.BindNull(12);
  }
  insert.Bind(13, Signed(MapChecksum(info))).Run();
}

std::optional<std::uint64_t> FindMapByName(const Database& database, const std::string& name) {
  Statement query = database.Prepare("SELECT key FROM maps WHERE name = ?");
  query.Bind(1, name);
  if (!query.Step()) return std::nullopt;
  return static_cast<std::uint64_t>(query.Integer(0));
}

CameraTable CheckedCameras(std::uint64_t key, std::span<const std::uint8_t> bytes, std::int64_t file_bytes) {
  CameraTable cameras = DecodeCameras(key, bytes);
  // Images are compressed, uniform ones by a factor of a thousand. Without this check a file of a few
  // kilobytes could request gigabytes of memory. Libraries of real images are far from the limit.
  const std::int64_t most = kMaxPixelsPerByte * file_bytes;
  for (const auto& camera : cameras) {
    if (std::int64_t{camera->width_px()} * camera->height_px() > most)
      throw Error("its camera's image size is impossible for so small a file");
  }
  return cameras;
}

CameraTable ReadCameras(const Database& database, std::uint64_t key) {
  return CheckedCameras(key, ReadPart(database, key, "cameras"), database.Bytes());
}

MapParts ReadParts(const Database& database, const MapInfo& info) {
  const CameraTable cameras = ReadCameras(database, info.key);
  MapParts parts;
  parts.keyframes = DecodeKeyFrames(info.key, ReadPart(database, info.key, "keyframes"), cameras);
  parts.points = DecodePoints(info.key, ReadPart(database, info.key, "points"));
  parts.observations = DecodeObservations(info.key, ReadPart(database, info.key, "observations"));
  if (SchemaVersion(database) >= kPanoramasSince)
    DecodePanoramas(info.key, ReadPart(database, info.key, "panoramas"), &parts);
  if (parts.keyframes.size() != info.keyframes || parts.points.size() != info.points ||
      parts.observations.size() != info.observations) {
    throw Error("the numbers of its keyframes, points or observations differ from its entry");
  }
  return parts;
}

void WriteParts(const Database& database, std::uint64_t key, const MapParts& parts) {
  const CameraTable cameras = MakeCameraTable(parts.keyframes);
  WritePart(database, key, "cameras", EncodeCameras(key, cameras));
  const std::array<Bytes, kPartsInBlocks.size()> columns = {EncodeKeyFrames(key, parts.keyframes, cameras),
                                                            EncodePoints(key, parts.points),
                                                            EncodeObservations(key, parts.observations)};
  for (std::size_t i = 0; i < columns.size(); ++i) {
    WritePart(database, key, kPartsInBlocks[i], columns[i]);
    WritePart(database, key, BlockChecksOf(kPartsInBlocks[i]), EncodeBlockChecks(key, columns[i]));
  }
  WritePanoramas(database, key, parts);
}

void ReadImages(const Database& database, std::uint64_t key, const std::vector<StoredKeyFrame>& keyframes,
                const TakeImage& take) {
  Statement query = database.Prepare("SELECT data FROM pictures WHERE map_key = ? AND keyframe = ?");
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    query.Reset();
    query.Bind(1, Signed(key)).Bind(2, std::int64_t{keyframes[i].keyframe.id});
    if (!query.Step())
      throw Error("the image of keyframe " + std::to_string(keyframes[i].keyframe.id) + " is missing");
    take(i, query.Blob(0));
  }
}

void WriteImages(const Database& database, std::uint64_t key, const engine::MapSnapshot& snapshot,
                 const std::vector<StoredKeyFrame>& keyframes,
                 const std::vector<StoredKeyFrame>& stored_before) {
  std::unordered_map<engine::KeyFrameId, std::uint64_t> left;  // Stored images that are not in the new map.
  for (const StoredKeyFrame& stored : stored_before) left.emplace(stored.keyframe.id, stored.image_hash);
  Statement insert =
      database.Prepare("INSERT OR REPLACE INTO pictures (map_key, keyframe, data) VALUES (?, ?, ?)");
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    const engine::KeyFrameId id = keyframes[i].keyframe.id;
    const auto stored = left.find(id);
    const bool same = stored != left.end() && stored->second == keyframes[i].image_hash;
    if (stored != left.end()) left.erase(stored);
    if (same) continue;
    snapshot.keyframes[i].features->MarkInUse();
    const Bytes bytes = EncodeImage(key, id, snapshot.keyframes[i].features->levels[0]);
    insert.Reset();
    insert.Bind(1, Signed(key)).Bind(2, std::int64_t{id}).Bind(3, std::span<const std::uint8_t>(bytes)).Run();
  }
  Statement remove = database.Prepare("DELETE FROM pictures WHERE map_key = ? AND keyframe = ?");
  for (const auto& [id, hash] : left) {
    remove.Reset();
    remove.Bind(1, Signed(key)).Bind(2, std::int64_t{id}).Run();
  }
}

void WritePanoramas(const Database& database, std::uint64_t key, const MapParts& parts) {
  WritePart(database, key, "panoramas", EncodePanoramas(key, parts));
}

ScenePart ReadScenePart(const Database& database, std::uint64_t key) {
  return DecodeScene(key, ReadPart(database, key, "scene"));
}

void WriteScenePart(const Database& database, std::uint64_t key, const ScenePart& scene) {
  WritePart(database, key, "scene", EncodeScene(key, scene));
}

AssetRecord CheckedAsset(const std::string& id, const std::string& name, std::span<const std::uint8_t> bytes,
                         std::int64_t checksum) {
  if (static_cast<std::uint64_t>(checksum) != AssetChecksum(id, name, bytes))
    throw Error("the asset '" + name + "' is damaged: its checksum does not match");
  return {id, name, std::make_shared<const Bytes>(bytes.begin(), bytes.end())};
}

AssetRecord ReadAsset(const Database& database, const std::string& id) {
  Statement query = database.Prepare("SELECT name, data, checksum FROM assets WHERE id = ?");
  query.Bind(1, id);
  if (!query.Step()) throw Error("the asset " + id + " is missing");
  const std::string name = query.Text(0);
  return CheckedAsset(id, name, query.Blob(1), query.Integer(2));
}

void WriteAsset(const Database& database, const AssetRecord& asset) {
  if (asset.id.size() < kMinAssetIdBytes || asset.id.size() > kMaxAssetIdBytes) {
    throw Error("an asset needs an id of " + std::to_string(kMinAssetIdBytes) + " to " +
                std::to_string(kMaxAssetIdBytes) + " bytes");
  }
  Statement query = database.Prepare("SELECT name, checksum FROM assets WHERE id = ?");
  query.Bind(1, asset.id);
  if (query.Step()) {
    if (asset.bytes && static_cast<std::uint64_t>(query.Integer(1)) !=
                           AssetChecksum(asset.id, query.Text(0), *asset.bytes)) {
      throw Error("the asset '" + asset.name + "' has the id of another asset: " + asset.id);
    }
    return;
  }
  if (!asset.bytes) throw Error("the asset '" + asset.name + "' is not in the library");
  database.Prepare("INSERT INTO assets (id, name, data, checksum) VALUES (?, ?, ?, ?)")
      .Bind(1, asset.id)
      .Bind(2, asset.name)
      .Bind(3, std::span<const std::uint8_t>(*asset.bytes))
      .Bind(4, Signed(AssetChecksum(asset.id, asset.name, *asset.bytes)))
      .Run();
}

void RemoveUnusedAssets(const Database& database) {
  std::set<std::string> used;
  Statement rows =
      database.Prepare("SELECT map_key, part, data FROM parts WHERE part = 'scene' OR part = 'history'");
  while (rows.Step()) {
    try {
      const auto key = static_cast<std::uint64_t>(rows.Integer(0));
      const ScenePart part =
          rows.Text(1) == "scene" ? DecodeScene(key, rows.Blob(2)) : DecodeHistory(key, rows.Blob(2)).changes;
      used.insert(part.asset_ids.begin(), part.asset_ids.end());
    } catch (const Error&) {
      return;  // A damaged scene or history may refer to any of the assets.
    }
  }
  std::vector<std::string> unused;
  Statement assets = database.Prepare("SELECT id FROM assets");
  while (assets.Step()) {
    if (std::string id = assets.Text(0); !used.contains(id)) unused.push_back(std::move(id));
  }
  for (const std::string& id : unused) database.Prepare("DELETE FROM assets WHERE id = ?").Bind(1, id).Run();
}

void RemoveMapRows(const Database& database, std::uint64_t key) {
  for (const char* sql :
       {"DELETE FROM maps WHERE key = ?", "DELETE FROM parts WHERE map_key = ?",
        "DELETE FROM pictures WHERE map_key = ?", "DELETE FROM thumbnails WHERE map_key = ?",
        "DELETE FROM words WHERE map_key = ?"}) {
    database.Prepare(sql).Bind(1, Signed(key)).Run();
  }
}

void WithMapContext(const Database& database, const MapInfo& info, const std::function<void()>& body) {
  try {
    body();
  } catch (const Error& error) {
    const std::string what = error.what();
    if (what.starts_with(database.file() + " ")) throw;  // The message already names the file.
    throw Error(database.file() + ": map '" + info.name + "' (" + std::to_string(info.key) + "): " + what);
  }
}

}  // namespace docent::maps
