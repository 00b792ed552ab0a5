// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <stop_token>
#include <string>
#include <vector>

#include "engine/base/worker.h"
#include "engine/mapping/mapper.h"
#include "engine/system/map_comparer.h"

namespace docent::engine {

// Runs the one mapper of a session: on a thread of its own or, in lockstep, on the thread that calls
// RunLockstep. The mapper works on one map at a time, identified by its key; 0 is none. All results are
// delivered through the callback, on the thread that runs the mapper, together with the key of their map; no
// lock is held during the callback.
//
// Adopt, Start, Join, Offer and the const functions may be called from any thread and never wait for a step:
// requests that cannot be served while the mapper works are served before its next step.
class MappingThread {
 public:
  struct MapperUpdate {
    std::uint64_t key = 0;
    std::uint64_t adoption = 0;  // number of the Adopt after which it was computed; 0 for none
    std::shared_ptr<const MapSnapshot> snapshot;  // null when nothing new was published
    std::vector<MapperEvent> events;
    // All estimated lenses if one of the events is LensesEstimated, else empty. `snapshot` uses them.
    std::vector<EstimatedLens> lenses = {};
    // Result of a Join. When the maps were joined, `snapshot` is the joined map.
    struct Join {
      std::uint64_t number = 0;  // that the request was given
      MapJoinAttempt attempt;
    };
    std::optional<Join> join = std::nullopt;
    std::string failure;  // the exception that ended the thread; empty while it runs
  };
  using UpdateCallback = std::function<void(const MapperUpdate&)>;

  MappingThread(const MapperOptions& options, bool threaded, UpdateCallback on_update);

  // Continues with this map; pending requests for another one are dropped. A null snapshot waits for Start.
  // Returns the number of the adoption, from 1: updates with a smaller one are of the map before, which may
  // have the same key.
  std::uint64_t Adopt(std::uint64_t key, std::shared_ptr<const MapSnapshot> snapshot);
  // Initializes the map of `key` from its first two views; false when another map was adopted since. The pair
  // waits while the queue of keyframes is full.
  bool Start(std::uint64_t key, InitialPair pair);
  // Whether the views given to Start for the map of `key` are waiting or being used.
  bool IsStarting(std::uint64_t key) const;
  // Joins another map into the map of `key` (see Mapper::Join). Unless in lockstep, the maps are compared on
  // a thread of their own, while the mapper extends its map. Ignored when a map, even the same one, is
  // adopted before it is done; then no update reports it. A newer request replaces a pending one.
  void Join(std::uint64_t key, std::uint64_t number, std::shared_ptr<const MapSnapshot> other);
  // Returns false when the mapper is busy, works on another map or has failed.
  bool Offer(std::uint64_t key, KeyFrameCandidate candidate, std::vector<PointReport> reports);
  // Estimates the readout time of a camera; nothing happens where Offer would return false.
  void EstimateReadout(std::uint64_t key, TrackedCorners corners);

  // Lockstep only: runs steps until no urgent work is left (at most kMaxSteps), then one step of idle work.
  void RunLockstep();
  // Threaded only: every request was served, and no maps are being compared.
  bool IsIdle() const;
  // Threaded only: waits while the mapper works or maps are compared, at most until `latest`, and beyond it
  // while the mapper is a whole keyframe behind or initializes a map.
  void WaitUntilIdle(std::chrono::steady_clock::time_point latest, const std::stop_token& stop);

  MapperTimes Times() const { return mapper_.Times(); }
  // Ends the thread and rethrows its exception; then finishes the work that the last keyframes require, for
  // two seconds at most. Nothing may be requested afterwards.
  void Finish();

 private:
  static constexpr int kMaxSteps = 20;
  struct Adoption {
    std::uint64_t number = 0;
    std::uint64_t key = 0;
    std::shared_ptr<const MapSnapshot> snapshot;
  };

  struct JoinRequest {
    std::uint64_t number = 0;
    std::shared_ptr<const MapSnapshot> other;
  };

  void Run(const std::stop_token& stop);
  void ReportFailure();
  void ApplyAdoption();       // serves a pending adoption and start
  void JoinIfRequested();     // lockstep only, after ApplyAdoption
  void CompareIfRequested();  // threaded only, after ApplyAdoption
  void JoinIfCompared();      // the same
  void Compare(std::uint64_t number, std::shared_ptr<const MapSnapshot> other);  // with mutex_ held
  void ReportJoin(std::uint64_t number, MapJoinAttempt attempt);
  bool HasNothingToDo() const { return idle_ && !has_work_ && !comparing_; }  // with mutex_ held
  bool StepOnce();
  bool IsBehind() const;  // with mutex_ held

  Mapper mapper_;
  const UpdateCallback on_update_;
  // Accessed only by the thread that runs the mapper.
  std::uint64_t key_ = 0;
  std::uint64_t adoption_number_ = 0;
  std::shared_ptr<const MapSnapshot> last_snapshot_;
  std::set<std::uint64_t> loops_to_adjust_;  // maps that were left with a loop or a join to be adjusted
  bool compared_again_ = false;              // the first result of this comparison did not apply any more

  mutable std::mutex mutex_;  // guards the members below; never held during a step
  std::condition_variable_any changed_;
  std::uint64_t requested_key_ = 0;
  std::uint64_t adoptions_ = 0;
  std::optional<Adoption> adoption_;
  std::optional<InitialPair> pair_;
  std::optional<JoinRequest> join_;
  std::atomic<bool> interrupt_join_{false};  // read without the lock by the join that it interrupts
  bool comparing_ = false;                   // two maps are being compared, or the result was not used yet
  bool compared_ = false;                    // the result is there
  bool starting_ = false;                    // from Start until its map or its failure was reported
  bool has_work_ = false;                    // a request came since the last idle step
  bool idle_ = false;                        // the thread waits for work
  bool failed_ = false;                      // the thread ended with an exception, which Finish rethrows
  MapComparer comparer_;                     // it uses the members above
  std::optional<Worker> worker_;             // last: it uses the other members
};

}  // namespace docent::engine
