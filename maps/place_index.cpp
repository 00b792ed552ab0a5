// SPDX-License-Identifier: Apache-2.0
#include "maps/place_index.h"

#include <algorithm>
#include <utility>

namespace docent::maps {

namespace {

// What the exhaustive search hands on to the fine comparison: what looks alike in cells of six picture pixels
// of eighty is looked at again in pixels of two.
constexpr std::size_t kComparedFinely = 256;
constexpr std::size_t kFirstCapacity = 256;
constexpr std::size_t kDeadAllowed = 128;  // slots of thumbnails that went, beside a sixteenth of all

}  // namespace

// One keyframe of a map, and where its thumbnail lies.
struct PlaceIndex::Entry {
  engine::KeyFrameId keyframe = engine::kNoId;
  std::uint32_t array = 0;       // index in State::arrays
  std::uint32_t slot = 0;        // in that array
  const void* source = nullptr;  // the features it was made from, while the map holds them
};

struct PlaceIndex::Map {
  std::uint64_t key = 0;
  std::shared_ptr<const engine::MapSnapshot> snapshot;  // null while it is not in memory
  std::vector<Entry> entries;                           // by ascending keyframe

  const Entry* Find(engine::KeyFrameId keyframe) const {
    const auto entry =
        std::lower_bound(entries.begin(), entries.end(), keyframe,
                         [](const Entry& e, engine::KeyFrameId id) { return e.keyframe < id; });
    return entry != entries.end() && entry->keyframe == keyframe ? &*entry : nullptr;
  }
};

struct PlaceIndex::State {
  struct Array {
    std::shared_ptr<ThumbnailArray> thumbnails;  // changed by the writer alone, behind `size`
    std::size_t size = 0;                        // thumbnails that this state knows of
    std::size_t alive = 0;                       // of these, owned by a map still
  };
  std::vector<Array> arrays;                     // one a size of thumbnail
  std::vector<std::shared_ptr<const Map>> maps;  // by ascending key

  std::size_t LowerBound(std::uint64_t key) const {
    const auto place = std::lower_bound(maps.begin(), maps.end(), key,
                                        [](const auto& map, std::uint64_t k) { return map->key < k; });
    return static_cast<std::size_t>(place - maps.begin());
  }
  const Map* Find(std::uint64_t key) const {
    const std::size_t place = LowerBound(key);
    return place < maps.size() && maps[place]->key == key ? maps[place].get() : nullptr;
  }
};

// The next state in the making. What is shared with earlier states stays as it is: arrays only grow behind
// the sizes that those know, or are made anew.
class PlaceIndex::Update {
 public:
  explicit Update(const State& before) : state_(std::make_shared<State>(before)) {}

  void Remove(std::uint64_t key) {
    const std::size_t place = state_->LowerBound(key);
    if (place == state_->maps.size() || state_->maps[place]->key != key) return;
    for (const Entry& entry : state_->maps[place]->entries) --state_->arrays[entry.array].alive;
    state_->maps.erase(state_->maps.begin() + static_cast<std::ptrdiff_t>(place));
  }
  void Insert(std::shared_ptr<const Map> map) {
    for (const Entry& entry : map->entries) ++state_->arrays[entry.array].alive;
    const std::size_t place = state_->LowerBound(map->key);
    state_->maps.insert(state_->maps.begin() + static_cast<std::ptrdiff_t>(place), std::move(map));
  }
  bool Holds(const Entry& entry, const PackedThumbnail& thumbnail) const {
    const ThumbnailArray& array = *state_->arrays[entry.array].thumbnails;
    return array.shape().width == thumbnail.width && array.shape().height == thumbnail.height &&
           array.Holds(entry.slot, thumbnail);
  }
  // The array of a size, with room for `more`.
  std::uint32_t ArrayFor(int width, int height, std::size_t more) {
    std::uint32_t index = 0;
    for (; index < state_->arrays.size(); ++index) {
      const ThumbnailShape& shape = state_->arrays[index].thumbnails->shape();
      if (shape.width == width && shape.height == height) break;
    }
    if (index == state_->arrays.size()) {
      state_->arrays.push_back(
          {std::make_shared<ThumbnailArray>(width, height, std::max(kFirstCapacity, more)), 0, 0});
    }
    State::Array& array = state_->arrays[index];
    if (array.size + more > array.thumbnails->capacity()) {
      const std::size_t capacity = std::max(array.size + more, array.size + array.size / 2);
      auto larger = std::make_shared<ThumbnailArray>(width, height, capacity);
      for (std::size_t slot = 0; slot < array.size; ++slot) larger->Append(*array.thumbnails, slot);
      array.thumbnails = std::move(larger);
    }
    return index;
  }
  std::uint32_t Append(std::uint32_t array, const PackedThumbnail& thumbnail, ThumbnailArray::Owner owner) {
    State::Array& chosen = state_->arrays[array];
    const std::size_t slot = chosen.thumbnails->Append(thumbnail, owner);
    chosen.size = slot + 1;
    return static_cast<std::uint32_t>(slot);
  }

  std::shared_ptr<const State> Finish() {
    for (std::uint32_t i = 0; i < state_->arrays.size(); ++i) {
      const State::Array& array = state_->arrays[i];
      if (array.size - array.alive > kDeadAllowed + array.size / 16) Compact(i);
    }
    return state_;
  }

 private:
  // Leaves out what no map owns any more.
  void Compact(std::uint32_t which) {
    State::Array& array = state_->arrays[which];
    const ThumbnailArray& before = *array.thumbnails;
    auto after = std::make_shared<ThumbnailArray>(before.shape().width, before.shape().height,
                                                  std::max(kFirstCapacity, array.alive + array.alive / 2));
    for (auto& map : state_->maps) {
      auto moved = std::make_shared<Map>(*map);
      for (Entry& entry : moved->entries) {
        if (entry.array == which) entry.slot = static_cast<std::uint32_t>(after->Append(before, entry.slot));
      }
      map = std::move(moved);
    }
    array.size = array.alive = after->size();
    array.thumbnails = std::move(after);
  }

  std::shared_ptr<State> state_;
};

PlaceIndex::PlaceIndex() : state_(std::make_shared<const State>()) {}
PlaceIndex::~PlaceIndex() = default;

std::shared_ptr<const PlaceIndex::State> PlaceIndex::Current() const {
  std::scoped_lock lock(state_mutex_);
  return state_;
}

void PlaceIndex::Publish(std::shared_ptr<const State> state) {
  std::scoped_lock lock(state_mutex_);
  state_.swap(state);
}

void PlaceIndex::SetMap(std::uint64_t key, std::shared_ptr<const engine::MapSnapshot> snapshot) {
  if (!snapshot) return RemoveMap(key);
  std::scoped_lock writing(write_mutex_);
  const auto state = Current();
  const Map* const before = state->Find(key);
  std::vector<KeyFrameThumbnail> thumbnails;
  std::vector<const void*> sources;
  for (const engine::KeyFrame& keyframe : snapshot->keyframes) {
    KeyFrameThumbnail next{keyframe.id, {}};
    const void* const source = keyframe.features.get();
    // A keyframe whose features the index has seen needs no packing: an empty thumbnail stands for the known
    // one.
    const Entry* const entry = before && before->snapshot ? before->Find(keyframe.id) : nullptr;
    const bool known = entry && entry->source == source;
    if (!known) {
      next.thumbnail = Pack(keyframe.features->small_blurry);
      if (next.thumbnail.width == 0) continue;
    }
    thumbnails.push_back(std::move(next));
    sources.push_back(source);
  }
  Replace(key, std::move(snapshot), thumbnails, sources);
}

void PlaceIndex::SetThumbnails(std::uint64_t key, std::span<const KeyFrameThumbnail> thumbnails) {
  std::scoped_lock writing(write_mutex_);
  const std::vector<const void*> sources(thumbnails.size(), nullptr);
  Replace(key, nullptr, thumbnails, sources);
}

void PlaceIndex::Replace(std::uint64_t key, std::shared_ptr<const engine::MapSnapshot> snapshot,
                         std::span<const KeyFrameThumbnail> thumbnails,
                         std::span<const void* const> sources) {
  const auto state = Current();
  const Map* const before = state->Find(key);
  Update update(*state);
  update.Remove(key);
  auto map = std::make_shared<Map>();
  map->key = key;
  map->snapshot = std::move(snapshot);
  map->entries.reserve(thumbnails.size());
  for (std::size_t i = 0; i < thumbnails.size(); ++i) {
    const auto& [keyframe, thumbnail] = thumbnails[i];
    const Entry* const known = before ? before->Find(keyframe) : nullptr;
    Entry entry{keyframe, 0, 0, sources[i]};
    if (known && (thumbnail.width == 0 || update.Holds(*known, thumbnail))) {
      entry.array = known->array;
      entry.slot = known->slot;
    } else {
      entry.array = update.ArrayFor(thumbnail.width, thumbnail.height, thumbnails.size() - i);
      entry.slot = update.Append(entry.array, thumbnail, {key, keyframe});
    }
    map->entries.push_back(entry);
  }
  update.Insert(std::move(map));
  Publish(update.Finish());
}

void PlaceIndex::ReleaseMap(std::uint64_t key) {
  std::scoped_lock writing(write_mutex_);
  const auto state = Current();
  const Map* const before = state->Find(key);
  if (!before || !before->snapshot) return;
  auto map = std::make_shared<Map>(*before);
  map->snapshot.reset();
  for (Entry& entry : map->entries) entry.source = nullptr;  // its address may be used again
  Update update(*state);
  update.Remove(key);
  update.Insert(std::move(map));
  Publish(update.Finish());
}

void PlaceIndex::RemoveMap(std::uint64_t key) {
  std::scoped_lock writing(write_mutex_);
  Update update(*Current());
  update.Remove(key);
  Publish(update.Finish());
}

void PlaceIndex::Reserve(std::size_t keyframes) {
  constexpr int kUsualWidth = 40, kUsualHeight = 30;
  std::scoped_lock writing(write_mutex_);
  Update update(*Current());
  update.ArrayFor(kUsualWidth, kUsualHeight, keyframes);
  Publish(update.Finish());
}

std::size_t PlaceIndex::maps() const {
  return Current()->maps.size();
}

std::size_t PlaceIndex::keyframes() const {
  std::size_t count = 0;
  for (const auto& map : Current()->maps) count += map->entries.size();
  return count;
}

// Stage (a), by thumbnails. Candidates of further stages, which look at other things, join the list here
// before it is sorted.
std::vector<engine::PlaceCandidate> PlaceIndex::FindPlaces(const engine::SmallBlurryImage& image, int count,
                                                           int per_map, std::uint64_t only_map) const {
  if (count <= 0 || per_map <= 0) return {};
  const PackedThumbnail wanted = Pack(image);
  if (wanted.width == 0) return {};
  const auto state = Current();
  const auto array = std::find_if(state->arrays.begin(), state->arrays.end(), [&](const State::Array& a) {
    return a.thumbnails->shape().width == wanted.width && a.thumbnails->shape().height == wanted.height;
  });
  if (array == state->arrays.end()) return {};
  const auto index = static_cast<std::uint32_t>(array - state->arrays.begin());
  std::vector<ThumbnailArray::Hit> hits;
  if (only_map == 0) {
    const std::size_t dead = array->size - array->alive;
    hits = array->thumbnails->Search(
        wanted, array->size,
        std::max(kComparedFinely, static_cast<std::size_t>(count)) + std::min(dead, kDeadAllowed));
  } else if (const Map* const map = state->Find(only_map)) {
    std::vector<std::size_t> slots;
    for (const Entry& entry : map->entries) {
      if (entry.array == index) slots.push_back(entry.slot);
    }
    hits = array->thumbnails->Search(wanted, slots);
  }
  std::vector<engine::PlaceCandidate> candidates;
  std::vector<std::pair<std::uint64_t, int>> given;  // by map
  for (const ThumbnailArray::Hit& hit : hits) {
    const ThumbnailArray::Owner owner = array->thumbnails->owner(hit.slot);
    const Map* const map = state->Find(owner.map_key);
    if (!map) continue;
    const Entry* const entry = map->Find(owner.keyframe);
    // A slot whose keyframe went, or has another picture now.
    if (!entry || entry->array != index || entry->slot != hit.slot) continue;
    auto place = std::find_if(given.begin(), given.end(), [&](const auto& g) { return g.first == map->key; });
    if (place == given.end()) place = given.insert(given.end(), {map->key, 0});
    if (place->second == per_map) continue;
    ++place->second;
    candidates.push_back({map->key, map->snapshot, owner.keyframe, hit.difference});
    if (candidates.size() == static_cast<std::size_t>(count)) break;
  }
  return candidates;
}

}  // namespace docent::maps
