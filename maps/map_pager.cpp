// SPDX-License-Identifier: Apache-2.0
#include "maps/map_pager.h"

#include <algorithm>
#include <condition_variable>
#include <deque>
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

// Of an image of 640 x 480 with its pyramid and corners: for maps that were not read yet.
constexpr std::size_t kUsualKeyFrameBytes = 450'000;
// What a camera that is lost asks for changes with every image: older wishes are not worth the reading.
constexpr std::size_t kMaxWanted = 8;

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
  Impl(const Library* library, PlaceIndex* index, const PagerOptions& options, Callbacks callbacks)
      : library_(library), index_(index), options_(options), callbacks_(std::move(callbacks)) {}

  std::vector<MapInfo> Open();
  void Load(std::uint64_t key);
  void Expect(const std::vector<std::uint64_t>& keys);
  void Hold(const std::vector<std::uint64_t>& keys);
  std::vector<engine::PlaceCandidate> FindPlaces(const engine::PlaceQuery& query, int count, int per_map,
                                                 std::uint64_t only_map);
  std::size_t bytes_in_memory() const {
    const std::scoped_lock lock(mutex_);
    return bytes_;
  }
  std::vector<std::uint64_t> maps_in_memory() const {
    const std::scoped_lock lock(mutex_);
    return {uses_.begin(), uses_.end()};
  }

 private:
  struct Resident {
    std::size_t bytes = 0;
    std::list<std::uint64_t>::iterator use;  // in uses_
  };
  void Run(const std::stop_token& stop);
  void Read(std::uint64_t key);  // the whole way of one map into memory
  void TryLoad(std::uint64_t key);
  void MakeRoom();
  // With mutex_ held.
  bool Known(std::uint64_t key) const { return resident_.contains(key) || unreadable_.contains(key); }
  void Want(std::uint64_t key, bool urgent);
  void Touch(std::uint64_t key);

  const Library* const library_;
  PlaceIndex* const index_;
  const PagerOptions options_;
  const Callbacks callbacks_;

  std::mutex reading_;        // held by whoever reads a map; taken before mutex_
  mutable std::mutex mutex_;  // guards what follows; not held while reading or calling back
  std::condition_variable_any changed_;
  std::list<std::uint64_t> uses_;  // keys in memory, the most recently used first
  std::map<std::uint64_t, Resident> resident_;
  std::deque<std::uint64_t> wanted_;  // to be read, the most wanted first
  std::set<std::uint64_t> held_, unreadable_;
  std::size_t bytes_ = 0;
  std::optional<Worker> worker_;  // last: it uses the rest
};

std::vector<MapInfo> MapPager::Impl::Open() {
  std::vector<MapInfo> infos = library_->List();
  std::size_t keyframes = 0;
  for (const MapInfo& info : infos) keyframes += info.keyframes;
  index_->Reserve(keyframes);
  library_->LoadAppearance([&](const MapInfo& info, const Library::Appearance& appearance) {
    index_->SetAppearance(info.key, appearance.thumbnails, appearance.words);
    // It is hard to find by what it appearance like; by its name it can be found.
    if (!appearance.problem.empty() && callbacks_.failed) callbacks_.failed(info.key, appearance.problem);
  });
  if (keyframes * kUsualKeyFrameBytes <= std::min(options_.read_at_start_bytes, options_.budget_bytes)) {
    for (const MapInfo& info : infos) Load(info.key);
  }
  if (!options_.wait_for_maps) {
    worker_.emplace("map-pager", [this](const std::stop_token& stop) { Run(stop); });
  }
  return infos;
}

void MapPager::Impl::Touch(std::uint64_t key) {
  if (const auto found = resident_.find(key); found != resident_.end())
    uses_.splice(uses_.begin(), uses_, found->second.use);
}

void MapPager::Impl::Want(std::uint64_t key, bool urgent) {
  if (Known(key)) return;
  const auto waiting = std::find(wanted_.begin(), wanted_.end(), key);
  if (waiting != wanted_.end()) {
    if (!urgent) return;
    wanted_.erase(waiting);
  }
  if (urgent) {
    wanted_.push_front(key);
  } else {
    wanted_.push_back(key);
  }
  if (wanted_.size() > kMaxWanted) wanted_.pop_back();
}

void MapPager::Impl::Run(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (changed_.wait(lock, stop, [this] { return !wanted_.empty(); }) && !stop.stop_requested()) {
    const std::uint64_t key = wanted_.front();
    wanted_.pop_front();
    lock.unlock();
    TryLoad(key);
    lock.lock();
  }
}

void MapPager::Impl::Read(std::uint64_t key) {
  const std::scoped_lock reading(reading_);
  {
    const std::scoped_lock lock(mutex_);
    if (resident_.contains(key)) return Touch(key);
  }
  std::size_t bytes = 0;
  try {
    const StoredMap map = library_->Load(key);
    bytes = BytesOf(*map.snapshot);
    if (callbacks_.loaded) callbacks_.loaded(map);
    index_->SetMap(key, map.snapshot);
  } catch (const Error&) {
    const std::scoped_lock lock(mutex_);
    unreadable_.insert(key);
    throw;
  }
  {
    const std::scoped_lock lock(mutex_);
    uses_.push_front(key);
    resident_[key] = {bytes, uses_.begin()};
    bytes_ += bytes;
  }
  MakeRoom();
}

void MapPager::Impl::Load(std::uint64_t key) {
  {
    const std::scoped_lock lock(mutex_);
    if (resident_.contains(key)) return Touch(key);
  }
  Read(key);
}

void MapPager::Impl::TryLoad(std::uint64_t key) {
  try {
    Load(key);
  } catch (const Error& error) {
    if (callbacks_.failed) callbacks_.failed(key, error.what());
  }
}

// With reading_ held, so that nobody reads a map that is just let go.
void MapPager::Impl::MakeRoom() {
  std::vector<std::uint64_t> oldest_first;
  {
    const std::scoped_lock lock(mutex_);
    if (bytes_ <= options_.budget_bytes) return;
    // The one that was just read stays, or it would be read again at once.
    for (auto use = uses_.rbegin(); use != uses_.rend() && *use != uses_.front(); ++use) {
      if (!held_.contains(*use)) oldest_first.push_back(*use);
    }
  }
  for (const std::uint64_t key : oldest_first) {
    {
      const std::scoped_lock lock(mutex_);
      if (bytes_ <= options_.budget_bytes) return;
      if (held_.contains(key)) continue;
    }
    if (callbacks_.let_go && !callbacks_.let_go(key)) continue;
    index_->ReleaseMap(key);
    const std::scoped_lock lock(mutex_);
    const auto found = resident_.find(key);
    bytes_ -= found->second.bytes;
    uses_.erase(found->second.use);
    resident_.erase(found);
  }
}

void MapPager::Impl::Expect(const std::vector<std::uint64_t>& keys) {
  if (options_.wait_for_maps) return;
  {
    const std::scoped_lock lock(mutex_);
    for (const std::uint64_t key : keys) {
      Touch(key);
      Want(key, false);
    }
  }
  changed_.notify_all();
}

void MapPager::Impl::Hold(const std::vector<std::uint64_t>& keys) {
  const std::scoped_lock lock(mutex_);
  held_ = {keys.begin(), keys.end()};
  for (const std::uint64_t key : keys) Touch(key);
}

std::vector<engine::PlaceCandidate> MapPager::Impl::FindPlaces(const engine::PlaceQuery& query, int count,
                                                               int per_map, std::uint64_t only_map) {
  std::vector<engine::PlaceCandidate> candidates = index_->FindPlaces(query, count, per_map, only_map);
  std::vector<std::uint64_t> missing;  // the most alike first
  {
    const std::scoped_lock lock(mutex_);
    for (auto candidate = candidates.rbegin(); candidate != candidates.rend(); ++candidate)
      Touch(candidate->map_key);
    for (const engine::PlaceCandidate& candidate : candidates) {
      if (candidate.map || Known(candidate.map_key)) continue;
      if (std::find(missing.begin(), missing.end(), candidate.map_key) == missing.end())
        missing.push_back(candidate.map_key);
    }
    if (!options_.wait_for_maps) {
      for (auto key = missing.rbegin(); key != missing.rend(); ++key) Want(*key, true);
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

MapPager::MapPager(const Library* library, PlaceIndex* index, const PagerOptions& options,
                   Callbacks callbacks)
    : impl_(std::make_unique<Impl>(library, index, options, std::move(callbacks))) {}
MapPager::~MapPager() = default;

std::vector<MapInfo> MapPager::Open() {
  return impl_->Open();
}
void MapPager::Load(std::uint64_t key) {
  impl_->Load(key);
}
void MapPager::Expect(const std::vector<std::uint64_t>& keys) {
  impl_->Expect(keys);
}
void MapPager::Hold(const std::vector<std::uint64_t>& keys) {
  impl_->Hold(keys);
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
