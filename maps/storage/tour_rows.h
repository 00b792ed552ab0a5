// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "maps/storage/database.h"

// Tours through the maps of a library, one row per tour, by name (table `tours`). All functions but ProblemOf
// and CheckedTour run in a transaction of the caller.
namespace docent::maps {

// A tour: maps in the order in which visitors are led to them.
struct Tour {
  std::string name;                  // Unique in the library; as the name of a map.
  std::vector<std::uint64_t> stops;  // Keys of maps, each once. A tour that lost all its maps has none.
  std::string language;  // Of its texts, a tag as "de" or "es-419"; empty for that of the visitor.
  int minutes = 0;       // How long it takes, at most kMaxTourMinutes; 0 if that is not given.

  // Whether all fields are equal.
  bool operator==(const Tour& other) const = default;
};

inline constexpr std::size_t kMaxTourNameBytes = 200;     // Of one tour.
inline constexpr std::size_t kMaxTourLanguageBytes = 35;  // Of the tag; RFC 5646, section 4.4.1.
inline constexpr std::size_t kMaxTourStops = 1000;        // Of one tour.
inline constexpr int kMaxTourMinutes = 24 * 60;           // Of one tour.

// Why the values are invalid, as the end of a sentence about the tour ("its name ..."); empty if they are
// valid. Invalid values are neither written nor read.
std::string ProblemOf(const Tour& tour);

// The values of a row.
struct TourRowValues {
  std::string name, language;
  std::int64_t minutes = 0;
  std::span<const std::uint8_t> stops;
  std::int64_t checksum = 0;
};
// A tour from the values of its row. Throws Error when they or the checksum are not valid.
Tour CheckedTour(const TourRowValues& values);

// Reads all tours by ascending name; none from a format without the table. Of those that are damaged,
// `problems` gets a sentence that begins with the file's name; if it is null, the first one is thrown.
std::vector<Tour> ReadTours(const Database& database, std::vector<std::string>* problems = nullptr);
// Lets `change` add, change or remove tours among those that are readable. Throws Error, which begins with
// the file's name, if one of them is invalid then, two have one name, or a stop is no map of the library.
void RewriteTours(const Database& database, const std::function<void(std::vector<Tour>*)>& change);
// Puts another map in the place of one in all tours that stop there, or none. Tours that stop at both maps
// keep the earlier stop. Damaged tours stay as they are.
void ReplaceStop(const Database& database, std::uint64_t from, std::optional<std::uint64_t> into);

}  // namespace docent::maps
