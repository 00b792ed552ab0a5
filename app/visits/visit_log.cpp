// SPDX-License-Identifier: Apache-2.0
#include "app/visits/visit_log.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>

#include "app/files/checked_file.h"
#include "app/files/text_file.h"
#include "engine/base/error.h"

namespace docent::app {

namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMaxRecordBytes = 4 << 20;
constexpr std::size_t kMaxFileBytes = std::size_t{1} << 30;  // Of one day.
constexpr double kMaxSeconds = 1e7, kMaxPlace = 1e12;
constexpr std::size_t kMaxName = 400;  // Bytes; names of maps are shorter.

std::string TimeText(std::chrono::sys_seconds time) {
  const auto day = std::chrono::floor<std::chrono::days>(time);
  const std::chrono::year_month_day date(day);
  const std::chrono::hh_mm_ss clock(time - day);
  char text[64];
  std::snprintf(text, sizeof text, "%04d-%02u-%02uT%02d:%02d:%02dZ", static_cast<int>(date.year()),
                static_cast<unsigned>(date.month()), static_cast<unsigned>(date.day()),
                static_cast<int>(clock.hours().count()), static_cast<int>(clock.minutes().count()),
                static_cast<int>(clock.seconds().count()));
  return text;
}

std::optional<std::chrono::sys_seconds> ParseTime(const std::string& text) {
  int year = 0, month = 0, day = 0, hour = 0, minute = 0, second = 0, end = 0;
  if (std::sscanf(text.c_str(), "%4d-%2d-%2dT%2d:%2d:%2dZ%n", &year, &month, &day, &hour, &minute, &second,
                  &end) != 6 ||
      static_cast<std::size_t>(end) != text.size())
    return std::nullopt;
  const std::chrono::year_month_day date(std::chrono::year(year),
                                         std::chrono::month(static_cast<unsigned>(month)),
                                         std::chrono::day(static_cast<unsigned>(day)));
  if (!date.ok() || hour < 0 || hour > 23 || minute < 0 || minute > 59 || second < 0 || second > 60)
    return std::nullopt;
  return std::chrono::sys_days(date) + std::chrono::hours(hour) + std::chrono::minutes(minute) +
         std::chrono::seconds(second);
}

// Millimetres or milliseconds are enough, and keep the lines short.
double Rounded(double value) {
  return std::round(value * 1000) / 1000;
}

Json PlaceToJson(const Eigen::Vector3d& place) {
  return {Rounded(place.x()), Rounded(place.y()), Rounded(place.z())};
}

double NumberFrom(const Json& json, double least, double most) {
  const double number = json.is_number() ? json.get<double>() : std::nan("");
  if (!(number >= least && number <= most)) throw Error("a number is out of range");
  return number;
}

std::uint64_t CountFrom(const Json& json, std::uint64_t most) {
  if (!json.is_number_unsigned() || json.get<std::uint64_t>() > most) throw Error("a number is out of range");
  return json.get<std::uint64_t>();
}

std::string NameFrom(const Json& json) {
  if (!json.is_string() || json.get_ref<const std::string&>().size() > kMaxName)
    throw Error("a name is not valid");
  return json.get<std::string>();
}

Eigen::Vector3d PlaceFrom(const Json& json) {
  if (!json.is_array() || json.size() != 3) throw Error("a place is not valid");
  Eigen::Vector3d place;
  for (int i = 0; i < 3; ++i) place[i] = NumberFrom(json[static_cast<std::size_t>(i)], -kMaxPlace, kMaxPlace);
  return place;
}

const Json& ListIn(const Json& json, const char* name) {
  const Json& list = json.at(name);
  if (!list.is_array()) throw Error(std::string("'") + name + "' is not a list");
  return list;
}

VisitRecord VisitFrom(const Json& json) {
  if (!json.is_object() || json.value("docent_visit", 0) != 1)
    throw Error("its version is unknown to this program");
  VisitRecord visit;
  const auto begin = ParseTime(NameFrom(json.at("begin")));
  if (!begin) throw Error("the time is not valid");
  visit.begin = *begin;
  visit.duration_s = NumberFrom(json.at("seconds"), 0, kMaxSeconds);
  visit.images = CountFrom(json.at("images"), std::uint64_t{1} << 40);
  visit.localized = CountFrom(json.at("localized"), visit.images);
  visit.tour = NameFrom(json.at("tour"));
  visit.stops = static_cast<std::uint32_t>(CountFrom(json.at("stops"), 1'000'000));
  visit.seen = static_cast<std::uint32_t>(CountFrom(json.at("seen"), visit.stops));
  for (const Json& stay : ListIn(json, "stays"))
    visit.stays.push_back({NameFrom(stay.at("map")), NumberFrom(stay.at("begin"), 0, kMaxSeconds),
                           NumberFrom(stay.at("seconds"), 0, kMaxSeconds)});
  for (const Json& loss : ListIn(json, "losses"))
    visit.losses.push_back({NameFrom(loss.at("map")), NumberFrom(loss.at("begin"), 0, kMaxSeconds),
                            NumberFrom(loss.at("seconds"), 0, kMaxSeconds), PlaceFrom(loss.at("place"))});
  for (const Json& step : ListIn(json, "path")) {
    if (visit.stays.empty()) throw Error("the path has no stay");
    visit.path.push_back({static_cast<std::uint32_t>(CountFrom(step.at("stay"), visit.stays.size() - 1)),
                          PlaceFrom(step.at("place"))});
  }
  return visit;
}

// Whether the last line of a file has no end: a full disk has cut it off.
bool IsLineCutOff(int file) {
  const off_t size = lseek(file, 0, SEEK_END);
  char last = '\n';
  return size > 0 && pread(file, &last, 1, size - 1) == 1 && last != '\n';
}

// Throws Error.
void AppendLine(const std::filesystem::path& path, std::string line) {
  const int file = open(path.c_str(), O_RDWR | O_APPEND | O_CREAT | O_CLOEXEC, 0644);
  if (file < 0) throw Error("cannot write " + path.string() + ": " + std::generic_category().message(errno));
  if (IsLineCutOff(file)) line.insert(0, 1, '\n');
  const ssize_t written = write(file, line.data(), line.size());
  const int problem = written < 0 ? errno : ENOSPC;
  close(file);
  if (written != static_cast<ssize_t>(line.size()))
    throw Error("cannot write " + path.string() + ": " + std::generic_category().message(problem));
}

}  // namespace

std::string VisitToJson(const VisitRecord& visit) {
  Json json = {{"docent_visit", 1},
               {"begin", TimeText(visit.begin)},
               {"seconds", Rounded(visit.duration_s)},
               {"images", visit.images},
               {"localized", visit.localized},
               {"tour", visit.tour},
               {"stops", visit.stops},
               {"seen", visit.seen},
               {"stays", Json::array()},
               {"losses", Json::array()},
               {"path", Json::array()}};
  for (const VisitRecord::Stay& stay : visit.stays)
    json["stays"].push_back(
        {{"map", stay.map}, {"begin", Rounded(stay.begin_s)}, {"seconds", Rounded(stay.duration_s)}});
  for (const VisitRecord::Loss& loss : visit.losses)
    json["losses"].push_back({{"map", loss.map},
                              {"begin", Rounded(loss.begin_s)},
                              {"seconds", Rounded(loss.duration_s)},
                              {"place", PlaceToJson(loss.place)}});
  for (const VisitRecord::Step& step : visit.path)
    json["path"].push_back({{"stay", step.stay}, {"place", PlaceToJson(step.place)}});
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

VisitRecord VisitFromJson(std::string_view text, const std::string& where) {
  try {
    if (text.size() > kMaxRecordBytes) throw Error("it is too long");
    return VisitFrom(Json::parse(text));
  } catch (const Json::exception&) {
    throw Error(where + ": this is not a record of a visit.");
  } catch (const Error& error) {
    throw Error(where + ": this is not a record of a visit: " + error.what() + ".");
  }
}

std::vector<VisitRecord> ReadVisits(const std::filesystem::path& folder, std::vector<std::string>* problems) {
  std::vector<std::filesystem::path> files;
  std::error_code error;
  for (std::filesystem::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    if (name.starts_with("visits-") && name.ends_with(".jsonl")) files.push_back(entry->path());
  }
  if (error) throw Error("Cannot read the folder " + folder.string() + ": " + error.message() + ".");
  std::sort(files.begin(), files.end());
  std::vector<VisitRecord> visits;
  for (const std::filesystem::path& file : files) {
    const std::string text = ReadTextFile(file, kMaxFileBytes);
    std::size_t number = 0;
    for (std::size_t begin = 0; begin < text.size(); ++number) {
      const std::size_t end = std::min(text.find('\n', begin), text.size());
      const std::string_view line = std::string_view(text).substr(begin, end - begin);
      begin = end + 1;
      if (line.empty()) continue;
      try {
        visits.push_back(
            VisitFromJson(line, file.filename().string() + ", line " + std::to_string(number + 1)));
      } catch (const Error& problem) {
        problems->push_back(problem.what());
      }
    }
  }
  std::stable_sort(visits.begin(), visits.end(),
                   [](const auto& a, const auto& b) { return a.begin < b.begin; });
  return visits;
}

VisitLog::VisitLog(std::filesystem::path folder) : folder_(std::move(folder)) {
  MakeFolder(folder_);
  if (access(folder_.c_str(), W_OK | X_OK) != 0)
    throw Error("The folder " + folder_.string() +
                " cannot be written: " + std::generic_category().message(errno) + ".");
  worker_.emplace("visits", [this](const std::stop_token& stop) { Run(stop); });
}

VisitLog::~VisitLog() = default;

void VisitLog::Add(VisitRecord visit) {
  {
    const std::scoped_lock lock(mutex_);
    visits_.push_back(std::move(visit));
  }
  changed_.notify_one();
}

void VisitLog::Close() {
  worker_->RequestStop();
  worker_->Join();
  const std::scoped_lock lock(mutex_);
  if (!failure_.empty()) throw Error(failure_);
}

std::string VisitLog::TakeProblem() {
  const std::scoped_lock lock(mutex_);
  return std::exchange(problem_, {});
}

void VisitLog::Run(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, stop, [this] { return !visits_.empty(); });
    if (visits_.empty()) return;  // A stop was requested, and everything is written.
    const VisitRecord visit = std::move(visits_.front());
    visits_.pop_front();
    lock.unlock();
    std::string problem;
    try {
      const std::string day = TimeText(visit.begin).substr(0, std::strlen("YYYY-MM-DD"));
      AppendLine(folder_ / ("visits-" + day + ".jsonl"), VisitToJson(visit) + "\n");
    } catch (const Error& error) {
      problem = std::string("A visit is missing in the log: ") + error.what() + ".";
    }
    lock.lock();
    if (problem.empty()) continue;
    problem_ = problem;
    if (failure_.empty()) failure_ = problem;
  }
}

}  // namespace docent::app
