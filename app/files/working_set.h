// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <mutex>

namespace docent::app {

// Members that need memory only while they are in use, of which a limited number of bytes is resident at a
// time. When another member becomes resident, older ones are evicted in the order in which they became
// resident; a member that was used again since then is skipped once ("second chance": Corbato, "A Paging
// Experiment with the Multics System", 1968). Touching a resident member costs no more than reading a flag.
// The members are owned elsewhere.
//
// Any thread may call anything. Invariant: after Remove has returned, the set does not access that member. A
// member may be evicted while another thread still reads it, which must be harmless.
class WorkingSet {
 public:
  class Member {
   public:
    explicit Member(std::size_t bytes) : bytes_(bytes) {}
    virtual ~Member() = default;
    Member(const Member&) = delete;
    Member& operator=(const Member&) = delete;

   protected:
    virtual void ReleaseMemory() const = 0;  // called with the set's lock held

   private:
    friend class WorkingSet;
    enum class State : std::uint8_t { kEvicted, kResident, kInUse };
    const std::size_t bytes_;
    mutable std::atomic<State> state_{State::kEvicted};
  };

  explicit WorkingSet(std::size_t limit_bytes) : limit_bytes_(limit_bytes) {}

  // Marks a member as used and makes it resident. A member larger than the limit is resident alone.
  void Touch(const Member& member);
  void EvictAll();
  void Remove(const Member& member);
  std::size_t resident_bytes() const;

 private:
  using State = Member::State;
  void MakeResident(const Member& member);
  void MakeRoomFor(std::size_t bytes);

  const std::size_t limit_bytes_;
  mutable std::mutex mutex_;  // guards the members below and the eviction of a member
  std::deque<const Member*> resident_;
  std::size_t resident_bytes_ = 0;
};

inline void WorkingSet::Touch(const Member& member) {
  State state = member.state_.load(std::memory_order_relaxed);
  if (state == State::kInUse) return;
  if (state == State::kResident && member.state_.compare_exchange_strong(state, State::kInUse)) return;
  MakeResident(member);
}

}  // namespace docent::app
