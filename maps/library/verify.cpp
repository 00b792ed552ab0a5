// SPDX-License-Identifier: Apache-2.0
#include "maps/library/verify.h"

#include <functional>
#include <map>
#include <set>

#include "engine/base/error.h"
#include "maps/index/thumbnail_rows.h"
#include "maps/index/word_rows.h"
#include "maps/library/signposts.h"
#include "maps/storage/block_checks.h"
#include "maps/storage/history_rows.h"
#include "maps/storage/lens_rows.h"
#include "maps/storage/mesh_rows.h"
#include "maps/storage/rows.h"
#include "maps/storage/schema.h"
#include "maps/storage/snapshot_reader.h"
#include "maps/storage/tour_rows.h"

namespace docent::maps {

namespace {

constexpr std::size_t kMaxSentences = 100;  // More sentences would not help anybody.

class Report {
 public:
  void Add(std::string sentence) {
    if (sentences_.size() < kMaxSentences) sentences_.push_back(std::move(sentence));
  }
  // Runs `check` and records the message of what it throws.
  void Try(const std::function<void()>& check) {
    try {
      check();
    } catch (const Error& error) {
      Add(error.what());
    }
  }
  std::vector<std::string> Take() { return std::move(sentences_); }

 private:
  std::vector<std::string> sentences_;
};

void CheckPages(const Database& database, Report* report) {
  Statement check = database.Prepare("PRAGMA integrity_check(20)");
  while (check.Step()) {
    if (const std::string line = check.Text(0); line != "ok") {
      report->Add(database.file() + " is damaged: " + line.substr(0, line.find('\n')));
    }
  }
}

// The maps whose entries can be read; errors in the others are reported.
std::vector<MapInfo> ReadableMaps(const Database& database, Report* report) {
  std::vector<std::uint64_t> keys;
  report->Try([&] {
    Statement query = database.Prepare("SELECT key FROM maps ORDER BY key");
    while (query.Step()) keys.push_back(static_cast<std::uint64_t>(query.Integer(0)));
  });
  std::vector<MapInfo> maps;
  std::uint64_t next_key = 1;
  for (const std::uint64_t key : keys) {
    report->Try([&] {
      if (auto info = ReadMapRow(database, key)) maps.push_back(std::move(*info));
    });
    next_key = std::max(next_key, key + 1);
  }
  report->Try([&] {
    const LibraryRow library = ReadLibraryRow(database);
    if (library.map_count != keys.size()) {
      report->Add(database.file() + " is damaged: its first entry gives " +
                  std::to_string(library.map_count) + " maps but " + std::to_string(keys.size()) +
                  " are there");
    }
    if (library.next_key < next_key)
      report->Add(database.file() + " is damaged: the key for the next map is already used");
  });
  return maps;
}

void CheckThumbnails(const Database& database, const MapInfo& info) {
  const std::vector<engine::KeyFrameThumbnail> thumbnails = ReadThumbnails(database, info);
  const std::vector<StoredKeyFrame> keyframes = ReadParts(database, info).keyframes;
  for (std::size_t i = 0; i < thumbnails.size(); ++i) {
    if (thumbnails[i].keyframe != keyframes[i].keyframe.id)
      throw Error("its thumbnails belong to other keyframes");
  }
}

void CheckWords(const Database& database, const MapInfo& info) {
  const std::vector<engine::KeyFrameWords> words = ReadWords(database, info);
  const std::vector<StoredKeyFrame> keyframes = ReadParts(database, info).keyframes;
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (words[i].keyframe != keyframes[i].keyframe.id) throw Error("its words belong to other keyframes");
  }
}

void CheckBlocks(const Database& database, const MapInfo& info) {
  for (const std::string_view part : kPartsInBlocks) {
    const Bytes column = ReadPart(database, info.key, part);
    if (ReadPart(database, info.key, BlockChecksOf(part)) != EncodeBlockChecks(info.key, column))
      throw Error("the checksums of the blocks of its " + std::string(part) + " do not match");
  }
}

// Runs `check` and reports what it throws as one about the map.
void TryMap(const Database& database, const MapInfo& info, Report* report,
            const std::function<void()>& check) {
  report->Try([&] { WithMapContext(database, info, check); });
}

void CheckScene(const Database& database, const MapInfo& info, const SceneTools& scenes, Report* report) {
  const ScenePart part = ReadScenePart(database, info.key);
  SceneRecord scene{part.text, {}};
  for (const std::string& id : part.asset_ids) {
    try {
      scene.assets.push_back(ReadAsset(database, id));
    } catch (const Error&) {
      continue;  // CheckAssets reports it.
    }
  }
  std::vector<std::string> problems;
  scenes.read(scene, &problems);
  for (const std::string& problem : problems)
    TryMap(database, info, report, [&] { throw Error("its content: " + problem); });
}

void CheckMap(const Database& database, const MapInfo& info, int threads, const SceneTools& scenes,
              std::set<std::string>* wanted_assets, Report* report) {
  report->Try(
      [&] { WithMapContext(database, info, [&] { ReadSnapshot(database, info, MakeSizesOnly, threads); }); });
  report->Try([&] {
    WithMapContext(database, info, [&] {
      const ScenePart scene = ReadScenePart(database, info.key);
      wanted_assets->insert(scene.asset_ids.begin(), scene.asset_ids.end());
      if (scenes.read) CheckScene(database, info, scenes, report);
    });
  });
  TryMap(database, info, report, [&] {
    const std::optional<HistoryPart> history = ReadHistory(database, info.key);
    if (history) wanted_assets->insert(history->changes.asset_ids.begin(), history->changes.asset_ids.end());
  });
  TryMap(database, info, report, [&] { ReadMesh(database, info.key); });
  if (SchemaVersion(database) >= kBlockChecksSince)
    TryMap(database, info, report, [&] { CheckBlocks(database, info); });
  if (SchemaVersion(database) >= kThumbnailsSince) {
    TryMap(database, info, report, [&] { CheckThumbnails(database, info); });
  }
  if (SchemaVersion(database) >= kWordsSince) {
    TryMap(database, info, report, [&] { CheckWords(database, info); });
  }
  report->Try([&] {
    Statement count = database.Prepare("SELECT count(*) FROM pictures WHERE map_key = ?");
    count.Bind(1, static_cast<std::int64_t>(info.key));
    if (count.Step() && static_cast<std::uint64_t>(count.Integer(0)) != info.keyframes) {
      report->Add(database.file() + ": map '" + info.name + "' (" + std::to_string(info.key) + "): it has " +
                  std::to_string(count.Integer(0)) + " images for " + std::to_string(info.keyframes) +
                  " keyframes");
    }
  });
}

void CheckSceneAssets(const Database& database, const std::set<std::string>& ids, Report* report) {
  for (const std::string& id : ids) {
    try {
      ReadAsset(database, id);
    } catch (const Error& error) {
      const std::string what = error.what();
      report->Add(what.starts_with(database.file()) ? what : database.file() + ": " + what);
    }
  }
}

// Checks the assets that scenes want, and all others.
void CheckAssets(const Database& database, const std::set<std::string>& wanted, Report* report) {
  std::set<std::string> ids = wanted;
  report->Try([&] {
    Statement query = database.Prepare("SELECT id FROM assets");
    while (query.Step()) ids.insert(query.Text(0));
  });
  CheckSceneAssets(database, ids, report);
}

// Reports rows whose map does not exist.
void CheckStrays(const Database& database, Report* report) {
  std::vector<const char*> tables = {"parts", "pictures"};
  if (SchemaVersion(database) >= kThumbnailsSince) tables.push_back("thumbnails");
  if (SchemaVersion(database) >= kWordsSince) tables.push_back("words");
  for (const char* table : tables) {
    report->Try([&] {
      const std::int64_t strays = database.Number(std::string("SELECT count(*) FROM ") + table +
                                                  " WHERE map_key NOT IN (SELECT key FROM maps)");
      if (strays != 0) {
        report->Add(database.file() + " is damaged: " + std::to_string(strays) + " rows of its table '" +
                    table + "' belong to no map");
      }
    });
  }
}

// Reports tours that are damaged or stop at a map that does not exist.
void CheckTours(const Database& database, Report* report) {
  report->Try([&] {
    std::vector<std::string> problems;
    for (const Tour& tour : ReadTours(database, &problems)) {
      for (const std::uint64_t stop : tour.stops) {
        Statement map = database.Prepare("SELECT 1 FROM maps WHERE key = ?");
        if (map.Bind(1, static_cast<std::int64_t>(stop)).Step()) continue;
        problems.push_back(database.file() + " is damaged: the tour '" + tour.name + "' stops at the map " +
                           std::to_string(stop) + ", which does not exist");
      }
    }
    for (std::string& problem : problems) report->Add(std::move(problem));
  });
}

}  // namespace

std::vector<std::string> VerifyAll(const Database& database, int threads, const SceneTools& scenes) {
  Report report;
  report.Try([&] { CheckPages(database, &report); });
  const std::vector<MapInfo> maps = ReadableMaps(database, &report);
  std::set<std::string> wanted_assets;
  for (const MapInfo& info : maps) CheckMap(database, info, threads, scenes, &wanted_assets, &report);
  CheckAssets(database, wanted_assets, &report);
  CheckStrays(database, &report);
  report.Try([&] { ReadLenses(database); });
  CheckTours(database, &report);
  return report.Take();
}

std::vector<std::string> VerifyMap(const Database& database, const MapInfo& info, int threads,
                                   const SceneTools& scenes) {
  Report report;
  std::set<std::string> wanted_assets;
  CheckMap(database, info, threads, scenes, &wanted_assets, &report);
  CheckSceneAssets(database, wanted_assets, &report);
  return report.Take();
}

std::vector<std::string> VerifyScene(const Database& database, const MapInfo& info,
                                     const SceneTools& scenes) {
  Report report;
  TryMap(database, info, &report, [&] {
    const ScenePart scene = ReadScenePart(database, info.key);
    CheckSceneAssets(database, {scene.asset_ids.begin(), scene.asset_ids.end()}, &report);
    if (scenes.read) CheckScene(database, info, scenes, &report);
  });
  return report.Take();
}

std::vector<std::string> SignpostsToNoMap(const Database& database, const SceneTools& scenes) {
  Report report, ignored;
  if (!scenes.retarget) return {};
  const std::vector<MapInfo> maps = ReadableMaps(database, &ignored);
  for (const MapInfo& info : maps) {
    ignored.Try([&] {
      const std::string text = ReadScenePart(database, info.key).text;
      if (text.empty()) return;
      scenes.retarget(text, [&](const std::string& signpost, const SignpostTarget& target) {
        if (!LeadsToNoMap(target, maps)) return std::optional<SignpostTarget>();
        report.Add(database.file() + ": map '" + info.name + "' (" + std::to_string(info.key) +
                   "): the signpost '" + signpost + "' leads to the map '" + target.map +
                   "', which does not exist");
        return std::optional<SignpostTarget>();
      });
    });
  }
  return report.Take();
}

}  // namespace docent::maps
