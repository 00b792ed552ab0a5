// SPDX-License-Identifier: Apache-2.0
#include "app/files/working_set.h"

#include <algorithm>

namespace docent::app {

void WorkingSet::Wake(const Member& member) {
  const std::scoped_lock lock(mutex_);
  if (member.state_ != State::kEvicted) {
    member.state_ = State::kInUse;
    return;
  }
  MakeRoomFor(member.bytes_);
  member.state_ = State::kResident;
  awake_.push_back(&member);
  awake_bytes_ += member.bytes_;
}

void WorkingSet::MakeRoomFor(std::size_t bytes) {
  // Whoever looks on meanwhile must not keep all of them awake: one chance each.
  std::size_t chances = awake_.size();
  while (!awake_.empty() && awake_bytes_ + bytes > limit_bytes_) {
    const Member& eldest = *awake_.front();
    awake_.pop_front();
    State state = State::kInUse;
    if (chances > 0 && eldest.state_.compare_exchange_strong(state, State::kResident)) {
      --chances;
      awake_.push_back(&eldest);
      continue;
    }
    eldest.state_ = State::kEvicted;
    awake_bytes_ -= eldest.bytes_;
    eldest.Rest();
  }
}

void WorkingSet::EvictAll() {
  const std::scoped_lock lock(mutex_);
  for (const Member* member : awake_) {
    member->state_ = State::kEvicted;
    member->Rest();
  }
  awake_.clear();
  awake_bytes_ = 0;
}

void WorkingSet::Remove(const Member& member) {
  const std::scoped_lock lock(mutex_);
  if (member.state_.exchange(State::kEvicted) == State::kEvicted) return;
  awake_.erase(std::find(awake_.begin(), awake_.end(), &member));
  awake_bytes_ -= member.bytes_;
}

std::size_t WorkingSet::awake_bytes() const {
  const std::scoped_lock lock(mutex_);
  return awake_bytes_;
}

}  // namespace docent::app
