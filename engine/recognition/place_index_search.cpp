// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "engine/recognition/place_index.h"
#include "engine/recognition/place_index_state.h"
#include "engine/recognition/place_ranking.h"

namespace docent::engine {

namespace {

// The number of thumbnails that the exhaustive search passes to the fine comparison. Of the 80
// pixels of the small blurry image's width, a coarse cell covers six and a fine pixel two.
constexpr std::size_t kFineThumbnails = 256;
// The number of candidates that the search by words contributes.
constexpr std::size_t kWordCandidates = 64;
constexpr double kMaxChanceCorrelation = 0.9;
// The difference of uncorrelated thumbnails.
constexpr double kUncorrelatedDifference = 2.0 * kThumbnailContrast * kThumbnailContrast;

}  // namespace

// Merges the candidates of both methods and compares all of them by both.
class PlaceIndex::Merge {
 public:
  Merge(const State& state, const InvertedFile& words) : state_(state), words_(words) {}

  void AddByThumbnail(const PackedThumbnail& wanted, std::size_t count, const Map* only_map);
  void AddByWords(const WordBag& wanted, const Map* only_map);
  std::vector<PlaceCandidate> Best(std::size_t count, std::size_t per_map, std::size_t places) const;

 private:
  struct Candidate {
    const Map* map = nullptr;
    const Entry* entry = nullptr;
    double difference = kUncorrelatedDifference;
    double words = 0;
  };
  const Entry* Find(const Map* map, KeyFrameId keyframe) const { return map ? map->Find(keyframe) : nullptr; }
  void Add(const Map* map, const Entry* entry, double difference) {
    if (known_.insert(entry).second) candidates_.push_back({map, entry, difference, 0});
  }
  void Compare(std::size_t first);

  const State& state_;
  const InvertedFile& words_;
  const PackedThumbnail* thumbnail_ = nullptr;
  const State::Array* array_ = nullptr;  // The thumbnails of the query's size.
  std::vector<Candidate> candidates_;
  // Measured at the kWordCandidates-th candidate, because so many cannot all show the place.
  ChanceLevel chance_;
  std::unordered_set<const Entry*> known_;
};

void PlaceIndex::Merge::AddByThumbnail(const PackedThumbnail& wanted, std::size_t count,
                                       const Map* only_map) {
  const auto array = std::find_if(state_.arrays.begin(), state_.arrays.end(), [&](const State::Array& a) {
    return a.thumbnails->shape().width == wanted.width && a.thumbnails->shape().height == wanted.height;
  });
  if (array == state_.arrays.end()) return;
  thumbnail_ = &wanted;
  array_ = &*array;
  const auto index = static_cast<std::uint32_t>(array - state_.arrays.begin());
  std::vector<ThumbnailArray::Hit> hits;
  if (!only_map) {
    const std::size_t dead = array->size - array->alive;
    hits = array->thumbnails->Search(
        wanted, array->size, std::max(kFineThumbnails, count) + std::min(dead, kDeadThumbnailsAllowed));
  } else {
    std::vector<std::size_t> slots;
    for (const Entry& entry : only_map->entries) {
      if (entry.array == index) slots.push_back(entry.slot);
    }
    hits = array->thumbnails->Search(wanted, slots);
  }
  for (const ThumbnailArray::Hit& hit : hits) {
    const ThumbnailArray::Owner owner = array->thumbnails->owner(hit.slot);
    const Map* const map = state_.Find(owner.map_key);
    const Entry* const entry = Find(map, owner.keyframe);
    // The keyframe in this slot was removed or has another image now.
    if (!entry || entry->array != index || entry->slot != hit.slot) continue;
    Add(map, entry, hit.difference);
    if (!only_map && candidates_.size() == kWordCandidates)
      chance_.correlation =
          std::clamp(1 - hit.difference / kUncorrelatedDifference, 0.0, kMaxChanceCorrelation);
  }
}

void PlaceIndex::Merge::AddByWords(const WordBag& wanted, const Map* only_map) {
  const std::size_t first = candidates_.size();
  if (only_map) {
    for (const Entry& entry : only_map->entries) Add(only_map, &entry, kUncorrelatedDifference);
  } else {
    const std::vector<InvertedFile::Hit> hits = words_.Search(wanted, kWordCandidates);
    if (hits.size() == kWordCandidates) chance_.words = std::max(chance_.words, hits.back().score);
    for (const InvertedFile::Hit& hit : hits) {
      const Map* const map = state_.Find(hit.owner.map_key);
      const Entry* const entry = Find(map, hit.owner.keyframe);
      if (entry && entry->word_slot == hit.slot) Add(map, entry, kUncorrelatedDifference);
    }
  }
  Compare(first);
  std::vector<InvertedFile::Slot> slots;
  for (const Candidate& candidate : candidates_) slots.push_back(candidate.entry->word_slot);
  const std::vector<double> scores = words_.Scores(wanted, slots);
  for (std::size_t i = 0; i < scores.size(); ++i) candidates_[i].words = scores[i];
}

// Compares the thumbnails of the candidates that were found only by words.
void PlaceIndex::Merge::Compare(std::size_t first) {
  if (!array_) return;
  const auto index = static_cast<std::uint32_t>(array_ - state_.arrays.data());
  std::unordered_map<std::size_t, std::size_t> candidate_at;  // By slot.
  std::vector<std::size_t> slots;
  for (std::size_t i = first; i < candidates_.size(); ++i) {
    if (candidates_[i].entry->array != index) continue;
    slots.push_back(candidates_[i].entry->slot);
    candidate_at.emplace(slots.back(), i);
  }
  for (const ThumbnailArray::Hit& hit : array_->thumbnails->Search(*thumbnail_, slots))
    candidates_[candidate_at.at(hit.slot)].difference = hit.difference;
}

std::vector<PlaceCandidate> PlaceIndex::Merge::Best(std::size_t count, std::size_t per_map,
                                                    std::size_t places) const {
  std::vector<PlaceScore> scores;
  for (const Candidate& candidate : candidates_)
    scores.push_back({candidate.map->key, candidate.entry->place, candidate.difference, candidate.words});
  std::vector<PlaceCandidate> best;
  for (const std::size_t i : RankPlaces(scores, chance_, count, per_map, places)) {
    const Candidate& candidate = candidates_[i];
    best.push_back(
        {candidate.map->key, candidate.map->snapshot, candidate.entry->keyframe, candidate.difference});
  }
  return best;
}

std::vector<PlaceCandidate> PlaceIndex::FindPlaces(const PlaceQuery& query, int count, int per_map,
                                                   std::uint64_t only_map) const {
  if (count <= 0 || per_map <= 0) return {};
  const auto state = Current();
  const Map* const only = only_map != 0 ? state->Find(only_map) : nullptr;
  if (only_map != 0 && !only) return {};
  const PackedThumbnail wanted = Pack(*query.image);
  Merge merge(*state, words_);
  if (wanted.width != 0) merge.AddByThumbnail(wanted, static_cast<std::size_t>(count), only);
  if (query.words && !query.words->empty()) merge.AddByWords(*query.words, only);
  return merge.Best(static_cast<std::size_t>(count), static_cast<std::size_t>(per_map),
                    query.places_first ? kDifferentPlaces : 0);
}

}  // namespace docent::engine
