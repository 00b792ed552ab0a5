// SPDX-License-Identifier: Apache-2.0
#include "maps/library/migration.h"

#include <algorithm>
#include <string>
#include <system_error>

#include "engine/base/error.h"
#include "maps/index/thumbnail_rows.h"
#include "maps/index/word_rows.h"
#include "maps/library/signposts.h"
#include "maps/storage/block_checks.h"
#include "maps/storage/rows.h"
#include "maps/storage/schema.h"

namespace docent::maps {

namespace {

namespace fs = std::filesystem;

// An existing copy is of the same format and is kept, because it may be the only one from before an error.
void MakeBackup(const Database& database, std::int64_t format) {
  const fs::path path = BackupPath(fs::absolute(database.file()), format);
  std::error_code error;
  if (fs::exists(path, error)) return;
  fs::path unfinished = path;
  unfinished += ".part";
  fs::remove(unfinished, error);
  try {
    database.CopyTo(unfinished);
    fs::rename(unfinished, path);
  } catch (const std::exception& problem) {
    fs::remove(unfinished, error);
    throw Error(database.file() +
                " is of an older format and cannot be upgraded, because no copy of it can be " +
                "made beside it (" + problem.what() + "); make room there, or open it read-only");
  }
}

// Format 2 added a table with one row of thumbnails per map, and panorama maps.
void UpgradeToFormat2(const Database& database) {
  CreateTable(database, "thumbnails");
  for (const MapInfo& info : ReadMapRows(database)) {
    WithMapContext(database, info, [&] {
      WriteThumbnails(database, info.key, ThumbnailsFromImages(database, info));
      WritePanoramas(database, info.key, {});
    });
  }
}

// Format 3 added the words of each map's keyframes.
void UpgradeToFormat3(const Database& database) {
  CreateTable(database, "words");
  for (const MapInfo& info : ReadMapRows(database)) {
    WithMapContext(database, info, [&] { WriteWords(database, info.key, WordsFromImages(database, info)); });
  }
}

// Format 4 added the table of estimated lenses. It is empty at first.
void UpgradeToFormat4(const Database& database) {
  CreateTable(database, "lenses");
}

// Format 5 added checksums of the blocks of large columns, undo histories, and the keys of the maps that
// signposts lead to. What is damaged stays as it is, for it does not keep the rest from being upgraded.
void UpgradeToFormat5(const Database& database, const SceneTools& scenes) {
  const std::vector<MapInfo> maps = ReadMapRows(database);
  for (const MapInfo& info : maps) {
    for (const std::string_view part : kPartsInBlocks) {
      if (const auto column = FindPart(database, info.key, part))
        WritePart(database, info.key, BlockChecksOf(part), EncodeBlockChecks(info.key, *column));
    }
    if (!scenes.retarget) continue;
    try {
      ScenePart scene = ReadScenePart(database, info.key);
      if (scene.text.empty()) continue;
      const auto text = scenes.retarget(scene.text, [&](const std::string&, const SignpostTarget& target) {
        return KeyOfTarget(target, maps);
      });
      if (!text) continue;
      scene.text = *text;
      WriteScenePart(database, info.key, scene);
    } catch (const Error&) {
      continue;
    }
  }
}

// Format 6 added the table of tours. It is empty at first.
void UpgradeToFormat6(const Database& database) {
  CreateTable(database, "tours");
}

}  // namespace

fs::path BackupPath(const fs::path& library, std::int64_t format) {
  fs::path path = library;
  path += ".format-" + std::to_string(format);
  return path;
}

void UpgradeFormat(const Database& database, const SceneTools& scenes) {
  const std::int64_t format = SchemaVersion(database);
  if (format == kSchemaVersion) return;
  MakeBackup(database, format);
  Transaction transaction(database, Transaction::Kind::kWrite);
  // Another process may have upgraded the file already.
  if (SchemaVersion(database) < 2) UpgradeToFormat2(database);
  SetSchemaVersion(database, std::max<std::int64_t>(2, SchemaVersion(database)));
  if (SchemaVersion(database) < 3) UpgradeToFormat3(database);
  SetSchemaVersion(database, std::max<std::int64_t>(3, SchemaVersion(database)));
  if (SchemaVersion(database) < 4) UpgradeToFormat4(database);
  SetSchemaVersion(database, std::max<std::int64_t>(4, SchemaVersion(database)));
  if (SchemaVersion(database) < 5) UpgradeToFormat5(database, scenes);
  SetSchemaVersion(database, std::max<std::int64_t>(5, SchemaVersion(database)));
  if (SchemaVersion(database) < 6) UpgradeToFormat6(database);
  SetSchemaVersion(database, kSchemaVersion);
  transaction.Commit();
}

}  // namespace docent::maps
