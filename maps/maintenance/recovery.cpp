// SPDX-License-Identifier: Apache-2.0
#include "maps/maintenance/recovery.h"

#include <algorithm>
#include <functional>
#include <set>
#include <system_error>
#include <unordered_set>
#include <utility>

#include "engine/base/error.h"
#include "maps/library/library.h"
#include "maps/storage/database.h"
#include "maps/storage/panorama_codec.h"
#include "maps/storage/rows.h"
#include "maps/storage/schema.h"
#include "maps/storage/snapshot_reader.h"

namespace docent::maps {

namespace {

// Reads a file without trusting any of it. Every step may fail; failures are recorded and the affected data
// is left out.
class Salvage {
 public:
  explicit Salvage(const std::filesystem::path& path)
      : database_(Database::OpenDamaged(path)), transaction_(database_, Transaction::Kind::kRead) {
    if (database_.Number("PRAGMA application_id") != kApplicationId)
      throw Error(database_.file() + " is not a library of maps");
  }

  void Run(Library* target) {
    // They are saved together with the first recovered map.
    Try("the lenses of cameras", [&] { lenses_ = ReadLenses(database_); });
    for (const std::uint64_t key : Keys()) {
      complete_ = true;
      MapRecord record;
      record.name = "map " + std::to_string(key);
      const auto where = [&] { return "map '" + record.name + "'"; };
      record.policy = Policy::kReadOnly;  // Prevents accidental changes if the map's own policy is lost.
      if (!Try(where(), [&] { ReadEntry(key, &record); })) complete_ = false;
      if (!Try(where(), [&] { record.snapshot = ReadMap(key, where()); })) continue;
      auto scene = std::make_shared<SceneRecord>();
      if (!Try(where(), [&] { *scene = ReadScene(key); })) {
        complete_ = false;
        *scene = {};
      }
      record.scene = std::move(scene);
      Save(std::move(record), target);
    }
  }
  Recovery Take() { return std::move(recovery_); }

 private:
  bool Try(const std::string& where, const std::function<void()>& step) {
    try {
      step();
      return true;
    } catch (const Error& error) {
      std::string what = error.what();
      // The advice after the semicolon is to recover the file, which is what happens here.
      what.erase(std::min(what.size(), what.find(';')));
      recovery_.problems.push_back(where + ": " + what);
      return false;
    }
  }

  // The maps that appear in any table.
  std::set<std::uint64_t> Keys() {
    std::set<std::uint64_t> keys;
    for (const char* sql : {"SELECT key FROM maps", "SELECT map_key FROM parts"}) {
      Try("the list of maps", [&] {
        Statement query = database_.Prepare(sql);
        while (query.Step()) keys.insert(static_cast<std::uint64_t>(query.Integer(0)));
      });
    }
    return keys;
  }

  void ReadEntry(std::uint64_t key, MapRecord* record) {
    const std::optional<MapInfo> info = ReadMapRow(database_, key);
    if (!info) throw Error("its entry is missing");
    record->name = info->name;
    record->policy = info->policy;
    record->bounds = info->bounds;
    info_ = info;
  }

  std::shared_ptr<const engine::MapSnapshot> ReadMap(std::uint64_t key, const std::string& where) {
    MapParts parts;
    const CameraTable cameras = ReadCameras(database_, key);
    parts.keyframes = DecodeKeyFrames(key, ReadPart(database_, key, "keyframes"), cameras);
    parts.points = DecodePoints(key, ReadPart(database_, key, "points"));
    parts.observations = DecodeObservations(key, ReadPart(database_, key, "observations"));
    MapParts with_panoramas = parts;
    const bool first_format = SchemaVersion(database_) < kPanoramasSince;
    if (first_format ||
        Try(where, [&] { DecodePanoramas(key, ReadPart(database_, key, "panoramas"), &with_panoramas); })) {
      parts = std::move(with_panoramas);
    } else {
      complete_ = false;
    }
    auto map = std::make_shared<engine::MapSnapshot>();
    ReadImages(key, where, &parts, map.get());
    Prune(parts, map.get());
    if (info_ && info_->key == key) {
      map->revision = info_->revision;
      map->next_keyframe = info_->next_keyframe;
      map->next_point = info_->next_point;
    } else {
      map->next_keyframe = parts.keyframes.empty() ? 0 : parts.keyframes.back().keyframe.id + 1;
      map->next_point = parts.points.empty() ? 0 : parts.points.back().id + 1;
    }
    if (const std::string problem = engine::Validate(*map); !problem.empty()) throw Error(problem);
    if (map->keyframes.empty() && !parts.keyframes.empty()) throw Error("none of its images could be read");
    return map;
  }

  // Keeps the keyframes whose images can be read.
  void ReadImages(std::uint64_t key, const std::string& where, MapParts* parts, engine::MapSnapshot* map) {
    for (const StoredKeyFrame& stored : parts->keyframes) {
      const bool there = Try(where + ", keyframe " + std::to_string(stored.keyframe.id), [&] {
        maps::ReadImages(database_, key, {stored}, [&](std::size_t, std::span<const std::uint8_t> bytes) {
          map->keyframes.push_back(stored.keyframe);
          map->keyframes.back().features = MakeSizesOnly(DecodeImage(key, stored, bytes));
        });
      });
      if (there) continue;
      complete_ = false;
      std::erase_if(map->keyframes, [](const engine::KeyFrame& keyframe) { return !keyframe.features; });
    }
  }

  // Leaves out everything that refers to lost data.
  static void Prune(const MapParts& parts, engine::MapSnapshot* map) {
    map->next_panorama = parts.next_panorama;
    for (const engine::PanoramaMap& panorama : parts.panoramas) {
      if (map->FindKeyFrame(panorama.reference)) map->panoramas.push_back(panorama);
    }
    std::erase_if(map->keyframes, [&](const engine::KeyFrame& keyframe) {
      return keyframe.kind == engine::KeyFrameKind::kPanorama && !map->FindPanorama(keyframe.panorama);
    });
    // A point all of whose observations were lost with their keyframes cannot be kept.
    std::unordered_set<engine::MapPointId> there, lost;
    for (const engine::Observation& observation : parts.observations) {
      if (!map->FindKeyFrame(observation.keyframe)) lost.insert(observation.point);
    }
    for (const engine::Observation& observation : parts.observations) {
      if (map->FindKeyFrame(observation.keyframe)) lost.erase(observation.point);
    }
    for (const engine::MapPoint& point : parts.points) {
      if (!map->FindKeyFrame(point.source_keyframe) || lost.contains(point.id)) continue;
      if (point.infinite() && !map->FindPanorama(point.panorama)) continue;
      map->points.push_back(point);
      there.insert(point.id);
    }
    for (const engine::Observation& observation : parts.observations) {
      if (map->FindKeyFrame(observation.keyframe) && there.contains(observation.point))
        map->observations.push_back(observation);
    }
  }

  SceneRecord ReadScene(std::uint64_t key) {
    ScenePart part = ReadScenePart(database_, key);
    SceneRecord scene{std::move(part.text), {}};
    for (const std::string& id : part.asset_ids) scene.assets.push_back(ReadAsset(database_, id));
    return scene;
  }

  void Save(MapRecord record, Library* target) {
    const std::string name = record.name;
    // A map whose name was lost may have got a name that another map has.
    for (const MapInfo& info : target->List()) {
      if (info.name == record.name) record.name += " (recovered)";
    }
    if (record.policy == Policy::kBounded && !record.bounds) record.policy = Policy::kReadOnly;
    record.key = target->NewKey();
    record.lenses = std::exchange(lenses_, {});
    if (!Try("map '" + name + "'", [&] { target->Save(record); })) return;
    ++(complete_ ? recovery_.maps_complete : recovery_.maps_partial);
  }

  Database database_;
  Transaction transaction_;
  std::optional<MapInfo> info_;     // The last entry that was read.
  bool complete_ = true;            // Whether the current map is complete so far.
  std::vector<StoredLens> lenses_;  // Not yet saved with a map.
  Recovery recovery_;
};

}  // namespace

Recovery Recover(const std::filesystem::path& damaged, const std::filesystem::path& target) {
  std::error_code error;
  if (std::filesystem::exists(target, error))
    throw Error(target.string() + " exists already; choose a new file name for the recovered maps");
  Salvage salvage(damaged);
  Recovery recovery;
  try {
    Library library = Library::Open(target, Access::kReadWrite, CreateIfMissing::kYes);
    salvage.Run(&library);
    recovery = salvage.Take();
    if (recovery.maps_complete + recovery.maps_partial == 0) {
      throw Error("nothing could be recovered from " + damaged.string() +
                  (recovery.problems.empty() ? std::string() : ": " + recovery.problems.front()));
    }
  } catch (const Error&) {
    for (const char* suffix : {"", "-wal", "-shm", "-journal"})
      std::filesystem::remove(target.string() + suffix, error);
    throw;
  }
  return recovery;
}

}  // namespace docent::maps
