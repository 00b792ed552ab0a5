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
#include <stop_token>
#include <vector>

#include "engine/base/worker.h"
#include "engine/mapping/mapper.h"

namespace docent::app {

// The one mapper of a session, and who steps it: a thread of its own, or, in lockstep, whoever calls
// RunInTurn. It works on one map at a time, named by its key; 0 is none. Everything it brings about leaves
// through the callback, on the thread that steps, together with the key it belongs to; the callback is called
// without any lock held here.
//
// Adopt, Start, Join, Offer and the questions may be called from any thread and never wait for a step: what
// cannot be done while the mapper works is done before its next step.
class MappingThread {
 public:
  struct MapperUpdate {
    std::uint64_t key = 0;
    std::shared_ptr<const engine::MapSnapshot> snapshot;  // null when nothing new was published
    std::vector<engine::MapperEvent> events;
    // What came of a Join: where the maps are one now, `snapshot` is it.
    struct Join {
      std::uint64_t number = 0;  // that it was asked under
      engine::MapJoinAttempt attempt;
    };
    std::optional<Join> join = std::nullopt;
  };
  using Tell = std::function<void(const MapperUpdate&)>;

  MappingThread(const engine::MapperOptions& options, bool threaded, Tell tell);

  // Goes on with this map; what waits for another one is dropped. A null snapshot waits for Start.
  void Adopt(std::uint64_t key, std::shared_ptr<const engine::MapSnapshot> snapshot);
  // Makes the map of `key` from its first two views; without effect when another map has been adopted since.
  void Start(std::uint64_t key, engine::InitialPair pair);
  // Takes another map into the map of `key` (see Mapper::Join). Without effect when another map, or the same
  // one anew, is adopted before it is done; then no news of it counts. The last one asked for counts.
  void Join(std::uint64_t key, std::uint64_t number, std::shared_ptr<const engine::MapSnapshot> other);
  // False when the mapper is busy or works on another map.
  bool Offer(std::uint64_t key, engine::KeyFrameCandidate candidate,
             std::vector<engine::PointReport> reports);

  // Lockstep only: works until nothing urgent waits (at most kMaxSteps pieces), then one piece of idle work.
  void RunInTurn();
  // Threaded only: nothing was asked for that is not done.
  bool Resting() const;
  // Threaded only: waits while the mapper works, but until `latest` at most, and beyond it while the mapper
  // is a whole keyframe behind or makes a map's beginning.
  void WaitUntilIdle(std::chrono::steady_clock::time_point latest, const std::stop_token& stop);

  engine::MapperTimes Times() const { return mapper_.Times(); }
  // Ends the thread and rethrows what it threw; then does what the last keyframes left to be done, for two
  // seconds at most. Nothing may be asked for afterwards.
  void Finish();

 private:
  static constexpr int kMaxSteps = 20;
  struct Adoption {
    std::uint64_t key = 0;
    std::shared_ptr<const engine::MapSnapshot> snapshot;
  };

  struct JoinRequest {
    std::uint64_t number = 0;
    std::shared_ptr<const engine::MapSnapshot> other;
  };

  void Run(const std::stop_token& stop);
  void TakeOver();     // carries out a waiting adoption and start
  void JoinIfAsked();  // after TakeOver
  bool StepOnce();
  bool Busy() const;  // with mutex_ held

  engine::Mapper mapper_;
  const Tell tell_;
  // Touched by the stepping thread alone.
  std::uint64_t key_ = 0;
  std::shared_ptr<const engine::MapSnapshot> told_;

  mutable std::mutex mutex_;  // guards what follows; never held during a step
  std::condition_variable_any changed_;
  std::uint64_t wanted_key_ = 0;
  std::optional<Adoption> adoption_;
  std::optional<engine::InitialPair> pair_;
  std::optional<JoinRequest> join_;
  std::atomic<bool> interrupt_join_{false};  // read without the lock by the join that it ends
  bool starting_ = false;                    // from Start until its map or its failure is told
  bool work_ = false;                        // something was asked for since the last idle step
  bool resting_ = false;                     // the thread waits for work
  bool failed_ = false;                      // the thread has ended by an exception, which Finish hands out
  std::optional<Worker> worker_;             // last: it uses the rest
};

}  // namespace docent::app
