// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "maps/storage/damaged_file.h"
#include "maps/storage/envelope.h"
#include "maps/storage/map_codec.h"
#include "maps/storage/map_record.h"
#include "maps/storage/tour_rows.h"

namespace docent::maps {

// The rows of a damaged library by what they belong to. A row is only used if its checksum confirms it. Where
// the file holds several rows for the same thing, the one that the file's trees lead to is used; one that was
// found in a page without them only where that one is missing, because it may be older. All functions throw
// docent::Error, with a message that says what is missing or damaged. One thread.
class SalvagedRows {
 public:
  // Reads the file without its log. Throws when it cannot be read or is no library.
  explicit SalvagedRows(const std::filesystem::path& path);

  // The format of the library; that of this program if the file's header is lost.
  std::int64_t format() const;
  // The maps of which something was found.
  std::set<std::uint64_t> MapKeys() const;
  MapInfo Map(std::uint64_t key) const;
  // One binary column of a map. `decode` throws for a candidate that is not valid; `current` is false for one
  // that may be of an older state of the map.
  using Decode = std::function<void(std::span<const std::uint8_t> bytes, bool current)>;
  void Part(std::uint64_t key, std::string_view part, const Decode& decode) const;
  bool HasPart(std::uint64_t key, std::string_view part) const {
    return parts_.contains({key, std::string(part)});
  }
  // The records of a damaged column that its block checksums confirm.
  Bytes ConfirmedRecordsOf(std::uint64_t key, std::string_view part, const EnvelopeKind& kind) const;
  cv::Mat Image(std::uint64_t key, const StoredKeyFrame& keyframe) const;
  AssetRecord Asset(const std::string& id) const;
  // Those that are readable; a sentence for each of the others is added to `problems`.
  std::vector<StoredLens> Lenses(std::vector<std::string>* problems) const;
  // The same of tours; their stops may be maps that are lost.
  std::vector<Tour> Tours(std::vector<std::string>* problems) const;
  std::uint64_t file_bytes() const { return file_.bytes(); }

 private:
  using Use = std::function<void(const SalvagedRow& row, bool current)>;
  using Places = std::vector<const RowPlace*>;
  void UseFirst(const Places& places, const std::string& missing, const Use& use) const;
  static Places Usable(const Places* all);

  DamagedFile file_;
  std::map<std::uint64_t, Places> maps_;
  std::map<std::pair<std::uint64_t, std::string>, Places> parts_;
  std::map<std::pair<std::uint64_t, std::uint32_t>, Places> images_;
  std::map<std::string, Places> assets_, lenses_, tours_;
};

}  // namespace docent::maps
