// SPDX-License-Identifier: Apache-2.0
#include "engine/recognition/descriptor_database.h"

#include <algorithm>
#include <limits>
#include <map>
#include <tuple>
#include <utility>

#include "engine/base/option_check.h"

namespace docent::engine {

namespace {

constexpr int kFar = std::numeric_limits<int>::max();

// A total order, so that the choice among equally near entries is deterministic.
auto KeyOf(const DescriptorDatabase::Entry& entry) {
  return std::tuple(entry.keyframe, entry.point, entry.level, entry.pixel.x(), entry.pixel.y(),
                    entry.descriptor.values);
}

// The leaf that stores an entry: the nearest of the leaves that a descent along several branches reaches. A
// descent along one branch often misses it because of an early decision, and a query would search other
// leaves.
std::uint32_t HomeLeaf(const VocabularyTree& tree, const Descriptor& descriptor) {
  std::array<std::uint32_t, 4> leaves;
  tree.NearestLeaves(descriptor, leaves);
  return leaves[0];
}

}  // namespace

std::optional<std::string> DescriptorDatabase::MatchOptions::Validate() const {
  return OptionCheck()
      .Within(static_cast<double>(leaves), 1, static_cast<double>(VocabularyTree::kMaxNearestLeaves),
              "number of searched leaves")
      .AtLeast(max_distance, 0, "squared distance of two descriptors")
      .Ratio(max_ratio, "ratio of the distances of two matches")
      .fault();
}

// The best entry for a query, and the distance to the best entry of another point.
struct DescriptorDatabase::Best {
  int distance = kFar, second = kFar;
  std::uint32_t leaf = 0, slot = 0;
  MapPointId point = kNoId;
};

DescriptorDatabase::Entry DescriptorDatabase::EntryAt(std::uint32_t leaf, std::uint32_t slot) const {
  const Stored& stored = leaves_[leaf].stored[slot];
  return {leaves_[leaf].descriptors[slot], stored.keyframe, stored.point, stored.pixel, stored.level};
}

void DescriptorDatabase::Add(const Entry& entry) {
  const std::uint32_t index = HomeLeaf(*tree_, entry.descriptor);
  Leaf& leaf = leaves_[index];
  std::vector<Place>& places = keyframes_[entry.keyframe];
  leaf.stored.push_back(
      {entry.keyframe, entry.point, entry.pixel, entry.level, static_cast<std::uint32_t>(places.size())});
  places.push_back({index, static_cast<std::uint32_t>(leaf.descriptors.size())});
  leaf.descriptors.push_back(entry.descriptor);
  ++size_;
}

void DescriptorDatabase::RemovePlace(std::vector<Place>* places, std::size_t index) {
  // The last elements move into the gaps, in the leaf and in the keyframe's list, and their positions are
  // updated.
  const Place place = (*places)[index];
  Leaf& leaf = leaves_[place.leaf];
  if (place.slot + 1 != leaf.stored.size()) {
    leaf.stored[place.slot] = leaf.stored.back();
    leaf.descriptors[place.slot] = leaf.descriptors.back();
    const Stored& moved = leaf.stored[place.slot];
    keyframes_.at(moved.keyframe)[moved.place].slot = place.slot;
  }
  leaf.stored.pop_back();
  leaf.descriptors.pop_back();
  if (index + 1 != places->size()) {
    (*places)[index] = places->back();
    leaves_[(*places)[index].leaf].stored[(*places)[index].slot].place = static_cast<std::uint32_t>(index);
  }
  places->pop_back();
  --size_;
}

void DescriptorDatabase::RemoveKeyFrame(KeyFrameId keyframe) {
  const auto found = keyframes_.find(keyframe);
  if (found == keyframes_.end()) return;
  while (!found->second.empty()) RemovePlace(&found->second, found->second.size() - 1);
  keyframes_.erase(found);
}

void DescriptorDatabase::RemoveObservation(KeyFrameId keyframe, MapPointId point) {
  const auto found = keyframes_.find(keyframe);
  if (found == keyframes_.end()) return;
  std::vector<Place>& places = found->second;
  for (std::size_t i = places.size(); i-- > 0;)
    if (leaves_[places[i].leaf].stored[places[i].slot].point == point) RemovePlace(&places, i);
  if (places.empty()) keyframes_.erase(found);
}

void DescriptorDatabase::Clear() {
  for (Leaf& leaf : leaves_) leaf = {};
  keyframes_.clear();
  size_ = 0;
}

std::vector<DescriptorDatabase::Entry> DescriptorDatabase::EntriesOf(KeyFrameId keyframe) const {
  std::vector<Entry> entries;
  const auto found = keyframes_.find(keyframe);
  if (found == keyframes_.end()) return entries;
  entries.reserve(found->second.size());
  for (const Place& place : found->second) entries.push_back(EntryAt(place.leaf, place.slot));
  return entries;
}

void DescriptorDatabase::SearchLeaves(const Descriptor& query, const MatchOptions& options,
                                      std::unordered_map<KeyFrameId, Best>* best_of) const {
  std::array<std::uint32_t, VocabularyTree::kMaxNearestLeaves> leaves;
  const std::size_t count = tree_->NearestLeaves(
      query, std::span(leaves).first(std::clamp<std::size_t>(options.leaves, 1, leaves.size())));
  Best whole;
  for (std::size_t i = 0; i < count; ++i) {
    const Leaf& leaf = leaves_[leaves[i]];
    for (std::uint32_t slot = 0; slot < leaf.descriptors.size(); ++slot) {
      const Stored& stored = leaf.stored[slot];
      if (options.only_keyframe != kNoId && stored.keyframe != options.only_keyframe) continue;
      if (options.except_keyframe != kNoId && stored.keyframe == options.except_keyframe) continue;
      const int distance = SquaredDistance(query, leaf.descriptors[slot]);
      Best& best = options.each_keyframe ? (*best_of)[stored.keyframe] : whole;
      const auto replace = [&] {
        best.distance = distance;
        best.leaf = leaves[i];
        best.slot = slot;
        best.point = stored.point;
      };
      if (best.distance != kFar && stored.point == best.point) {
        if (distance < best.distance ||
            (distance == best.distance &&
             KeyOf(EntryAt(leaves[i], slot)) < KeyOf(EntryAt(best.leaf, best.slot)))) {
          replace();
        }
      } else if (distance < best.distance) {
        best.second = best.distance;
        replace();
      } else {
        // A second entry as near as the best makes the match ambiguous, whichever came first.
        best.second = std::min(best.second, distance);
      }
    }
  }
  if (!options.each_keyframe && whole.distance != kFar) (*best_of)[kNoId] = whole;
}

std::vector<DescriptorDatabase::Match> DescriptorDatabase::FindMatches(std::span<const Descriptor> queries,
                                                                       const MatchOptions& options) const {
  Checked(options);
  std::vector<Match> matches;
  std::unordered_map<KeyFrameId, Best> best_of;
  for (std::size_t query = 0; query < queries.size(); ++query) {
    best_of.clear();
    SearchLeaves(queries[query], options, &best_of);
    for (const auto& [keyframe, best] : best_of) {
      if (best.distance > options.max_distance) continue;
      // Without a second entry the ratio test passes.
      if (best.second != kFar && !(best.distance < options.max_ratio * best.second)) continue;
      matches.push_back({query, EntryAt(best.leaf, best.slot), best.distance});
    }
  }
  if (options.mutual) {
    std::erase_if(matches, [&](const Match& match) {
      for (std::size_t other = 0; other < queries.size(); ++other) {
        const int distance = SquaredDistance(queries[other], match.entry.descriptor);
        if (distance < match.distance || (distance == match.distance && other < match.query)) return true;
      }
      return false;
    });
  }
  // If several descriptors chose one point, the nearest keeps it.
  std::map<std::pair<MapPointId, KeyFrameId>, std::tuple<int, std::size_t>> winner;
  const auto target = [&](const Match& match) {
    return std::pair(match.entry.point, options.each_keyframe ? match.entry.keyframe : kNoId);
  };
  for (const Match& match : matches) {
    const std::tuple claim(match.distance, match.query);
    const auto [place, fresh] = winner.try_emplace(target(match), claim);
    if (!fresh) place->second = std::min(place->second, claim);
  }
  std::erase_if(matches, [&](const Match& match) {
    return winner.at(target(match)) != std::tuple(match.distance, match.query);
  });
  std::sort(matches.begin(), matches.end(), [](const Match& a, const Match& b) {
    return std::pair(a.query, a.entry.keyframe) < std::pair(b.query, b.entry.keyframe);
  });
  return matches;
}

bool DescriptorDatabase::operator==(const DescriptorDatabase& other) const {
  if (!(*tree_ == *other.tree_) || size_ != other.size_ || keyframes_.size() != other.keyframes_.size())
    return false;
  const auto sorted = [](std::vector<Entry> entries) {
    std::sort(entries.begin(), entries.end(),
              [](const Entry& a, const Entry& b) { return KeyOf(a) < KeyOf(b); });
    return entries;
  };
  return std::all_of(keyframes_.begin(), keyframes_.end(), [&](const auto& keyframe) {
    return other.Contains(keyframe.first) &&
           sorted(EntriesOf(keyframe.first)) == sorted(other.EntriesOf(keyframe.first));
  });
}

void AddObservation(const ImageFeatures& features, const Observation& observation, int levels_around,
                    DescriptorDatabase* database) {
  std::vector<DescribedKeypoint> places;
  DescribeKeypoint(features, observation.pixel, observation.level - levels_around,
                   observation.level + levels_around, &places);
  for (const DescribedKeypoint& place : places) {
    database->Add(
        {place.oriented.descriptor, observation.keyframe, observation.point, place.pixel, place.level});
  }
}

}  // namespace docent::engine
