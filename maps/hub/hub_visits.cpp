// SPDX-License-Identifier: Apache-2.0
#include "maps/hub/hub_visits.h"

#include <algorithm>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string_view>
#include <utility>
#include <vector>

#include "maps/hub/hub.h"
#include "maps/hub/hub_connection.h"

namespace docent::maps {

namespace {

using VisitsJson = nlohmann::json;

constexpr std::string_view kVisitsPrefix = "visits-", kVisitsSuffix = ".jsonl";
constexpr std::size_t kMaxVisitBytes = std::size_t{1} << 20;  // Of a line, as on the hub.
constexpr std::size_t kVisitsAtOnce = 200;                    // In one request.

// "2026-11-24".
bool IsDay(std::string_view text) {
  if (text.size() != 10) return false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (i == 4 || i == 7 ? text[i] != '-' : text[i] < '0' || text[i] > '9') return false;
  }
  return true;
}

// The day in the name of a file; empty if it is no file of records.
std::string DayOf(const std::filesystem::path& file) {
  const std::string name = file.filename().string();
  if (!name.starts_with(kVisitsPrefix) || !name.ends_with(kVisitsSuffix)) return "";
  const std::string day =
      name.substr(kVisitsPrefix.size(), name.size() - kVisitsPrefix.size() - kVisitsSuffix.size());
  return IsDay(day) ? day : "";
}

bool IsVisit(const std::string& line) {
  const bool is_printable = std::none_of(
      line.begin(), line.end(), [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7F; });
  return is_printable && line.size() <= kMaxVisitBytes && VisitsJson::parse(line, nullptr, false).is_object();
}

std::vector<std::string> LinesOfFile(const std::filesystem::path& file) {
  std::vector<std::string> lines;
  std::ifstream stream(file);
  if (!stream) throw Error(file.string() + " cannot be read");
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

// Whether the last line of a file has no end, as after a full disk.
bool EndsWithinLine(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  char last = '\n';
  return stream.seekg(-1, std::ios::end) && stream.get(last) && last != '\n';
}

std::size_t SendVisits(HubConnection* connection, const VisitsJson& records) {
  std::size_t added = 0;
  connection->Transact(HubAccess::kWrite, [&](HubTransaction& work) {
    const std::int64_t count =
        work.Query("SELECT docent.hand_in_visits($1::jsonb)", {records.dump()}).Integer(0, 0);
    if (count < 0 || static_cast<std::size_t>(count) > records.size())
      throw Error(
          "the hub sent a number that is out of range; the database is damaged or is not a hub of Docent");
    added = static_cast<std::size_t>(count);
  });
  return added;
}

}  // namespace

HandedInVisits HandInVisits(const std::string& url, const std::filesystem::path& folder) {
  std::error_code error;
  if (!std::filesystem::is_directory(folder, error)) throw Error(folder.string() + " is no folder");
  const Hub hub(url);  // Checks its version.
  HubConnection connection(url);
  HandedInVisits result;
  VisitsJson records = VisitsJson::array();
  const auto send = [&] {
    if (!records.empty()) result.added += SendVisits(&connection, records);
    records = VisitsJson::array();
  };
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string day = DayOf(entry.path());
    if (day.empty()) continue;
    for (const std::string& line : LinesOfFile(entry.path())) {
      if (!IsVisit(line)) {
        ++result.skipped;
        continue;
      }
      records.push_back({{"day", day}, {"line", line}});
      if (records.size() == kVisitsAtOnce) send();
    }
  }
  send();
  return result;
}

std::size_t CollectVisits(const std::string& url, const std::filesystem::path& folder) {
  const Hub hub(url);  // Checks its version.
  HubConnection connection(url);
  std::map<std::string, std::vector<std::string>> by_day;
  connection.Transact(HubAccess::kRead, [&](HubTransaction& work) {
    const HubRows rows = work.Query(
        "SELECT to_char(day, 'YYYY-MM-DD'), line FROM docent.visits ORDER BY day, handed_in_at, hash");
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const std::string day = rows.Text(i, 0), line = rows.Text(i, 1);
      if (!IsDay(day) || !IsVisit(line))
        throw Error(
            "the hub sent a record of a visit that is not valid; the database is damaged or is not a hub of "
            "Docent");
      by_day[day].push_back(line);
    }
  });
  std::filesystem::create_directories(folder);
  std::size_t added = 0;
  for (const auto& [day, lines] : by_day) {
    const std::filesystem::path file =
        folder / (std::string(kVisitsPrefix) + day + std::string(kVisitsSuffix));
    std::set<std::string> there;
    if (std::filesystem::exists(file)) {
      for (std::string& line : LinesOfFile(file)) there.insert(std::move(line));
    }
    // A record that was cut off stays a line of its own, and costs no other one.
    bool is_cut_off = EndsWithinLine(file);
    std::ofstream stream(file, std::ios::app);
    for (const std::string& line : lines) {
      if (!there.insert(line).second) continue;
      if (std::exchange(is_cut_off, false)) stream << '\n';
      stream << line << '\n';
      ++added;
    }
    if (!stream.flush()) throw Error(file.string() + " cannot be written");
  }
  return added;
}

}  // namespace docent::maps
