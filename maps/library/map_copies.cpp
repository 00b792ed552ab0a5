// SPDX-License-Identifier: Apache-2.0
#include "maps/library/map_copies.h"

#include <algorithm>
#include <set>
#include <string_view>
#include <utility>

namespace docent::maps {

namespace {

using Appearance = std::vector<std::int8_t>;  // The pixels of a thumbnail.

struct SeenMap {
  MapInfo info;
  std::set<Appearance> thumbnails;  // Without repetitions: a camera that stands still says nothing.
};

bool IsOlder(const MapInfo& a, const MapInfo& b) {
  return std::pair(a.modified, a.key) < std::pair(b.modified, b.key);
}

bool AreCopies(const SeenMap& a, const SeenMap& b) {
  const bool a_is_smaller = a.thumbnails.size() < b.thumbnails.size();
  const std::set<Appearance>&few = (a_is_smaller ? a : b).thumbnails,
        &many = (a_is_smaller ? b : a).thumbnails;
  const auto shared = std::count_if(few.begin(), few.end(),
                                    [&](const Appearance& thumbnail) { return many.contains(thumbnail); });
  return shared > 0 && 2 * static_cast<std::size_t>(shared) >= few.size();
}

// The name without the number that FreeName has added. A year in brackets is none.
std::string WithoutNumber(const std::string& name) {
  const std::size_t begin = name.rfind(" (");
  if (begin == std::string::npos || !name.ends_with(')')) return name;
  const std::string_view number = std::string_view(name).substr(begin + 2, name.size() - begin - 3);
  constexpr std::size_t kMostDigits = 2;
  const bool is_number =
      !number.empty() && number.size() <= kMostDigits &&
      std::all_of(number.begin(), number.end(), [](char c) { return c >= '0' && c <= '9'; });
  return is_number ? name.substr(0, begin) : name;
}

}  // namespace

std::vector<MapCopy> FindCopies(const Library& library) {
  std::vector<SeenMap> maps;
  // Only maps that have a thumbnail in common are compared as a whole.
  std::map<Appearance, std::vector<std::size_t>> places;
  library.LoadAppearance([&](const MapInfo& info, const Library::Appearance& appearance) {
    SeenMap& map = maps.emplace_back();
    map.info = info;
    for (const engine::KeyFrameThumbnail& keyframe : appearance.thumbnails) {
      if (keyframe.thumbnail.pixels.empty() || !map.thumbnails.insert(keyframe.thumbnail.pixels).second)
        continue;
      places[keyframe.thumbnail.pixels].push_back(maps.size() - 1);
    }
  });
  std::set<std::pair<std::size_t, std::size_t>> pairs;
  for (const auto& [pixels, owners] : places) {
    for (std::size_t i = 1; i < owners.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) pairs.emplace(owners[j], owners[i]);
    }
  }
  std::map<std::uint64_t, MapCopy> found;  // By the key of the older map.
  for (const auto& [i, j] : pairs) {
    if (!AreCopies(maps[i], maps[j])) continue;
    const bool first_is_older = IsOlder(maps[i].info, maps[j].info);
    const MapInfo& older = maps[first_is_older ? i : j].info;
    const MapInfo& newer = maps[first_is_older ? j : i].info;
    const auto known = found.find(older.key);
    if (known == found.end()) {
      found.emplace(older.key, MapCopy{older, newer});
    } else if (IsOlder(known->second.newer, newer)) {
      known->second.newer = newer;
    }
  }
  std::vector<MapCopy> copies;
  copies.reserve(found.size());
  for (auto& [key, copy] : found) {
    // The newest of a chain of copies.
    for (auto next = found.find(copy.newer.key); next != found.end(); next = found.find(copy.newer.key))
      copy.newer = next->second.newer;
    copies.push_back(copy);
  }
  return copies;
}

std::map<std::uint64_t, std::uint64_t> ReplacedByCopies(const std::vector<MapCopy>& copies) {
  std::map<std::uint64_t, std::uint64_t> replaced;
  for (const MapCopy& copy : copies) replaced.emplace(copy.older.key, copy.newer.key);
  return replaced;
}

std::map<std::string, std::string> NamesForVisitors(const std::vector<MapInfo>& maps,
                                                    const std::vector<MapCopy>& copies) {
  std::map<std::string, std::string> names;
  for (const MapCopy& copy : copies) {
    const std::string plain = WithoutNumber(copy.newer.name);
    if (plain == copy.newer.name) continue;
    if (copy.older.name == plain) names[plain] = copy.newer.name;
    if (copy.older.name == plain || WithoutNumber(copy.older.name) == plain) names[copy.newer.name] = plain;
  }
  const std::map<std::uint64_t, std::uint64_t> replaced = ReplacedByCopies(copies);
  std::map<std::string, std::vector<std::string>> numbered;  // By the name without its number.
  std::set<std::string> taken;
  for (const MapInfo& map : maps) {
    taken.insert(map.name);
    const std::string plain = WithoutNumber(map.name);
    if (plain != map.name && !replaced.contains(map.key) && !names.contains(map.name))
      numbered[plain].push_back(map.name);
  }
  for (const auto& [name, shown] : names) taken.insert(shown);
  for (const auto& [plain, of] : numbered) {
    if (of.size() == 1 && !taken.contains(plain)) names[of.front()] = plain;
  }
  return names;
}

std::string TextOf(const MapCopy& copy) {
  return "'" + copy.older.name + "' and '" + copy.newer.name +
         "' show the same images; visitors are shown the newer one, '" + copy.newer.name +
         "'. Remove the one that is not needed";
}

}  // namespace docent::maps
