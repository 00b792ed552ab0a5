// SPDX-License-Identifier: Apache-2.0
#include "maps/library/library.h"

#include <algorithm>
#include <limits>
#include <mutex>
#include <thread>
#include <utility>

#include "engine/base/error.h"
#include "engine/base/utf8.h"
#include "engine/vision/features.h"
#include "maps/index/thumbnail_rows.h"
#include "maps/index/word_rows.h"
#include "maps/library/map_joiner.h"
#include "maps/library/migration.h"
#include "maps/library/policy_refusal.h"
#include "maps/library/scene_storage.h"
#include "maps/library/signpost_redirection.h"
#include "maps/library/signposts.h"
#include "maps/library/structure_storage.h"
#include "maps/library/verify.h"
#include "maps/storage/database.h"
#include "maps/storage/mesh_rows.h"
#include "maps/storage/rows.h"
#include "maps/storage/schema.h"
#include "maps/storage/snapshot_reader.h"
#include "maps/storage/tour_rows.h"

namespace docent::maps {

std::string ValidateMapName(const std::string& name) {
  const bool printable = std::none_of(
      name.begin(), name.end(), [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7F; });
  if (!IsUtf8(name)) return "a map's name must be valid UTF-8";
  if (!name.empty() && name.size() <= kMaxMapNameBytes && printable) return "";
  return "a map's name must have 1 to " + std::to_string(kMaxMapNameBytes) +
         " bytes and no control characters";
}

namespace {

void CheckName(const std::string& name) {
  if (const std::string problem = ValidateMapName(name); !problem.empty()) throw Error(problem);
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
    WriteStructure(database_, snapshot, parts, {}, &info);
    WriteScene(database_, record.key, record.scene ? *record.scene : SceneRecord{});
    if (record.history && !record.history->text.empty())
      WriteSceneHistory(database_, record.key, *record.history);
    WriteImages(database_, info.key, snapshot, parts.keyframes, {});
    WriteMapRow(database_, info);
  }

  // Returns whether something changed.
  bool Update(const MapRecord& record, MapInfo info) {
    bool changed = false;
    if (record.snapshot) changed |= UpdateStructure(database_, *record.snapshot, &info);
    if (record.scene) changed |= UpdateScene(database_, *record.scene, info);
    if (record.history) changed |= UpdateSceneHistory(database_, *record.history, info);
    if (!changed) return false;
    info.modified = options_.clock();
    WriteMapRow(database_, info);
    return true;
  }

  const Database& database() const { return database_; }
  const LibraryOptions& options() const { return options_; }
  const SignpostRedirection& signposts() const { return signposts_; }
  const MapJoiner& joiner() const { return joiner_; }

 private:
  std::mutex mutex_;  // Held during each call: one connection, one transaction at a time.
  Database database_;
  LibraryOptions options_;
  const SignpostRedirection signposts_{database_, options_.scenes, options_.clock};
  const MapJoiner joiner_{database_, signposts_, options_.clock};
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
      map.scene = damaged == DamagedContent::kRefuse
                      ? ReadScene(impl_->database(), key)
                      : ReadUndamagedScene(impl_->database(), key, &map.lost_content);
      map.mesh = FindUndamagedMesh(impl_->database(), key);
    });
    return map;
  });
}

SceneRecord Library::LoadScene(std::uint64_t key, std::vector<std::string>* lost_content) const {
  return impl_->Read([&] {
    SceneRecord scene;
    WithMapContext(impl_->database(), impl_->Get(key), [&] {
      scene = lost_content ? ReadUndamagedScene(impl_->database(), key, lost_content)
                           : ReadScene(impl_->database(), key);
    });
    return scene;
  });
}

std::optional<SceneRecord> Library::LoadHistory(std::uint64_t key) const {
  return impl_->Read([&] {
    std::optional<SceneRecord> history;
    WithMapContext(impl_->database(), impl_->Get(key),
                   [&] { history = ReadSceneHistory(impl_->database(), key); });
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
    const std::optional<MapInfo> info = ReadMapRow(impl_->database(), key);
    if (info)
      WithMapContext(impl_->database(), *info, [&] { stored = ReplaceMesh(impl_->database(), *info, mesh); });
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

std::vector<Tour> Library::Tours(std::vector<std::string>* problems) const {
  return impl_->Read([&] { return ReadTours(impl_->database(), problems); });
}

void Library::ChangeTours(const std::function<void(std::vector<Tour>*)>& change) {
  impl_->Write([&] {
    RewriteTours(impl_->database(), change);
    return true;
  });
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
    wanted = (!record.expected_revision || (info && info->revision == *record.expected_revision)) &&
             (!record.expected || info == *record.expected) &&
             (!record.expected_scene ||
              (info && ReadableSceneChecksum(impl_->database(), info->key) == *record.expected_scene));
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
      changed |= impl_->joiner().RemoveJoined(key, {record.key, info ? info->name : record.name});
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
    impl_->signposts().Redirect(info, {key, name}, {}, "");
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
    impl_->signposts().Redirect(info, {}, {key}, "its signposts to '" + info.name + "' cannot be changed");
    impl_->joiner().Remove(key);
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
    if (unchanged) impl_->joiner().Join(record);
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

std::vector<Library::Signpost> Library::Signposts() const {
  return impl_->Read([&] {
    std::vector<Signpost> signposts;
    const std::vector<MapInfo> maps = ReadMapRows(impl_->database());
    for (const MapInfo& info : maps) {
      impl_->signposts().RetargetIn(info, [&](const std::string& signpost, const SignpostTarget& target) {
        for (const MapInfo& wanted : maps) {
          if (LeadsTo(target, wanted)) signposts.push_back({info, signpost, wanted.key});
        }
        return std::optional<SignpostTarget>();
      });
    }
    return signposts;
  });
}

std::vector<Library::Signpost> Library::SignpostsTo(std::uint64_t key) const {
  Find(key);
  std::vector<Signpost> signposts = Signposts();
  std::erase_if(signposts,
                [&](const Signpost& signpost) { return signpost.to_key != key || signpost.map.key == key; });
  return signposts;
}

}  // namespace docent::maps
