// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <mutex>

namespace docent::app {

// Things that need memory only while they are looked at, of which so many bytes are awake at a time. When one
// more wakes, others rest, in the order in which they woke; whoever was looked at again since is passed over
// once ("second chance": Corbato, "A Paging Experiment with the Multics System", 1968). To look at what is
// awake costs no more than to read a flag. Its members are owned elsewhere.
//
// Any thread may call anything. What holds: once Remove has returned nothing is done to that member. A member
// may be put to rest while somebody still looks, which must be harmless.
class WorkingSet {
 public:
  class Member {
   public:
    explicit Member(std::size_t bytes) : bytes_(bytes) {}
    virtual ~Member() = default;
    Member(const Member&) = delete;
    Member& operator=(const Member&) = delete;

   protected:
    virtual void Rest() const = 0;  // gives its memory back; called with the set's lock held

   private:
    friend class WorkingSet;
    enum class State : std::uint8_t { kEvicted, kResident, kInUse };
    const std::size_t bytes_;
    mutable std::atomic<State> state_{State::kEvicted};
  };

  explicit WorkingSet(std::size_t limit_bytes) : limit_bytes_(limit_bytes) {}

  // One that is larger than the limit is awake alone.
  void Look(const Member& member);
  void EvictAll();
  void Remove(const Member& member);
  std::size_t awake_bytes() const;

 private:
  using State = Member::State;
  void Wake(const Member& member);
  void MakeRoomFor(std::size_t bytes);

  const std::size_t limit_bytes_;
  mutable std::mutex mutex_;  // guards what follows, and whether a member is resting
  std::deque<const Member*> awake_;
  std::size_t awake_bytes_ = 0;
};

inline void WorkingSet::Look(const Member& member) {
  State state = member.state_.load(std::memory_order_relaxed);
  if (state == State::kInUse) return;
  if (state == State::kResident && member.state_.compare_exchange_strong(state, State::kInUse)) return;
  Wake(member);
}

}  // namespace docent::app
