// SPDX-License-Identifier: Apache-2.0
#include "app/files/working_set.h"

#include <algorithm>

namespace docent::app {

void WorkingSet::MakeResident(const Member& member) {
  const std::scoped_lock lock(mutex_);
  if (member.state_ != State::kEvicted) {
    member.state_ = State::kInUse;
    return;
  }
  MakeRoomFor(member.bytes_);
  member.state_ = State::kResident;
  resident_.push_back(&member);
  resident_bytes_ += member.bytes_;
}

void WorkingSet::MakeRoomFor(std::size_t bytes) {
  // One second chance for each member: otherwise threads that keep using members could prevent any eviction.
  std::size_t chances = resident_.size();
  while (!resident_.empty() && resident_bytes_ + bytes > limit_bytes_) {
    const Member& oldest = *resident_.front();
    resident_.pop_front();
    State state = State::kInUse;
    if (chances > 0 && oldest.state_.compare_exchange_strong(state, State::kResident)) {
      --chances;
      resident_.push_back(&oldest);
      continue;
    }
    oldest.state_ = State::kEvicted;
    resident_bytes_ -= oldest.bytes_;
    oldest.ReleaseMemory();
  }
}

void WorkingSet::EvictAll() {
  const std::scoped_lock lock(mutex_);
  for (const Member* member : resident_) {
    member->state_ = State::kEvicted;
    member->ReleaseMemory();
  }
  resident_.clear();
  resident_bytes_ = 0;
}

void WorkingSet::Remove(const Member& member) {
  const std::scoped_lock lock(mutex_);
  if (member.state_.exchange(State::kEvicted) == State::kEvicted) return;
  resident_.erase(std::find(resident_.begin(), resident_.end(), &member));
  resident_bytes_ -= member.bytes_;
}

std::size_t WorkingSet::resident_bytes() const {
  const std::scoped_lock lock(mutex_);
  return resident_bytes_;
}

}  // namespace docent::app
