// SPDX-License-Identifier: Apache-2.0
#include "maps/maintenance/salvaged_rows.h"

#include <algorithm>

#include "engine/base/error.h"
#include "maps/storage/block_checks.h"
#include "maps/storage/lens_rows.h"
#include "maps/storage/library_identity.h"
#include "maps/storage/rows.h"
#include "maps/storage/schema.h"

namespace docent::maps {

namespace {

std::string TextIn(const SalvagedValue& value) {
  return {value.bytes.begin(), value.bytes.end()};
}

// Null if there is none.
template <typename Map>
const typename Map::mapped_type* FindIn(const Map& map, const typename Map::key_type& key) {
  const auto found = map.find(key);
  return found == map.end() ? nullptr : &found->second;
}

MapRowValues MapValuesOf(const SalvagedRow& row) {
  MapRowValues values;
  values.key = row.values[0].integer;
  values.name = TextIn(row.values[1]);
  values.policy = TextIn(row.values[2]);
  for (std::size_t i = 0; i < values.numbers.size(); ++i) values.numbers[i] = row.values[3 + i].integer;
  if (row.values[11].type == SalvagedValue::Type::kBlob) values.bounds = row.values[11].bytes;
  values.checksum = row.values[12].integer;
  return values;
}

}  // namespace

SalvagedRows::SalvagedRows(const std::filesystem::path& path) : file_(path) {
  bool any = false;
  for (std::size_t table = 0; table < kSalvagedTables; ++table) {
    for (const RowPlace& place : file_.rows(static_cast<SalvagedTable>(table))) {
      // Where the whole table is there, other rows were replaced or removed.
      if (place.found != RowPlace::Page::kReached && file_.complete(place.table)) continue;
      any = true;
      switch (place.table) {
        case SalvagedTable::kMaps:
          maps_[place.key].push_back(&place);
          break;
        case SalvagedTable::kParts:
          parts_[{place.key, place.name}].push_back(&place);
          break;
        case SalvagedTable::kImages:
          images_[{place.key, place.keyframe}].push_back(&place);
          break;
        case SalvagedTable::kAssets:
          assets_[place.name].push_back(&place);
          break;
        case SalvagedTable::kLenses:
          lenses_[place.name].push_back(&place);
          break;
        case SalvagedTable::kTours:
          tours_[place.name].push_back(&place);
          break;
      }
    }
  }
  if (file_.application_id() != kApplicationId && !any)
    throw Error(path.string() + " is not a library of maps");
}

std::int64_t SalvagedRows::format() const {
  const bool known = file_.format() >= 1 && file_.format() <= kSchemaVersion;
  return known ? std::int64_t{file_.format()} : kSchemaVersion;
}

std::set<std::uint64_t> SalvagedRows::MapKeys() const {
  std::set<std::uint64_t> keys;
  // Without its entry, a map is known by its parts, unless they are left of one that was removed.
  const auto add = [&](const RowPlace& place) {
    if (place.found == RowPlace::Page::kReached ||
        (place.found == RowPlace::Page::kUnreached && !file_.complete(SalvagedTable::kMaps)))
      keys.insert(place.key);
  };
  for (const RowPlace& place : file_.rows(SalvagedTable::kMaps)) add(place);
  for (const RowPlace& place : file_.rows(SalvagedTable::kParts)) add(place);
  return keys;
}

SalvagedRows::Places SalvagedRows::Usable(const Places* all) {
  if (all == nullptr) return {};
  Places usable = *all;
  // A row that was found in its tree is the current one, even if it is damaged.
  if (!usable.empty() && usable.front()->found == RowPlace::Page::kReached)
    std::erase_if(usable, [](const RowPlace* place) { return place->found != RowPlace::Page::kReached; });
  return usable;
}

// Tries the places in their order until `use` does not throw.
void SalvagedRows::UseFirst(const Places& places, const std::string& missing, const Use& use) const {
  std::string problem;
  for (const RowPlace* place : places) {
    const std::optional<SalvagedRow> row = file_.Read(*place);
    if (!row) continue;
    try {
      use(*row, place->found == RowPlace::Page::kReached);
      return;
    } catch (const Error& error) {
      if (problem.empty()) problem = error.what();
    }
  }
  throw Error(problem.empty() ? missing : problem);
}

MapInfo SalvagedRows::Map(std::uint64_t key) const {
  MapInfo info;
  const Places places = Usable(FindIn(maps_, key));
  if (places.empty()) throw Error("its entry is missing");
  try {
    UseFirst(places, "it cannot be read",
             [&](const SalvagedRow& row, bool) { info = CheckedMap(MapValuesOf(row)); });
  } catch (const Error& error) {
    throw Error("the entry of map " + std::to_string(key) + ": " + error.what());
  }
  return info;
}

void SalvagedRows::Part(std::uint64_t key, std::string_view part, const Decode& decode) const {
  UseFirst(Usable(FindIn(parts_, {key, std::string(part)})),
           "its part '" + std::string(part) + "' is missing",
           [&](const SalvagedRow& row, bool current) { decode(row.values[2].bytes, current); });
}

Bytes SalvagedRows::ConfirmedRecordsOf(std::uint64_t key, std::string_view part,
                                       const EnvelopeKind& kind) const {
  Bytes records;
  Part(key, part, [&](std::span<const std::uint8_t> column, bool) {
    Part(key, BlockChecksOf(part), [&](std::span<const std::uint8_t> checks, bool) {
      records = ConfirmedRecords(kind, key, column, checks);
    });
  });
  return records;
}

cv::Mat SalvagedRows::Image(std::uint64_t key, const StoredKeyFrame& keyframe) const {
  cv::Mat image;
  const engine::KeyFrameId id = keyframe.keyframe.id;
  const Places* const places = FindIn(images_, {key, id});
  // The keyframe has the hash of its image, so that any row with that image is the right one.
  UseFirst(places != nullptr ? *places : Places{},
           "the image of keyframe " + std::to_string(id) + " is missing",
           [&](const SalvagedRow& row, bool) { image = DecodeImage(key, keyframe, row.values[2].bytes); });
  return image;
}

AssetRecord SalvagedRows::Asset(const std::string& id) const {
  AssetRecord asset;
  const Places* const places = FindIn(assets_, id);
  UseFirst(places != nullptr ? *places : Places{}, "the asset " + id + " is missing",
           [&](const SalvagedRow& row, bool) {
             asset = CheckedAsset(id, TextIn(row.values[1]), row.values[2].bytes, row.values[3].integer);
           });
  return asset;
}

std::vector<StoredLens> SalvagedRows::Lenses(std::vector<std::string>* problems) const {
  std::vector<StoredLens> lenses;
  for (const auto& [camera, places] : lenses_) {
    try {
      UseFirst(Usable(&places), "it cannot be read", [&, &name = camera](const SalvagedRow& row, bool) {
        const StoredLens lens = CheckedLens(name, row.values[1].bytes, row.values[2].integer);
        if (!IsLibraryIdentity(lens)) lenses.push_back(lens);
      });
    } catch (const Error& error) {
      // Such a row may also be one of another program; only what a camera can be called is worth a sentence.
      if (camera.size() <= kMaxCameraNameBytes)
        problems->push_back("the lens of camera '" + camera + "': " + error.what());
    }
  }
  return lenses;
}

std::vector<Tour> SalvagedRows::Tours(std::vector<std::string>* problems) const {
  std::vector<Tour> tours;
  for (const auto& [tour, places] : tours_) {
    try {
      UseFirst(Usable(&places), "it cannot be read", [&, &name = tour](const SalvagedRow& row, bool) {
        tours.push_back(CheckedTour({name, TextIn(row.values[1]), row.values[2].integer, row.values[3].bytes,
                                     row.values[4].integer}));
      });
    } catch (const Error& error) {
      if (tour.size() <= kMaxTourNameBytes) problems->push_back("the tour '" + tour + "': " + error.what());
    }
  }
  return tours;
}

}  // namespace docent::maps
