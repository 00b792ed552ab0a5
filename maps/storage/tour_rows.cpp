// SPDX-License-Identifier: Apache-2.0
#include "maps/storage/tour_rows.h"

#include <algorithm>
#include <limits>
#include <set>

#include "engine/base/error.h"
#include "maps/storage/byte_stream.h"
#include "maps/storage/checksum.h"
#include "maps/storage/rows.h"
#include "maps/storage/schema.h"

namespace docent::maps {

namespace {

Bytes EncodeStops(const std::vector<std::uint64_t>& stops) {
  ByteWriter writer;
  for (const std::uint64_t stop : stops) writer.Put(stop);
  return writer.Take();
}

std::vector<std::uint64_t> DecodeStops(std::span<const std::uint8_t> bytes) {
  if (bytes.size() % sizeof(std::uint64_t) != 0) throw Error("its list of stops is cut off");
  if (bytes.size() / sizeof(std::uint64_t) > kMaxTourStops) throw Error("it has too many stops");
  std::vector<std::uint64_t> stops;
  ByteReader reader(bytes);
  while (reader.remaining() > 0) stops.push_back(reader.Get<std::uint64_t>());
  return stops;
}

std::int64_t ChecksumOfRow(const std::string& name, const std::string& language, std::int64_t minutes,
                           std::span<const std::uint8_t> stops) {
  ByteWriter writer;
  writer.PutText(name);
  writer.PutText(language);
  writer.Put(minutes);
  return static_cast<std::int64_t>(Checksum(stops, Checksum(writer.bytes())));
}

bool IsPrintable(const std::string& text) {
  return std::none_of(text.begin(), text.end(),
                      [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7F; });
}

// The alphabet of a tag in lower case; what it means is known to the content library only.
bool CanBeTag(const std::string& text) {
  return std::all_of(text.begin(), text.end(),
                     [](char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '-'; });
}

// Adds or replaces the tour of this name.
void WriteTour(const Database& database, const Tour& tour) {
  if (const std::string fault = ProblemOf(tour); !fault.empty())
    throw Error(database.file() + ": the tour '" + tour.name + "' cannot be saved: " + fault);
  const Bytes stops = EncodeStops(tour.stops);
  database
      .Prepare(
          "INSERT OR REPLACE INTO tours (name, language, minutes, stops, checksum) VALUES (?, ?, ?, ?, ?)")
      .Bind(1, tour.name)
      .Bind(2, tour.language)
      .Bind(3, std::int64_t{tour.minutes})
      .Bind(4, std::span<const std::uint8_t>(stops))
      .Bind(5, ChecksumOfRow(tour.name, tour.language, tour.minutes, stops))
      .Run();
}

void RemoveTour(const Database& database, const std::string& name) {
  database.Prepare("DELETE FROM tours WHERE name = ?").Bind(1, name).Run();
}

}  // namespace

std::string ProblemOf(const Tour& tour) {
  if (tour.name.empty() || tour.name.size() > kMaxTourNameBytes || !IsPrintable(tour.name))
    return "its name does not have 1 to " + std::to_string(kMaxTourNameBytes) +
           " bytes, or has control characters";
  if (tour.language.size() > kMaxTourLanguageBytes)
    return "its language has more than " + std::to_string(kMaxTourLanguageBytes) + " bytes";
  if (!CanBeTag(tour.language)) return "its language is no language tag";
  if (tour.minutes < 0 || tour.minutes > kMaxTourMinutes)
    return "its minutes are not between 0 and " + std::to_string(kMaxTourMinutes);
  if (tour.stops.size() > kMaxTourStops)
    return "it has more than " + std::to_string(kMaxTourStops) + " stops";
  std::set<std::uint64_t> seen;
  for (const std::uint64_t stop : tour.stops) {
    if (stop == 0 || stop > static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max()))
      return "one of its stops is no map";
    if (!seen.insert(stop).second) return "it stops twice at the same map";
  }
  return "";
}

Tour CheckedTour(const TourRowValues& values) {
  if (values.checksum != ChecksumOfRow(values.name, values.language, values.minutes, values.stops))
    throw Error("its checksum does not match");
  Tour tour;
  tour.name = values.name;
  tour.language = values.language;
  tour.stops = DecodeStops(values.stops);
  // Beyond the limit the value could not be converted.
  tour.minutes = static_cast<int>(std::clamp<std::int64_t>(values.minutes, -1, kMaxTourMinutes + 1));
  if (const std::string fault = ProblemOf(tour); !fault.empty()) throw Error(fault);
  return tour;
}

std::vector<Tour> ReadTours(const Database& database, std::vector<std::string>* problems) {
  std::vector<Tour> tours;
  if (SchemaVersion(database) < kToursSince) return tours;
  Statement query =
      database.Prepare("SELECT name, language, minutes, stops, checksum FROM tours ORDER BY name");
  while (query.Step()) {
    const std::string name = query.Text(0);
    try {
      tours.push_back(CheckedTour({name, query.Text(1), query.Integer(2), query.Blob(3), query.Integer(4)}));
    } catch (const Error& error) {
      const std::string what = error.what();
      const std::string sentence = what.starts_with(database.file())
                                       ? what
                                       : database.file() + " is damaged: the tour '" + name + "': " + what;
      if (problems == nullptr) throw Error(sentence);
      problems->push_back(sentence);
    }
  }
  return tours;
}

void RewriteTours(const Database& database, const std::function<void(std::vector<Tour>*)>& change) {
  std::vector<std::string> ignored;
  const std::vector<Tour> before = ReadTours(database, &ignored);
  std::vector<Tour> after = before;
  change(&after);
  const auto is_in = [](const std::vector<Tour>& tours, const Tour& tour) {
    return std::find(tours.begin(), tours.end(), tour) != tours.end();
  };
  for (const Tour& tour : before) {
    if (!is_in(after, tour)) RemoveTour(database, tour.name);
  }
  std::set<std::string> names;
  for (const Tour& tour : after) {
    if (!names.insert(tour.name).second)
      throw Error(database.file() + ": there is already a tour named '" + tour.name + "'");
    if (is_in(before, tour)) continue;
    for (const std::uint64_t stop : tour.stops) {
      if (!ReadMapRow(database, stop))
        throw Error(database.file() + " has no map with the key " + std::to_string(stop));
    }
    WriteTour(database, tour);
  }
}

void ReplaceStop(const Database& database, std::uint64_t from, std::optional<std::uint64_t> into) {
  std::vector<std::string> ignored;
  for (Tour& tour : ReadTours(database, &ignored)) {
    const auto stop = std::find(tour.stops.begin(), tour.stops.end(), from);
    if (stop == tour.stops.end()) continue;
    if (into) {
      const auto other = std::find(tour.stops.begin(), tour.stops.end(), *into);
      *stop = *into;
      if (other != tour.stops.end()) tour.stops.erase(std::max(stop, other));
    } else {
      tour.stops.erase(stop);
    }
    WriteTour(database, tour);
  }
}

}  // namespace docent::maps
