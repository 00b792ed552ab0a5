// SPDX-License-Identifier: Apache-2.0
#include "maps/maintenance/recovery.h"

#include <algorithm>
#include <functional>
#include <set>
#include <system_error>
#include <unordered_set>
#include <utility>

#include "engine/base/error.h"
#include "engine/vision/image_pyramid.h"
#include "maps/library/library.h"
#include "maps/maintenance/salvaged_rows.h"
#include "maps/storage/checksum.h"
#include "maps/storage/database.h"
#include "maps/storage/history_rows.h"
#include "maps/storage/panorama_codec.h"
#include "maps/storage/rows.h"
#include "maps/storage/schema.h"
#include "maps/storage/snapshot_reader.h"

namespace docent::maps {

namespace {

namespace fs = std::filesystem;

// The sentences about what is lost.
class Losses {
 public:
  void Add(const std::string& where, std::string what) {
    // The advice after the semicolon is to recover the file, which is what happens here.
    what.erase(std::min(what.size(), what.find(';')));
    sentences_.push_back(where + ": " + what);
  }
  bool Try(const std::string& where, const std::function<void()>& step) {
    try {
      step();
      return true;
    } catch (const Error& error) {
      Add(where, error.what());
      return false;
    }
  }
  std::vector<std::string>* sentences() { return &sentences_; }

 private:
  std::vector<std::string> sentences_;
};

// Puts one map together from its rows.
class MapSalvage {
 public:
  MapSalvage(const SalvagedRows& rows, const SceneTools& scenes, std::uint64_t key, Losses* losses)
      : rows_(rows), scenes_(scenes), key_(key), losses_(losses) {}

  // Empty when nothing of it can be read.
  std::optional<MapRecord> Read() {
    MapRecord record;
    record.key = key_;
    record.name = "map " + std::to_string(key_);
    record.policy = Policy::kReadOnly;  // Prevents accidental changes if the map's own policy is lost.
    name_ = record.name;
    Try([&] {
      info_ = rows_.Map(key_);
      record.name = name_ = info_->name;
      record.policy = info_->policy;
      record.bounds = info_->bounds;
    });
    auto map = std::make_shared<engine::MapSnapshot>();
    Try([&] { *map = ReadMap(); });
    record.snapshot = map;
    auto scene = std::make_shared<SceneRecord>();
    Try([&] { *scene = ReadScene(); });
    record.scene = scene;
    if (rows_.HasPart(key_, "history") && !scene->text.empty()) {
      // Without it, the map is as it was.
      losses_->Try(where(), [&] { record.history = ReadHistory(*scene); });
    }
    if (record.policy == Policy::kBounded && !record.bounds) record.policy = Policy::kReadOnly;
    const bool was_empty = info_ && info_->keyframes == 0;
    if (map->keyframes.empty() && scene->text.empty() && !was_empty) return std::nullopt;
    return record;
  }
  bool complete() const { return complete_; }

 private:
  std::string where() const { return "map '" + name_ + "'"; }
  void Lose(const std::string& what) {
    complete_ = false;
    losses_->Add(where(), what);
  }
  bool Try(const std::function<void()>& step) {
    const bool done = losses_->Try(where(), step);
    complete_ = complete_ && done;
    return done;
  }

  // Decodes a table, or the confirmed records of a damaged one. `count` is the number of records that the
  // map's entry gives.
  template <typename Decode>
  auto ReadTable(const EnvelopeKind& kind, std::string_view part, std::uint64_t MapInfo::*count,
                 const Decode& decode) {
    decltype(decode(std::span<const std::uint8_t>())) table;
    try {
      rows_.Part(key_, part, [&](std::span<const std::uint8_t> bytes, bool current) {
        table = decode(bytes);
        if (!current && info_ && table.size() != (*info_).*count)
          throw Error(std::string(kind.name) + " is of another state of the map");
      });
      return table;
    } catch (const Error& error) {
      Bytes records;
      try {
        records = rows_.ConfirmedRecordsOf(key_, part, kind);
        table = decode(std::span<const std::uint8_t>(records));
      } catch (const Error&) {
        table.clear();
      }
      if (table.empty()) throw Error(error.what());
      Lose(std::string(kind.name) + " is damaged: " + std::to_string(table.size()) +
           (info_ ? " of its " + std::to_string((*info_).*count) : std::string()) + " records could be read");
      return table;
    }
  }

  engine::MapSnapshot ReadMap() {
    MapParts parts;
    CameraTable cameras;
    rows_.Part(key_, "cameras", [&](std::span<const std::uint8_t> bytes, bool) {
      cameras = CheckedCameras(key_, bytes, static_cast<std::int64_t>(rows_.file_bytes()));
    });
    parts.keyframes = ReadTable(kKeyFrameTableKind, "keyframes", &MapInfo::keyframes,
                                [&](const auto& bytes) { return DecodeKeyFrames(key_, bytes, cameras); });
    Try([&] {
      parts.points = ReadTable(kPointTableKind, "points", &MapInfo::points,
                               [&](const auto& bytes) { return DecodePoints(key_, bytes); });
    });
    const bool observed = Try([&] {
      parts.observations = ReadTable(kObservationTableKind, "observations", &MapInfo::observations,
                                     [&](const auto& bytes) { return DecodeObservations(key_, bytes); });
    });
    if (rows_.format() >= kPanoramasSince) {
      Try([&] {
        rows_.Part(key_, "panoramas", [&](std::span<const std::uint8_t> bytes, bool) {
          MapParts with_panoramas = parts;
          DecodePanoramas(key_, bytes, &with_panoramas,
                          complete_ ? MissingMember::kRefuse : MissingMember::kLeaveOut);
          parts = std::move(with_panoramas);
        });
      });
    }
    engine::MapSnapshot map;
    ReadImages(parts, &map);
    if (map.keyframes.empty() && !parts.keyframes.empty()) throw Error("none of its images could be read");
    Prune(parts, &map);
    if (!observed) ObserveFromSources(&map);
    TakeNumbers(parts, &map);
    if (const std::string problem = engine::Validate(map); !problem.empty()) throw Error(problem);
    return map;
  }

  // Keeps the keyframes whose images can be read.
  void ReadImages(const MapParts& parts, engine::MapSnapshot* map) {
    for (const StoredKeyFrame& stored : parts.keyframes) {
      const bool read = losses_->Try(where() + ", keyframe " + std::to_string(stored.keyframe.id), [&] {
        engine::KeyFrame keyframe = stored.keyframe;
        keyframe.features = MakeSizesOnly(rows_.Image(key_, stored));
        map->keyframes.push_back(std::move(keyframe));
      });
      complete_ = complete_ && read;
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
    for (engine::KeyFrame& keyframe : map->keyframes) {
      if (!map->FindPanorama(keyframe.panorama)) keyframe.panorama = engine::kNoId;
    }
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

  // Each point was seen at least where its patch is.
  static void ObserveFromSources(engine::MapSnapshot* map) {
    for (const engine::MapPoint& point : map->points) {
      const engine::KeyFrame* const source = map->FindKeyFrame(point.source_keyframe);
      const Eigen::Vector2d pixel =
          engine::LevelZeroFromLevel(point.source_pixel.cast<double>(), point.source_level);
      if (source != nullptr && source->camera->IsInside(pixel))
        map->observations.push_back({source->id, point.id, pixel.cast<float>(), point.source_level});
    }
    std::sort(map->observations.begin(), map->observations.end(), [](const auto& a, const auto& b) {
      return std::pair(a.keyframe, a.point) < std::pair(b.keyframe, b.point);
    });
  }

  void TakeNumbers(const MapParts& parts, engine::MapSnapshot* map) const {
    map->next_keyframe = parts.keyframes.empty() ? 0 : parts.keyframes.back().keyframe.id + 1;
    map->next_point = parts.points.empty() ? 0 : parts.points.back().id + 1;
    if (!info_) return;
    map->revision = info_->revision;
    map->next_keyframe = std::max(map->next_keyframe, info_->next_keyframe);
    map->next_point = std::max(map->next_point, info_->next_point);
  }

  SceneRecord ReadScene() {
    ScenePart part;
    rows_.Part(key_, "scene",
               [&](std::span<const std::uint8_t> bytes, bool) { part = DecodeScene(key_, bytes); });
    SceneRecord scene{std::move(part.text), {}};
    bool all = true;
    for (const std::string& id : part.asset_ids)
      all = Try([&] { scene.assets.push_back(rows_.Asset(id)); }) && all;
    if (!scenes_.read) return all ? scene : SceneRecord{};
    std::vector<std::string> problems;
    scene = scenes_.read(scene, &problems);
    for (const std::string& problem : problems) Lose(problem);
    return scene;
  }

  std::shared_ptr<const SceneRecord> ReadHistory(const SceneRecord& scene) const {
    HistoryPart part;
    rows_.Part(key_, "history", [&](std::span<const std::uint8_t> bytes, bool) {
      part = DecodeHistory(key_, bytes);
      if (part.scene != SceneTextChecksum(scene.text))
        throw Error("earlier changes of its content cannot be undone");
    });
    auto history = std::make_shared<SceneRecord>();
    history->text = std::move(part.changes.text);
    for (const std::string& id : part.changes.asset_ids) history->assets.push_back(rows_.Asset(id));
    return history;
  }

  const SalvagedRows& rows_;
  const SceneTools& scenes_;
  const std::uint64_t key_;
  Losses* const losses_;
  std::string name_;
  std::optional<MapInfo> info_;
  bool complete_ = true;
};

// The file with what its log adds, as a copy that is removed at the end; the file itself if it has no log or
// that cannot be read.
class FileToSalvage {
 public:
  FileToSalvage(const fs::path& file, const fs::path& target, Losses* losses) : file_(file), copy_(target) {
    copy_ += ".part";
    std::error_code error;
    const std::uintmax_t log = fs::file_size(fs::path(file).concat("-wal"), error);
    if (error || log == 0) return;
    fs::remove(copy_, error);
    is_made_ = true;
    copied_ = losses->Try("the log of " + file.string(), [&] { Database::OpenDamaged(file).CopyTo(copy_); });
  }
  ~FileToSalvage() {
    if (!is_made_) return;
    std::error_code error;
    fs::remove(copy_, error);
  }
  FileToSalvage(const FileToSalvage&) = delete;
  FileToSalvage& operator=(const FileToSalvage&) = delete;
  const fs::path& path() const { return copied_ ? copy_ : file_; }

 private:
  fs::path file_, copy_;
  bool is_made_ = false, copied_ = false;
};

// Signposts to maps that are lost lead nowhere.
void CutLinks(const std::set<std::uint64_t>& keys, const SceneTools& scenes, MapRecord* record,
              Losses* losses) {
  if (!scenes.retarget || record->scene->text.empty()) return;
  const auto text =
      scenes.retarget(record->scene->text, [&](const std::string& signpost, const SignpostTarget& target) {
        std::optional<SignpostTarget> changed;
        if (target.key == 0 || keys.contains(target.key)) return changed;
        losses->Add("map '" + record->name + "'", "the signpost '" + signpost + "' leads to the map '" +
                                                      target.map + "', which could not be recovered");
        changed.emplace();
        return changed;
      });
  if (!text) return;
  auto scene = std::make_shared<SceneRecord>(*record->scene);
  scene->text = *text;
  record->scene = std::move(scene);
}

class Salvage {
 public:
  Salvage(const SalvagedRows& rows, const SceneTools& scenes, Losses* losses)
      : rows_(rows), scenes_(scenes), losses_(losses) {}

  void Run(Library* target) {
    constexpr std::uint64_t kLargestKey = std::uint64_t{1} << 62;
    const std::set<std::uint64_t> keys = rows_.MapKeys();
    std::uint64_t largest = 0;
    for (const std::uint64_t key : keys) {
      if (key < kLargestKey) largest = std::max(largest, key);
    }
    if (largest > 0) target->ReserveKeys(largest);
    // They are saved together with the first recovered map.
    lenses_ = rows_.Lenses(losses_->sentences());
    for (const std::uint64_t key : keys) {
      if (key >= kLargestKey) continue;
      MapSalvage map(rows_, scenes_, key, losses_);
      if (auto record = map.Read()) Save(std::move(*record), map.complete(), target);
    }
    CutLostLinks(target);
    SaveTours(target);
  }
  const Recovery& recovery() const { return recovery_; }

 private:
  void Save(MapRecord record, bool complete, Library* target) {
    const std::string name = record.name;
    // A map whose name was lost may have got a name that another map has.
    for (const MapInfo& info : target->List()) {
      if (info.name == record.name) record.name += " (recovered)";
    }
    record.lenses = lenses_;
    if (!losses_->Try("map '" + name + "'", [&] { target->Save(record); })) return;
    lenses_.clear();
    ++(complete ? recovery_.maps_complete : recovery_.maps_partial);
  }

  void CutLostLinks(Library* target) {
    if (!scenes_.retarget) return;
    std::set<std::uint64_t> keys;
    for (const MapInfo& info : target->List()) keys.insert(info.key);
    for (const MapInfo& info : target->List()) {
      MapRecord record;
      record.key = info.key;
      record.name = info.name;
      const auto before = std::make_shared<const SceneRecord>(target->LoadScene(info.key));
      record.scene = before;
      CutLinks(keys, scenes_, &record, losses_);
      if (record.scene == before) continue;
      const Policy policy = info.policy;
      if (policy == Policy::kReadOnly) target->SetPolicy(info.key, Policy::kAugmentOnly);
      target->Save(record);
      if (policy == Policy::kReadOnly) target->SetPolicy(info.key, policy);
    }
  }

  // Tours go on without the maps that are lost.
  void SaveTours(Library* target) {
    std::set<std::uint64_t> keys;
    for (const MapInfo& info : target->List()) keys.insert(info.key);
    for (Tour& tour : rows_.Tours(losses_->sentences())) {
      const std::string where = "the tour '" + tour.name + "'";
      const std::size_t lost =
          std::erase_if(tour.stops, [&](std::uint64_t stop) { return !keys.contains(stop); });
      if (lost > 0) losses_->Add(where, std::to_string(lost) + " of its stops could not be recovered");
      losses_->Try(where, [&] {
        target->ChangeTours([&](std::vector<Tour>* tours) { tours->push_back(std::move(tour)); });
      });
    }
  }

  const SalvagedRows& rows_;
  const SceneTools& scenes_;
  Losses* const losses_;
  std::vector<StoredLens> lenses_;  // Not yet saved with a map.
  Recovery recovery_;
};

}  // namespace

Recovery Recover(const fs::path& damaged, const fs::path& target, const SceneTools& scenes) {
  std::error_code error;
  if (fs::exists(target, error))
    throw Error(target.string() + " exists already; choose a new file name for the recovered maps");
  if (!fs::is_regular_file(damaged, error))
    throw Error(damaged.string() + " does not exist or is not a file");
  Losses losses;
  const FileToSalvage file(damaged, target, &losses);
  const SalvagedRows rows(file.path());
  Recovery recovery;
  try {
    Library library = Library::Open(target, Access::kReadWrite, CreateIfMissing::kYes);
    Salvage salvage(rows, scenes, &losses);
    salvage.Run(&library);
    recovery = salvage.recovery();
    recovery.problems = std::move(*losses.sentences());
    if (recovery.maps_complete + recovery.maps_partial == 0) {
      throw Error("nothing could be recovered from " + damaged.string() +
                  (recovery.problems.empty() ? std::string() : ": " + recovery.problems.front()));
    }
  } catch (const Error&) {
    for (const char* suffix : {"", "-wal", "-shm", "-journal"}) fs::remove(target.string() + suffix, error);
    throw;
  }
  return recovery;
}

}  // namespace docent::maps
