// SPDX-License-Identifier: Apache-2.0
#include "maps/library/library.h"

#include <algorithm>
#include <limits>
#include <mutex>
#include <thread>
#include <unordered_set>
#include <utility>

#include "engine/base/error.h"
#include "engine/vision/features.h"
#include "maps/index/thumbnail_rows.h"
#include "maps/index/word_rows.h"
#include "maps/library/migration.h"
#include "maps/library/signposts.h"
#include "maps/library/verify.h"
#include "maps/storage/database.h"
#include "maps/storage/history_rows.h"
#include "maps/storage/mesh_rows.h"
#include "maps/storage/rows.h"
#include "maps/storage/schema.h"
#include "maps/storage/snapshot_reader.h"

namespace docent::maps {

std::string ValidateMapName(const std::string& name) {
  const bool printable = std::none_of(
      name.begin(), name.end(), [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7F; });
  if (!name.empty() && name.size() <= kMaxMapNameBytes && printable) return "";
  return "a map's name must have 1 to " + std::to_string(kMaxMapNameBytes) +
         " bytes and no control characters";
}

namespace {

// Bundle adjustment may move a keyframe slightly after it was accepted inside the bounds and before it is
// saved.
constexpr double kBoundsSlack = 0.05;  // Ratio of the bounds' diagonal.

void CheckName(const std::string& name) {
  if (const std::string problem = ValidateMapName(name); !problem.empty()) throw Error(problem);
}

MapParts PartsOf(const engine::MapSnapshot& snapshot) {
  return {MakeStoredKeyFrames(snapshot), snapshot.points, snapshot.observations, snapshot.panoramas,
          snapshot.next_panorama};
}

ScenePart PartOf(const SceneRecord& scene) {
  ScenePart part{scene.text, {}};
  for (const AssetRecord& asset : scene.assets) {
    // Several entities of a scene may use the same asset.
    if (std::find(part.asset_ids.begin(), part.asset_ids.end(), asset.id) == part.asset_ids.end()) {
      part.asset_ids.push_back(asset.id);
    }
  }
  return part;
}

std::optional<Bounds> BoundsOf(const MapParts& parts) {
  engine::MapSnapshot map;
  for (const StoredKeyFrame& stored : parts.keyframes) map.keyframes.push_back(stored.keyframe);
  map.points = parts.points;
  const std::optional<Bounds> bounds = ComputeBounds(map);
  if (!bounds) throw Error("a map without keyframes cannot be bounded; build the map first");
  return bounds;
}

void CheckNewKeyFramesInside(const MapInfo& info, const MapParts& stored, const MapParts& wanted) {
  if (!info.bounds) throw Error("its policy is bounded but it has no bounds; set the policy again");
  std::unordered_set<engine::KeyFrameId> known;
  for (const StoredKeyFrame& keyframe : stored.keyframes) known.insert(keyframe.keyframe.id);
  const Bounds allowed = Expanded(*info.bounds, kBoundsSlack);
  for (const StoredKeyFrame& keyframe : wanted.keyframes) {
    if (known.contains(keyframe.keyframe.id) ||
        KeyFrameAllowed(Policy::kBounded, allowed, keyframe.keyframe.camera_from_map.OriginInSource())) {
      continue;
    }
    throw Error("its policy is bounded, and keyframe " + std::to_string(keyframe.keyframe.id) +
                " lies outside its bounds; nothing was saved");
  }
}

[[noreturn]] void Refuse(Policy policy, const std::string& what) {
  throw Error(std::string("its policy is ") + ToString(policy) + ", so " + what +
              "; change its policy first");
}

WallTime SystemTime() {
  return std::chrono::time_point_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now());
}

Database OpenDatabase(const std::filesystem::path& path, Access access, CreateIfMissing create,
                      const SceneTools& scenes) {
  if (access == Access::kReadOnly) {
    Database database = Database::OpenReadOnly(path);
    CheckIsLibrary(database);
    return database;
  }
  Database database = Database::OpenReadWrite(path, create == CreateIfMissing::kYes);
  if (create == CreateIfMissing::kYes && IsBlank(database)) CreateSchema(database);
  CheckIsLibrary(database);
  database.StartWriting();
  UpgradeFormat(database, scenes);
  return database;
}

}  // namespace

class Library::Impl {
 public:
  Impl(Database database, LibraryOptions options)
      : database_(std::move(database)), options_(std::move(options)) {
    if (!options_.clock) options_.clock = SystemTime;
    if (!options_.make_features) {
      options_.make_features = [](const cv::Mat& gray) { return engine::MakeFeatures(gray); };
    }
    if (options_.load_threads <= 0) {
      options_.load_threads = std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, 8);
    }
  }

  // Runs `body` in a read transaction, which sees one consistent state of the file.
  template <typename Body>
  auto Read(const Body& body) {
    std::scoped_lock lock(mutex_);
    database_.Refresh();
    Transaction transaction(database_, Transaction::Kind::kRead);
    return body();
  }

  // Runs `body` in a transaction and commits it if `body` returns that something changed.
  void Write(const std::function<bool()>& body) {
    std::scoped_lock lock(mutex_);
    if (database_.read_only()) throw Error(database_.file() + " was opened read-only and cannot be changed");
    Transaction transaction(database_, Transaction::Kind::kWrite);
    if (body()) transaction.Commit();
  }

  MapInfo Get(std::uint64_t key) const {
    if (auto info = ReadMapRow(database_, key)) return *info;
    throw Error(database_.file() + " has no map with the key " + std::to_string(key));
  }

  SceneRecord ReadScene(std::uint64_t key) const {
    ScenePart part = ReadScenePart(database_, key);
    SceneRecord scene{std::move(part.text), {}};
    for (const std::string& id : part.asset_ids) scene.assets.push_back(ReadAsset(database_, id));
    return scene;
  }

  SceneRecord ReadableScene(std::uint64_t key, std::vector<std::string>* problems) const {
    SceneRecord scene;
    try {
      ScenePart part = ReadScenePart(database_, key);
      scene.text = std::move(part.text);
      for (const std::string& id : part.asset_ids) {
        try {
          scene.assets.push_back(ReadAsset(database_, id));
        } catch (const Error& error) {
          problems->emplace_back(error.what());
        }
      }
    } catch (const Error& error) {
      problems->emplace_back(error.what());
    }
    return scene;
  }

  std::optional<SceneRecord> LoadHistory(std::uint64_t key) const {
    std::optional<HistoryPart> part = ReadHistory(database_, key);
    if (!part || part->scene != SceneChecksum(key)) return std::nullopt;
    SceneRecord history{std::move(part->changes.text), {}};
    for (const std::string& id : part->changes.asset_ids) history.assets.push_back(ReadAsset(database_, id));
    return history;
  }

  void CheckNameIsFree(const std::string& name, std::uint64_t key) const {
    const auto other = FindMapByName(database_, name);
    if (other && *other != key) throw Error("there is already a map named '" + name + "'");
  }

  void Create(const MapRecord& record) {
    CheckName(record.name);
    CheckNameIsFree(record.name, record.key);
    LibraryRow library = ReadLibraryRow(database_);
    if (record.key >= library.next_key) throw Error("its key was not issued by this library");
    ++library.map_count;
    WriteLibraryRow(database_, library);
    MapInfo info;
    info.key = record.key;
    info.name = record.name;
    info.policy = record.policy;
    info.created = info.modified = options_.clock();
    const engine::MapSnapshot nothing;
    const engine::MapSnapshot& snapshot = record.snapshot ? *record.snapshot : nothing;
    const MapParts parts = PartsOf(snapshot);
    info.bounds = record.bounds;
    if (info.policy == Policy::kBounded && !info.bounds) info.bounds = BoundsOf(parts);
    // The images come last, because the file's end is lost first: a map can do without some of them.
    WriteStructure(snapshot, parts, {}, &info);
    WriteScene(record.key, record.scene ? *record.scene : SceneRecord{});
    if (record.history && !record.history->text.empty()) StoreHistory(*record.history, record.key);
    WriteImages(database_, info.key, snapshot, parts.keyframes, {});
    WriteMapRow(database_, info);
  }

  // Returns whether something changed.
  bool Update(const MapRecord& record, MapInfo info) {
    bool changed = false;
    if (record.snapshot) changed |= UpdateStructure(*record.snapshot, &info);
    if (record.scene) changed |= UpdateScene(*record.scene, info);
    if (record.history) changed |= UpdateHistory(*record.history, info);
    if (!changed) return false;
    info.modified = options_.clock();
    WriteMapRow(database_, info);
    return true;
  }

  bool UpdateStructure(const engine::MapSnapshot& snapshot, MapInfo* info) {
    const MapParts stored = ReadParts(database_, *info);
    const MapParts wanted = PartsOf(snapshot);
    if (SameStructure(stored, wanted)) {
      const bool same_ids =
          info->next_keyframe == snapshot.next_keyframe && info->next_point == snapshot.next_point;
      if (same_ids || !MayChangeStructure(info->policy)) return false;
    }
    if (!MayChangeStructure(info->policy)) Refuse(info->policy, "its keyframes and points cannot be changed");
    if (info->policy == Policy::kBounded) CheckNewKeyFramesInside(*info, stored, wanted);
    WriteStructure(snapshot, wanted, stored.keyframes, info);
    WriteImages(database_, info->key, snapshot, wanted.keyframes, stored.keyframes);
    return true;
  }

  void WriteStructure(const engine::MapSnapshot& snapshot, const MapParts& parts,
                      const std::vector<StoredKeyFrame>& stored_before, MapInfo* info) {
    WriteParts(database_, info->key, parts);
    WriteThumbnails(database_, info->key, MakeThumbnails(snapshot));
    WriteWords(database_, info->key,
               engine::MakeWords(snapshot, UnchangedWords(database_, *info, stored_before, parts.keyframes)));
    info->revision = snapshot.revision;
    info->next_keyframe = snapshot.next_keyframe;
    info->next_point = snapshot.next_point;
    info->keyframes = parts.keyframes.size();
    info->points = parts.points.size();
    info->observations = parts.observations.size();
    RemoveMeshUnlessRight(database_, info->key, snapshot);
  }

  // Returns false if the map is gone, or the mesh was made of another state of it.
  bool StoreMesh(std::uint64_t key, const engine::MapMesh& mesh) {
    const std::optional<MapInfo> info = ReadMapRow(database_, key);
    if (!info) return false;
    bool is_right = false;
    WithMapContext(database_, *info, [&] {
      engine::MapSnapshot map;
      for (StoredKeyFrame& stored : ReadParts(database_, *info).keyframes)
        map.keyframes.push_back(std::move(stored.keyframe));
      if (engine::StateOf(mesh.keyframes, map) == engine::MeshState::kOutOfDate) return;
      WriteMesh(database_, key, mesh);
      is_right = true;
    });
    return is_right;
  }

  bool UpdateScene(const SceneRecord& scene, const MapInfo& info) {
    if (ReadScenePart(database_, info.key) == PartOf(scene)) return false;
    if (!MayChangeContent(info.policy)) Refuse(info.policy, "its content cannot be changed");
    WriteScene(info.key, scene);
    RemoveHistory(database_, info.key);  // It belongs to the scene before.
    RemoveUnusedAssets(database_);
    return true;
  }

  // Returns whether something changed.
  bool UpdateHistory(const SceneRecord& history, const MapInfo& info) {
    std::optional<HistoryPart> stored;
    try {
      stored = ReadHistory(database_, info.key);
    } catch (const Error&) {
      stored.emplace();  // A damaged one is replaced or removed.
    }
    const ScenePart changes = PartOf(history);
    if (stored ? stored->changes == changes && stored->scene == SceneChecksum(info.key)
               : changes.text.empty())
      return false;
    if (!MayChangeContent(info.policy)) Refuse(info.policy, "its undo history cannot be changed");
    if (changes.text.empty()) {
      RemoveHistory(database_, info.key);
    } else {
      StoreHistory(history, info.key);
    }
    RemoveUnusedAssets(database_);
    return true;
  }

  void StoreHistory(const SceneRecord& history, std::uint64_t key) {
    const std::vector<std::string> of_scene = ReadScenePart(database_, key).asset_ids;
    std::size_t bytes = 0;
    for (const AssetRecord& asset : history.assets) {
      const bool shared = std::find(of_scene.begin(), of_scene.end(), asset.id) != of_scene.end();
      if (!shared && asset.bytes) bytes += asset.bytes->size();
    }
    if (bytes > kMaxHistoryAssetBytes)
      throw Error("the models of its undo history have more than " +
                  std::to_string(kMaxHistoryAssetBytes >> 20) + " MiB");
    for (const AssetRecord& asset : history.assets) WriteAsset(database_, asset);
    WriteHistory(database_, key, {SceneChecksum(key), PartOf(history)});
  }

  std::uint64_t SceneChecksum(std::uint64_t key) const {
    return SceneTextChecksum(ReadScenePart(database_, key).text);
  }

  // Joins two maps and redirects everything that refers to the removed one.
  void Join(const JoinRecord& record) {
    for (const MapInfo& info : {record.into, record.from}) {
      WithMapContext(database_, info, [&] {
        if (!MayChangeStructure(info.policy)) Refuse(info.policy, "it cannot be joined with another map");
      });
    }
    Redirect(
        record.from, {record.into.key, record.into.name}, {record.into.key, record.from.key},
        "its signposts to '" + record.from.name + "' cannot point to '" + record.into.name + "' instead");
    MapInfo info = record.into;
    RemoveHistory(database_, info.key);  // It belongs to the scene before.
    const MapParts parts = PartsOf(*record.snapshot);
    const std::vector<StoredKeyFrame> stored_before = ReadParts(database_, info).keyframes;
    WriteStructure(*record.snapshot, parts, stored_before, &info);
    WriteImages(database_, info.key, *record.snapshot, parts.keyframes, stored_before);
    WriteScene(info.key, *record.scene);
    info.policy = Stricter(record.into.policy, record.from.policy);
    info.bounds = record.bounds;
    info.modified = options_.clock();
    WriteMapRow(database_, info);
    RemoveMap(record.from.key);
  }

  // The text of a map's scene with other targets; empty if none changes, or the scene cannot be read and so
  // leads nowhere.
  std::optional<std::string> RetargetIn(const MapInfo& info, const Retarget& retarget) const {
    if (!options_.scenes.retarget) return std::nullopt;
    try {
      const std::string text = ReadScenePart(database_, info.key).text;
      return text.empty() ? std::nullopt : options_.scenes.retarget(text, retarget);
    } catch (const Error&) {
      return std::nullopt;
    }
  }

  // Makes all signposts to the map `from` lead to another map or, with an empty target, nowhere. The maps
  // with the keys `except` are left out. `refusal` says what cannot be done where the policy forbids it; if
  // it is empty, the policy does not matter, because the signposts lead to the same place as before.
  void Redirect(const MapInfo& from, const SignpostTarget& into, const std::vector<std::uint64_t>& except,
                const std::string& refusal) {
    for (MapInfo info : ReadMapRows(database_)) {
      if (std::find(except.begin(), except.end(), info.key) != except.end()) continue;
      const auto text = RetargetIn(info, [&](const std::string&, const SignpostTarget& target) {
        return LeadsTo(target, from) && target != into ? std::optional(into) : std::nullopt;
      });
      if (!text) continue;
      WithMapContext(database_, info, [&] {
        if (!refusal.empty() && !MayChangeContent(info.policy)) Refuse(info.policy, refusal);
        WriteSceneText(info.key, *text);
      });
      info.modified = options_.clock();
      WriteMapRow(database_, info);
    }
  }

  // The undo history of the scene still fits, as no entity was added, moved or removed.
  void WriteSceneText(std::uint64_t key, const std::string& text) {
    ScenePart scene = ReadScenePart(database_, key);
    std::optional<HistoryPart> history;
    try {
      history = ReadHistory(database_, key);
    } catch (const Error&) {
      history.reset();  // It stays as it is, and Verify reports it.
    }
    const bool fits = history && history->scene == SceneTextChecksum(scene.text);
    scene.text = text;
    WriteScenePart(database_, key, scene);
    if (!fits) return;
    history->scene = SceneTextChecksum(text);
    WriteHistory(database_, key, *history);
  }

  // Returns false if the map no longer exists.
  bool RemoveJoined(std::uint64_t key, const SignpostTarget& into) {
    const std::optional<MapInfo> info = ReadMapRow(database_, key);
    if (!info) return false;
    WithMapContext(database_, *info, [&] {
      if (!MayRemove(info->policy)) Refuse(info->policy, "it cannot be joined into another map");
    });
    Redirect(*info, into, {key}, "");
    RemoveMap(key);
    return true;
  }

  void RemoveMap(std::uint64_t key) {
    RemoveMapRows(database_, key);
    LibraryRow library = ReadLibraryRow(database_);
    --library.map_count;
    WriteLibraryRow(database_, library);
    RemoveUnusedAssets(database_);
  }

  void WriteScene(std::uint64_t key, const SceneRecord& scene) {
    for (const AssetRecord& asset : scene.assets) WriteAsset(database_, asset);
    WriteScenePart(database_, key, PartOf(scene));
  }

  const Database& database() const { return database_; }
  const LibraryOptions& options() const { return options_; }

 private:
  std::mutex mutex_;  // Held during each call: one connection, one transaction at a time.
  Database database_;
  LibraryOptions options_;
};

Library::Library(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Library::Library(Library&&) noexcept = default;
Library::~Library() = default;

Library Library::Open(const std::filesystem::path& path, Access access, CreateIfMissing create,
                      LibraryOptions options) {
  Database database = OpenDatabase(path, access, create, options.scenes);
  return Library(std::make_unique<Impl>(std::move(database), std::move(options)));
}

Access Library::access() const {
  return impl_->database().read_only() ? Access::kReadOnly : Access::kReadWrite;
}
const std::string& Library::file() const {
  return impl_->database().file();
}

std::vector<MapInfo> Library::List() const {
  return impl_->Read([&] { return ReadMapRows(impl_->database()); });
}

MapInfo Library::Find(std::uint64_t key) const {
  return impl_->Read([&] { return impl_->Get(key); });
}

MapInfo Library::FindByName(const std::string& name) const {
  return impl_->Read([&] {
    if (const auto key = FindMapByName(impl_->database(), name)) return impl_->Get(*key);
    throw Error(file() + " has no map named '" + name + "'");
  });
}

StoredMap Library::Load(std::uint64_t key, DamagedContent damaged) const {
  return impl_->Read([&] {
    StoredMap map;
    map.info = impl_->Get(key);
    WithMapContext(impl_->database(), map.info, [&] {
      map.snapshot = ReadSnapshot(impl_->database(), map.info, impl_->options().make_features,
                                  impl_->options().load_threads);
      map.scene = damaged == DamagedContent::kRefuse ? impl_->ReadScene(key)
                                                     : impl_->ReadableScene(key, &map.lost_content);
    });
    return map;
  });
}

SceneRecord Library::LoadScene(std::uint64_t key) const {
  return impl_->Read([&] {
    SceneRecord scene;
    WithMapContext(impl_->database(), impl_->Get(key), [&] { scene = impl_->ReadScene(key); });
    return scene;
  });
}

std::optional<SceneRecord> Library::LoadHistory(std::uint64_t key) const {
  return impl_->Read([&] {
    std::optional<SceneRecord> history;
    WithMapContext(impl_->database(), impl_->Get(key), [&] { history = impl_->LoadHistory(key); });
    return history;
  });
}

std::optional<engine::MapMesh> Library::LoadMesh(std::uint64_t key) const {
  return impl_->Read([&] {
    std::optional<engine::MapMesh> mesh;
    WithMapContext(impl_->database(), impl_->Get(key), [&] { mesh = ReadMesh(impl_->database(), key); });
    return mesh;
  });
}

bool Library::SaveMesh(std::uint64_t key, const engine::MapMesh& mesh) {
  bool stored = false;
  impl_->Write([&] {
    stored = impl_->StoreMesh(key, mesh);
    return stored;
  });
  return stored;
}

void Library::LoadAppearance(const TakeAppearance& take) const {
  impl_->Read([&] {
    for (const MapInfo& info : ReadMapRows(impl_->database())) {
      Appearance appearance;
      const auto attempt = [&](const std::function<void()>& read) {
        try {
          WithMapContext(impl_->database(), info, read);
        } catch (const Error& error) {
          appearance.problem = error.what();
        }
      };
      attempt([&] { appearance.words = ReadWords(impl_->database(), info); });
      attempt([&] { appearance.thumbnails = ReadThumbnails(impl_->database(), info); });
      take(info, std::move(appearance));
    }
  });
}

std::vector<StoredLens> Library::Lenses() const {
  return impl_->Read([&] { return ReadLenses(impl_->database()); });
}

std::uint64_t Library::ReserveKeys(std::size_t count) {
  constexpr auto kLargest = static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
  std::uint64_t first = 0;
  impl_->Write([&] {
    LibraryRow row = ReadLibraryRow(impl_->database());
    if (count > kLargest || row.next_key >= kLargest - count) throw Error(file() + " has no free keys left");
    first = row.next_key;
    row.next_key += count;
    WriteLibraryRow(impl_->database(), row);
    return true;
  });
  return first;
}

bool Library::Save(const MapRecord& record) {
  if (record.snapshot) {
    if (const std::string problem = engine::Validate(*record.snapshot); !problem.empty()) {
      throw Error(file() + ": map '" + record.name + "' cannot be saved: " + problem);
    }
  }
  bool wanted = true;
  impl_->Write([&] {
    const std::optional<MapInfo> info =
        record.key == 0 ? std::nullopt : ReadMapRow(impl_->database(), record.key);
    wanted = !record.expected_revision || (info && info->revision == *record.expected_revision);
    if (!wanted) return false;
    MapInfo place;
    place.key = record.key;
    place.name = record.name;
    bool changed = true;
    WithMapContext(impl_->database(), info ? *info : place, [&] {
      if (record.key == 0) throw Error("it has no key; ask the library for one");
      if (info) {
        changed = impl_->Update(record, *info);
      } else {
        impl_->Create(record);
      }
    });
    for (const std::uint64_t key : record.joined_keys)
      changed |= impl_->RemoveJoined(key, {record.key, info ? info->name : record.name});
    for (const StoredLens& lens : record.lenses) changed |= WriteLens(impl_->database(), lens);
    return changed;
  });
  return wanted;
}

void Library::Rename(std::uint64_t key, const std::string& name) {
  impl_->Write([&] {
    MapInfo info = impl_->Get(key);
    if (info.name == name) return false;
    WithMapContext(impl_->database(), info, [&] {
      if (!MayChangeContent(info.policy)) Refuse(info.policy, "it cannot be renamed");
      CheckName(name);
      impl_->CheckNameIsFree(name, key);
    });
    // Signposts that were written without the map's key led to it by its name.
    impl_->Redirect(info, {key, name}, {}, "");
    info = impl_->Get(key);
    info.name = name;
    info.modified = impl_->options().clock();
    WriteMapRow(impl_->database(), info);
    return true;
  });
}

void Library::Remove(std::uint64_t key) {
  impl_->Write([&] {
    const MapInfo info = impl_->Get(key);
    WithMapContext(impl_->database(), info, [&] {
      if (!MayRemove(info.policy)) Refuse(info.policy, "it cannot be removed");
    });
    impl_->Redirect(info, {}, {key}, "its signposts to '" + info.name + "' cannot be changed");
    impl_->RemoveMap(key);
    return true;
  });
}

void Library::SetPolicy(std::uint64_t key, Policy policy) {
  impl_->Write([&] {
    MapInfo info = impl_->Get(key);
    if (info.policy == policy) return false;
    WithMapContext(impl_->database(), info, [&] {
      if (policy == Policy::kOpen) info.bounds.reset();
      if (policy == Policy::kBounded && !info.bounds)
        info.bounds = BoundsOf(ReadParts(impl_->database(), info));
    });
    info.policy = policy;
    WriteMapRow(impl_->database(), info);
    return true;
  });
}

bool Library::Join(const JoinRecord& record) {
  if (const std::string problem = engine::Validate(*record.snapshot); !problem.empty()) {
    throw Error(file() + ": maps '" + record.into.name + "' and '" + record.from.name +
                "' cannot be joined: " + problem);
  }
  bool unchanged = true;
  impl_->Write([&] {
    for (const MapInfo& info : {record.into, record.from})
      unchanged = unchanged && ReadMapRow(impl_->database(), info.key) == info;
    if (unchanged) impl_->Join(record);
    return unchanged;
  });
  return unchanged;
}

std::vector<std::string> Library::Verify() const {
  return impl_->Read(
      [&] { return VerifyAll(impl_->database(), impl_->options().load_threads, impl_->options().scenes); });
}

std::vector<std::string> Library::SignpostsToNoMap() const {
  return impl_->Read([&] { return maps::SignpostsToNoMap(impl_->database(), impl_->options().scenes); });
}

std::vector<Library::Signpost> Library::SignpostsTo(std::uint64_t key) const {
  return impl_->Read([&] {
    std::vector<Signpost> signposts;
    const MapInfo wanted = impl_->Get(key);
    for (const MapInfo& info : ReadMapRows(impl_->database())) {
      if (info.key == key) continue;
      impl_->RetargetIn(info, [&](const std::string& signpost, const SignpostTarget& target) {
        if (LeadsTo(target, wanted)) signposts.push_back({info, signpost});
        return std::optional<SignpostTarget>();
      });
    }
    return signposts;
  });
}

}  // namespace docent::maps
