// SPDX-License-Identifier: Apache-2.0
#include "app/session/session_saving.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "app/session/library_scene.h"
#include "engine/base/error.h"
#include "maps/storage/checksum.h"

namespace docent::app {

// Called on the saver's thread once the record is on disk.
void SessionSaving::OnSaved(const maps::MapRecord& record) {
  const std::string revision =
      record.snapshot ? "revision " + std::to_string(record.snapshot->revision) : "content";
  spdlog::debug("saved {}: {}", record.name, revision);
  keys_.Refill();
  {
    const std::scoped_lock lock(mutex_);
    saved_at_ = std::chrono::steady_clock::now();
    submitted_.erase(record.key);
  }
  if (options_.on_saved) options_.on_saved();
}

void SessionSaving::Start() {
  // Unlimited capacity, so that submitting never waits. In lockstep there is no maintenance.
  constexpr std::size_t kAnyNumber = std::numeric_limits<std::size_t>::max();
  maps::Saver::Maintenance maintenance;
  if (options_.threaded && options_.maintenance)
    maintenance = [this](const std::atomic<bool>& interrupt) { return maintenance_.Run(interrupt); };
  saver_.emplace(
      library_, kAnyNumber, [this](const maps::MapRecord& record) { OnSaved(record); },
      std::move(maintenance));
}

// Returns false, and says why once, if the content cannot be stored: a join of two maps may exceed a limit of
// scenes, and the library of a stranger may have names that no scene may refer to.
bool SessionSaving::AddContent(SessionMap* map, Timestamp time, maps::MapRecord* record) {
  try {
    record->scene = std::make_shared<maps::SceneRecord>(RecordFromScene(*map->scene));
    record->history = std::make_shared<maps::SceneRecord>(RecordFromHistory(map->history, *map->scene));
  } catch (const Error& error) {
    submitted_.insert(map->key);
    const std::string problem = "the map '" + map->name + "' cannot be saved: " + error.what();
    if (std::exchange(map->save_problem, problem) == problem) return false;
    state_.AddEvent(time, "warning", problem);
    for (SessionCamera& camera : state_.cameras) camera.Advise(problem);
    return false;
  }
  map->save_problem.clear();
  map->content_left_out = false;
  map->stored_scene = maps::SceneTextChecksum(record->scene->text);
  return true;
}

// Passes the changes of a map to the saver, which writes them in the background.
void SessionSaving::SaveMap(SessionMap* map, Timestamp time) {
  if (!saver_ || discards_changes_ || !map->Exists() || !map->NeedsSave() ||
      !map->snapshot->HasFinitePoints())
    return;
  maps::MapRecord record;
  record.key = map->key;
  record.name = map->name;
  record.policy = map->policy;
  record.joined_keys = map->joined_keys;
  const bool structure = map->snapshot != map->saved_snapshot;
  const bool content = map->scene != map->saved_scene;
  if (structure) record.snapshot = map->snapshot;
  if (content && !AddContent(map, time, &record)) return;
  for (const engine::EstimatedLens& lens : system_.EstimatedLenses()) {
    if (lens.focal_sigma <= options_.mapper.lens.max_sigma)
      record.lenses.push_back({lens.name, *lens.model, lens.focal_sigma, lens.fixed});
  }
  map->saved_snapshot = map->snapshot;
  map->saved_scene = map->scene;
  map->changed = true;
  system_.SetPermissions(map->key, map->Permissions());
  submitted_.insert(map->key);
  saver_->Submit(std::move(record));
  state_.AddEvent(
      time, "save",
      map->name + (structure ? ": " + std::to_string(map->snapshot->keyframes.size()) + " keyframes, " +
                                   std::to_string(map->snapshot->points.size()) + " points"
                             : ": content"));
}

void SessionSaving::Autosave(Timestamp time) {
  if (!saver_) return;
  // After a pause, in which time passed without images, their times go on where they were.
  if (!last_save_ || time < *last_save_) last_save_ = time;
  // Without automatic saving, a failed save is reported all the same.
  constexpr Timestamp kReportInterval = std::chrono::seconds(10);
  const bool saves = options_.autosave_interval > Timestamp{};
  if (time - *last_save_ < (saves ? options_.autosave_interval : kReportInterval)) return;
  last_save_ = time;
  ReportFailure(time);
  if (!saves) return;
  for (auto& [key, map] : state_.maps) {
    if (!system_.IsProvisional(key)) SaveMap(&map, time);
  }
}

void SessionSaving::SaveAll(Timestamp time) {
  for (auto& [key, map] : state_.maps) SaveMap(&map, time);
}

// A failed save does not end the session: it is reported at once, and the next save writes everything again
// that any save since the last report may not have written. Changes that a new policy forbids to write were
// on disk before the policy changed (see SetPolicy).
void SessionSaving::ReportFailure(Timestamp time) {
  const std::exception_ptr failure = TakeError();
  if (!failure) return;
  try {
    std::rethrow_exception(failure);
  } catch (const std::exception& error) {
    spdlog::warn("{}", error.what());
    state_.AddEvent(time, "warning", error.what());
  }
  for (auto& [key, map] : state_.maps) {
    if (!map.changed) continue;
    if (maps::MayChangeStructure(map.policy)) map.saved_snapshot.reset();
    if (maps::MayChangeContent(map.policy) && !map.content_left_out) map.saved_scene.reset();
  }
}

bool SessionSaving::FlushToLibrary(std::uint64_t key, const std::string& name, Timestamp time,
                                   std::unique_lock<std::mutex>* lock) {
  if (!saver_) return false;
  // Before the lock is taken again, the thread of another camera may submit something.
  do {
    lock->unlock();
    saver_->InterruptMaintenance();  // it may write the map as it was
    saver_->Flush();
    lock->lock();
  } while (saver_->pending() > 0);
  ReportFailure(time);
  const SessionMap* const map = state_.FindMap(key);
  if (map == nullptr || !map->Exists())
    throw Error("the map '" + name + "' was discarded or joined meanwhile");
  const std::vector<maps::MapInfo> stored = library_->List();
  return std::any_of(stored.begin(), stored.end(),
                     [&](const maps::MapInfo& info) { return info.key == key; });
}

void SessionSaving::InterruptMaintenance() {
  if (saver_) saver_->InterruptMaintenance();
}

SavingStatus SessionSaving::Status() const {
  SavingStatus status;
  if (!saver_) return status;
  status.unsaved = saver_->pending() > 0;
  const std::scoped_lock lock(mutex_);
  status.saved_at = saved_at_;
  for (const auto& [key, map] : state_.maps) {
    // A save that was submitted may have failed.
    const bool needs_save = map.NeedsSave() && map.snapshot->HasFinitePoints();
    status.unsaved = status.unsaved || (map.Exists() && (needs_save || submitted_.contains(key)));
  }
  return status;
}

void SessionSaving::EndMaintenance() {
  if (saver_) saver_->EndMaintenance();
}

void SessionSaving::Flush() {
  if (saver_) saver_->Flush();
}

// A library that cannot be read does not say which maps it has; then nothing more than the changes is called
// lost.
bool SessionSaving::IsInLibrary(std::uint64_t key) const {
  try {
    const std::vector<maps::MapInfo> stored = library_->List();
    return std::any_of(stored.begin(), stored.end(),
                       [&](const maps::MapInfo& info) { return info.key == key; });
  } catch (const Error&) {
    return true;
  }
}

std::string SessionSaving::DescribeUnsaved() const {
  std::string names;
  const std::scoped_lock lock(mutex_);
  for (const std::uint64_t key : submitted_) {
    const SessionMap* const map = state_.FindMap(key);
    if (map == nullptr || !map->Exists()) continue;
    if (discards_changes_ && !map->save_problem.empty()) continue;
    names += (names.empty() ? "" : ", ") +
             std::string(IsInLibrary(key) ? "the last changes of the map '" : "the map '") + map->name + "'";
  }
  return names.empty() ? "" : "Lost: " + names + ".";
}

std::exception_ptr SessionSaving::TakeError() {
  return saver_ ? saver_->TakeError() : nullptr;
}

}  // namespace docent::app
