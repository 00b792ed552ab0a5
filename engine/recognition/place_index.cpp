// SPDX-License-Identifier: Apache-2.0
#include "engine/recognition/place_index.h"

#include <algorithm>
#include <utility>

#include "engine/recognition/place_index_state.h"

namespace docent::engine {

namespace {

constexpr std::size_t kFirstCapacity = 256;

}  // namespace

// Builds the next state. Data that is shared with earlier states is never modified: arrays grow only beyond
// the sizes that those states use, or are reallocated.
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
    return state_->Holds(entry, thumbnail);
  }
  // The array for this thumbnail size, with room for `more` thumbnails.
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
      if (array.size - array.alive > kDeadThumbnailsAllowed + array.size / 16) Compact(i);
    }
    return state_;
  }

 private:
  // Removes the thumbnails that no map owns.
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

std::vector<KeyFrameWords> PlaceIndex::DescribeNew(std::uint64_t key, const MapSnapshot& map) const {
  const auto state = Current();
  const Map* const before = state->Find(key);
  std::vector<KeyFrameWords> described;
  for (const KeyFrame& keyframe : map.keyframes) {
    const Entry* const entry = before ? before->Find(keyframe.id) : nullptr;
    if (entry && entry->described &&
        (entry->source == keyframe.features.get() ||
         state->Holds(*entry, Pack(keyframe.features->small_blurry)))) {
      continue;
    }
    described.push_back({keyframe.id, kNoId, WordsOf(*keyframe.features)});
  }
  return described;
}

void PlaceIndex::SetMap(std::uint64_t key, std::shared_ptr<const MapSnapshot> snapshot,
                        const std::vector<KeyFrameWords>& described) {
  if (!snapshot) return RemoveMap(key);
  if (described.empty()) {
    // Usually there is nothing new, which this finds out quickly.
    const std::vector<KeyFrameWords> own = DescribeNew(key, *snapshot);
    if (!own.empty()) return SetMap(key, std::move(snapshot), own);
  }
  const std::vector<KeyFrameId> places = PlacesOf(*snapshot);
  std::scoped_lock writing(write_mutex_);
  const auto state = Current();
  const Map* const before = state->Find(key);
  std::vector<KeyFrameUpdate> updates;
  std::vector<PackedThumbnail> packed;
  packed.reserve(snapshot->keyframes.size());
  auto words = described.begin();
  for (std::size_t i = 0; i < snapshot->keyframes.size(); ++i) {
    const KeyFrame& keyframe = snapshot->keyframes[i];
    KeyFrameUpdate next;
    next.keyframe = keyframe.id;
    next.place = places[i];
    next.source = keyframe.features.get();
    while (words != described.end() && words->keyframe < keyframe.id) ++words;
    if (words != described.end() && words->keyframe == keyframe.id) next.words = &words->words;
    // A keyframe whose features the index has seen already needs no new thumbnail.
    const Entry* const entry = before && before->snapshot ? before->Find(keyframe.id) : nullptr;
    if (!entry || entry->source != next.source) {
      packed.push_back(Pack(keyframe.features->small_blurry));
      if (packed.back().width == 0) continue;
      next.thumbnail = &packed.back();
    }
    updates.push_back(next);
  }
  Replace(key, std::move(snapshot), updates);
}

void PlaceIndex::SetAppearance(std::uint64_t key, std::span<const KeyFrameThumbnail> thumbnails,
                               std::span<const KeyFrameWords> words) {
  std::vector<KeyFrameUpdate> updates;
  updates.reserve(thumbnails.size());
  auto described = words.begin();
  for (const auto& [keyframe, thumbnail] : thumbnails) {
    KeyFrameUpdate next;
    next.keyframe = next.place = keyframe;
    next.thumbnail = &thumbnail;
    while (described != words.end() && described->keyframe < keyframe) ++described;
    if (described != words.end() && described->keyframe == keyframe) {
      next.place = described->place;
      next.words = &described->words;
    }
    updates.push_back(next);
  }
  std::scoped_lock writing(write_mutex_);
  Replace(key, nullptr, updates);
}

void PlaceIndex::Replace(std::uint64_t key, std::shared_ptr<const MapSnapshot> snapshot,
                         std::span<const KeyFrameUpdate> updates) {
  const auto state = Current();
  const Map* const before = state->Find(key);
  Update update(*state);
  update.Remove(key);
  auto map = std::make_shared<Map>();
  map->key = key;
  map->snapshot = std::move(snapshot);
  map->entries.reserve(updates.size());
  std::vector<InvertedFile::Slot> kept;
  for (std::size_t i = 0; i < updates.size(); ++i) {
    const KeyFrameUpdate& next = updates[i];
    const Entry* const known = before ? before->Find(next.keyframe) : nullptr;
    const bool same_image = known && (!next.thumbnail || update.Holds(*known, *next.thumbnail));
    if (!same_image && !next.thumbnail) continue;
    Entry entry = same_image ? *known : Entry();
    entry.keyframe = next.keyframe;
    entry.place = next.place;
    entry.source = next.source;
    if (!same_image) {
      entry.array = update.ArrayFor(next.thumbnail->width, next.thumbnail->height, updates.size() - i);
      entry.slot = update.Append(entry.array, *next.thumbnail, {key, next.keyframe});
    }
    if (!entry.described && next.words) {
      entry.described = true;
      if (!next.words->empty()) entry.word_slot = words_.Add(*next.words, {key, next.keyframe});
    }
    if (entry.word_slot != InvertedFile::kNoSlot) kept.push_back(entry.word_slot);
    map->entries.push_back(entry);
  }
  update.Insert(std::move(map));
  Publish(update.Finish());
  RemoveWords(before, std::move(kept));
}

// Removes the words of a map's previous state except those in `kept`. A search that still uses that state
// skips removed words.
void PlaceIndex::RemoveWords(const Map* before, std::vector<InvertedFile::Slot> kept) {
  if (!before) return;
  std::sort(kept.begin(), kept.end());
  for (const Entry& entry : before->entries) {
    if (entry.word_slot != InvertedFile::kNoSlot &&
        !std::binary_search(kept.begin(), kept.end(), entry.word_slot)) {
      words_.Remove(entry.word_slot);
    }
  }
}

void PlaceIndex::ReleaseMap(std::uint64_t key) {
  std::scoped_lock writing(write_mutex_);
  const auto state = Current();
  const Map* const before = state->Find(key);
  if (!before || !before->snapshot) return;
  auto map = std::make_shared<Map>(*before);
  map->snapshot.reset();
  for (Entry& entry : map->entries) entry.source = nullptr;  // The address may be reused for other features.
  Update update(*state);
  update.Remove(key);
  update.Insert(std::move(map));
  Publish(update.Finish());
}

void PlaceIndex::RemoveMap(std::uint64_t key) {
  std::scoped_lock writing(write_mutex_);
  const auto state = Current();
  Update update(*state);
  update.Remove(key);
  Publish(update.Finish());
  RemoveWords(state->Find(key), {});
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

}  // namespace docent::engine
