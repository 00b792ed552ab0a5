// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <deque>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/visits/visit_record.h"
#include "engine/base/worker.h"

namespace docent::app {

// A record as one line of JSON, without its line end.
std::string VisitToJson(const VisitRecord& visit);
// Throws Error, which begins with `where`, for whatever VisitToJson does not write.
VisitRecord VisitFromJson(std::string_view text, const std::string& where);

// The records of all files visits-YYYY-MM-DD.jsonl of a folder, by time. A line that cannot be read costs
// that visit, and is described in *problems. Throws Error when the folder cannot be read.
std::vector<VisitRecord> ReadVisits(const std::filesystem::path& folder, std::vector<std::string>* problems);

// Appends records to the files of a folder, one file a day, on a thread of its own. Several devices may share
// the folder, since a record is written at once. Any thread.
class VisitLog {
 public:
  // Creates the folder if there is none. Throws Error when nothing can be written there.
  explicit VisitLog(std::filesystem::path folder);
  // Writes what has been given.
  ~VisitLog();
  VisitLog(const VisitLog&) = delete;
  VisitLog& operator=(const VisitLog&) = delete;

  // Does not wait for the disk.
  void Add(VisitRecord visit);
  // Waits until everything is written. Nothing may be added afterwards. Throws Error when any record is
  // missing, also if TakeProblem has said so.
  void Close();
  // Why a record was not written, as a sentence, once; empty otherwise.
  std::string TakeProblem();

 private:
  void Run(const std::stop_token& stop);

  const std::filesystem::path folder_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<VisitRecord> visits_;  // Guarded by mutex_, as the problem.
  std::string problem_;
  std::string failure_;           // Of the first record that is missing; guarded too.
  std::optional<Worker> worker_;  // Last: it uses the members above.
};

}  // namespace docent::app
