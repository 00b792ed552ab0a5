// SPDX-License-Identifier: Apache-2.0
#include "maps/library/map_pager.h"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <exception>
#include <list>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <stop_token>
#include <utility>

#include "engine/base/error.h"
#include "engine/base/worker.h"

namespace docent::maps {

namespace {

// Estimated memory for an image of 640 x 480 with its pyramid and corners, for maps that have not been read
// yet.
constexpr std::size_t kTypicalKeyFrameBytes = 450'000;
// The requests of a lost camera change with every image, so older requests are not worth reading.
constexpr std::size_t kMaxQueuedLoads = 8;

}  // namespace

std::size_t BytesOf(const engine::MapSnapshot& map) {
  std::size_t bytes = sizeof(map) + map.keyframes.size() * sizeof(engine::KeyFrame) +
                      map.points.size() * sizeof(engine::MapPoint) +
                      map.observations.size() * sizeof(engine::Observation);
  for (const engine::KeyFrame& keyframe : map.keyframes) {
    if (!keyframe.features) continue;
    const engine::ImageFeatures& features = *keyframe.features;
    for (const cv::Mat& level : features.levels) bytes += level.total() * level.elemSize();
    for (const auto& corners : features.corners) bytes += corners.size() * sizeof(engine::Corner);
    for (const auto& rows : features.row_begin) bytes += rows.size() * sizeof(int);
    bytes += features.small_blurry.pixels.total() * features.small_blurry.pixels.elemSize();
  }
  return bytes;
}

class MapPager::Impl {
 public:
  Impl(const Library* library, engine::PlaceIndex* index, const PagerOptions& options, Callbacks callbacks)
      : library_(library), index_(index), options_(options), callbacks_(std::move(callbacks)) {}

  std::vector<MapInfo> Open();
  void Load(std::uint64_t key);
  void Prefetch(const std::vector<std::uint64_t>& keys);
  void MapHasChanged(std::uint64_t key) {
    const std::scoped_lock lock(mutex_);
    unreadable_.erase(key);
  }
  void Pin(const std::vector<std::uint64_t>& keys);
  std::vector<engine::PlaceCandidate> FindPlaces(const engine::PlaceQuery& query, int count, int per_map,
                                                 std::uint64_t only_map);
  std::size_t bytes_in_memory() const {
    const std::scoped_lock lock(mutex_);
    return bytes_;
  }
  std::vector<std::uint64_t> maps_in_memory() const {
    const std::scoped_lock lock(mutex_);
    return {recently_used_.begin(), recently_used_.end()};
  }

 private:
  struct Resident {
    std::size_t bytes = 0;
    std::list<std::uint64_t>::iterator use;  // Position in recently_used_.
  };
  // A disk may fail for a moment only, so that a map is not given up for good.
  struct Unreadable {
    std::string problem;
    std::chrono::milliseconds pause{};
    std::chrono::steady_clock::time_point next_try{};
  };
  void Run(const std::stop_token& stop);
  void Read(std::uint64_t key);  // Reads one map and adds it to the index.
  // Returns whether the problem is another one than the last time.
  bool NoteFailure(std::uint64_t key, const std::string& problem);
  void ReportFailure(std::uint64_t key, const std::string& problem);
  void TryLoad(std::uint64_t key);
  void MakeRoom();
  // Requires mutex_.
  bool IsResidentOrUnreadable(std::uint64_t key) const {
    const auto failed = unreadable_.find(key);
    return resident_.contains(key) ||
           (failed != unreadable_.end() && std::chrono::steady_clock::now() < failed->second.next_try);
  }
  void Enqueue(std::uint64_t key, bool urgent);
  void Touch(std::uint64_t key);

  const Library* const library_;
  engine::PlaceIndex* const index_;
  const PagerOptions options_;
  const Callbacks callbacks_;

  std::mutex reading_mutex_;  // Held by the thread that reads a map; taken before mutex_.
  mutable std::mutex mutex_;  // Guards the fields below; not held while reading or in a callback.
  std::condition_variable_any changed_;
  std::list<std::uint64_t> recently_used_;  // Keys of the maps in memory, the most recently used first.
  std::map<std::uint64_t, Resident> resident_;
  std::deque<std::uint64_t> load_queue_;  // Keys of the maps to read, the most urgent first.
  std::set<std::uint64_t> pinned_;
  std::map<std::uint64_t, Unreadable> unreadable_;
  std::size_t bytes_ = 0;
  std::optional<Worker> worker_;  // Declared last, because it uses the other fields.
};

std::vector<MapInfo> MapPager::Impl::Open() {
  std::vector<MapInfo> infos = library_->List();
  std::size_t keyframes = 0;
  for (const MapInfo& info : infos) keyframes += info.keyframes;
  index_->Reserve(keyframes);
  const auto is_left_out = [this](std::uint64_t key) {
    return std::find(options_.left_out.begin(), options_.left_out.end(), key) != options_.left_out.end();
  };
  library_->LoadAppearance([&](const MapInfo& info, const Library::Appearance& appearance) {
    if (is_left_out(info.key)) return;
    index_->SetAppearance(info.key, appearance.thumbnails, appearance.words);
    // Such a map cannot be found by its appearance, but it can still be loaded by name.
    if (!appearance.problem.empty() && callbacks_.failed) callbacks_.failed(info.key, appearance.problem);
  });
  if (keyframes * kTypicalKeyFrameBytes <= std::min(options_.read_at_start_bytes, options_.budget_bytes)) {
    for (const MapInfo& info : infos) {
      if (!is_left_out(info.key)) TryLoad(info.key);
    }
  }
  if (!options_.wait_for_maps) {
    worker_.emplace("map-pager", [this](const std::stop_token& stop) { Run(stop); });
  }
  return infos;
}

void MapPager::Impl::Touch(std::uint64_t key) {
  if (const auto found = resident_.find(key); found != resident_.end())
    recently_used_.splice(recently_used_.begin(), recently_used_, found->second.use);
}

void MapPager::Impl::Enqueue(std::uint64_t key, bool urgent) {
  if (IsResidentOrUnreadable(key)) return;
  const auto waiting = std::find(load_queue_.begin(), load_queue_.end(), key);
  if (waiting != load_queue_.end()) {
    if (!urgent) return;
    load_queue_.erase(waiting);
  }
  if (urgent) {
    load_queue_.push_front(key);
  } else {
    load_queue_.push_back(key);
  }
  if (load_queue_.size() > kMaxQueuedLoads) load_queue_.pop_back();
}

void MapPager::Impl::Run(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (changed_.wait(lock, stop, [this] { return !load_queue_.empty(); }) && !stop.stop_requested()) {
    const std::uint64_t key = load_queue_.front();
    load_queue_.pop_front();
    lock.unlock();
    try {
      TryLoad(key);
    } catch (const std::exception& error) {
      // Such as too little memory for this map, which need not be the end of the others.
      ReportFailure(key, "a map cannot be read: " + std::string(error.what()));
    }
    lock.lock();
  }
}

bool MapPager::Impl::NoteFailure(std::uint64_t key, const std::string& problem) {
  const std::scoped_lock lock(mutex_);
  Unreadable& failed = unreadable_[key];
  failed.pause =
      failed.problem.empty() ? options_.first_retry : std::min(2 * failed.pause, options_.longest_retry);
  failed.next_try = std::chrono::steady_clock::now() + failed.pause;
  return std::exchange(failed.problem, problem) != problem;
}

void MapPager::Impl::ReportFailure(std::uint64_t key, const std::string& problem) {
  if (NoteFailure(key, problem) && callbacks_.failed) callbacks_.failed(key, problem);
}

void MapPager::Impl::Read(std::uint64_t key) {
  const std::scoped_lock reading(reading_mutex_);
  {
    const std::scoped_lock lock(mutex_);
    if (resident_.contains(key)) return Touch(key);
  }
  const StoredMap map = library_->Load(key, Library::DamagedContent::kLeaveOut);
  const std::size_t bytes = BytesOf(*map.snapshot);
  if (callbacks_.loaded) callbacks_.loaded(map);
  index_->SetMap(key, map.snapshot);
  if (callbacks_.exists && !callbacks_.exists(key)) return index_->RemoveMap(key);
  {
    const std::scoped_lock lock(mutex_);
    unreadable_.erase(key);
    recently_used_.push_front(key);
    resident_[key] = {bytes, recently_used_.begin()};
    bytes_ += bytes;
  }
  MakeRoom();
}

void MapPager::Impl::Load(std::uint64_t key) {
  {
    const std::scoped_lock lock(mutex_);
    if (resident_.contains(key)) return Touch(key);
  }
  try {
    Read(key);
  } catch (const Error& error) {
    NoteFailure(key, error.what());
    throw;
  }
}

void MapPager::Impl::TryLoad(std::uint64_t key) {
  {
    const std::scoped_lock lock(mutex_);
    if (resident_.contains(key)) return Touch(key);
  }
  try {
    Read(key);
  } catch (const Error& error) {
    ReportFailure(key, error.what());
  }
}

// Requires reading_mutex_, so that no thread reads a map while it is evicted.
void MapPager::Impl::MakeRoom() {
  std::vector<std::uint64_t> oldest_first;
  {
    const std::scoped_lock lock(mutex_);
    if (bytes_ <= options_.budget_bytes) return;
    // The map that was just read stays; otherwise it would be read again at once.
    for (auto use = recently_used_.rbegin(); use != recently_used_.rend() && *use != recently_used_.front();
         ++use) {
      if (!pinned_.contains(*use)) oldest_first.push_back(*use);
    }
  }
  for (const std::uint64_t key : oldest_first) {
    {
      const std::scoped_lock lock(mutex_);
      if (bytes_ <= options_.budget_bytes) return;
      if (pinned_.contains(key)) continue;
    }
    if (callbacks_.evict && !callbacks_.evict(key)) continue;
    index_->ReleaseMap(key);
    const std::scoped_lock lock(mutex_);
    const auto found = resident_.find(key);
    bytes_ -= found->second.bytes;
    recently_used_.erase(found->second.use);
    resident_.erase(found);
  }
}

void MapPager::Impl::Prefetch(const std::vector<std::uint64_t>& keys) {
  if (options_.wait_for_maps) return;
  {
    const std::scoped_lock lock(mutex_);
    for (const std::uint64_t key : keys) {
      Touch(key);
      Enqueue(key, false);
    }
  }
  changed_.notify_all();
}

void MapPager::Impl::Pin(const std::vector<std::uint64_t>& keys) {
  const std::scoped_lock lock(mutex_);
  pinned_ = {keys.begin(), keys.end()};
  for (const std::uint64_t key : keys) Touch(key);
}

std::vector<engine::PlaceCandidate> MapPager::Impl::FindPlaces(const engine::PlaceQuery& query, int count,
                                                               int per_map, std::uint64_t only_map) {
  std::vector<engine::PlaceCandidate> candidates = index_->FindPlaces(query, count, per_map, only_map);
  std::vector<std::uint64_t> missing;  // The most similar first.
  {
    const std::scoped_lock lock(mutex_);
    for (auto candidate = candidates.rbegin(); candidate != candidates.rend(); ++candidate)
      Touch(candidate->map_key);
    for (const engine::PlaceCandidate& candidate : candidates) {
      if (candidate.map || IsResidentOrUnreadable(candidate.map_key)) continue;
      if (std::find(missing.begin(), missing.end(), candidate.map_key) == missing.end())
        missing.push_back(candidate.map_key);
    }
    if (!options_.wait_for_maps) {
      for (auto key = missing.rbegin(); key != missing.rend(); ++key) Enqueue(*key, true);
    }
  }
  if (!missing.empty()) {
    if (options_.wait_for_maps) {
      for (const std::uint64_t key : missing) TryLoad(key);
      candidates = index_->FindPlaces(query, count, per_map, only_map);
    } else {
      changed_.notify_all();
    }
  }
  std::erase_if(candidates, [](const engine::PlaceCandidate& candidate) { return !candidate.map; });
  return candidates;
}

MapPager::MapPager(const Library* library, engine::PlaceIndex* index, const PagerOptions& options,
                   Callbacks callbacks)
    : impl_(std::make_unique<Impl>(library, index, options, std::move(callbacks))) {}
MapPager::~MapPager() = default;

std::vector<MapInfo> MapPager::Open() {
  return impl_->Open();
}
void MapPager::Load(std::uint64_t key) {
  impl_->Load(key);
}
void MapPager::Prefetch(const std::vector<std::uint64_t>& keys) {
  impl_->Prefetch(keys);
}
void MapPager::MapHasChanged(std::uint64_t key) {
  impl_->MapHasChanged(key);
}
void MapPager::Pin(const std::vector<std::uint64_t>& keys) {
  impl_->Pin(keys);
}
std::vector<engine::PlaceCandidate> MapPager::FindPlaces(const engine::PlaceQuery& query, int count,
                                                         int per_map, std::uint64_t only_map) const {
  return impl_->FindPlaces(query, count, per_map, only_map);
}
std::size_t MapPager::bytes_in_memory() const {
  return impl_->bytes_in_memory();
}
std::vector<std::uint64_t> MapPager::maps_in_memory() const {
  return impl_->maps_in_memory();
}

}  // namespace docent::maps
