// SPDX-License-Identifier: Apache-2.0
#include "app/session/mapping_thread.h"

#include <sys/resource.h>
#include <unistd.h>

#include <chrono>
#include <memory>
#include <utility>

#include "app/files/image_files.h"

namespace docent::app {

namespace {

// An image that waits for the mapper is late; a keyframe that waits for images is none the worse. Where
// there are fewer processors than threads, the trackers go first: five steps of niceness are a third of
// their share.
void LetOthersGoFirst() {
  constexpr int kSteps = 5;
  const auto thread = static_cast<id_t>(gettid());
  const int now = getpriority(PRIO_PROCESS, thread);
  setpriority(PRIO_PROCESS, thread, now + kSteps);  // where it is refused all go alike
}

engine::MapperOptions WithImageFiles(engine::MapperOptions options) {
  if (!options.images) options.images = std::make_shared<ImageFiles>();
  return options;
}

}  // namespace

MappingThread::MappingThread(const engine::MapperOptions& options, bool threaded, Tell tell)
    : mapper_(WithImageFiles(options)), tell_(std::move(tell)) {
  if (!threaded) return;
  worker_.emplace("mapper", [this](const std::stop_token& stop) {
    LetOthersGoFirst();
    try {
      Run(stop);
    } catch (...) {
      {
        const std::scoped_lock lock(mutex_);
        failed_ = true;
      }
      changed_.notify_all();
      throw;
    }
  });
}

void MappingThread::Adopt(std::uint64_t key, std::shared_ptr<const engine::MapSnapshot> snapshot) {
  {
    const std::scoped_lock lock(mutex_);
    wanted_key_ = key;
    adoption_ = Adoption{key, std::move(snapshot)};
    pair_.reset();
    join_.reset();
    interrupt_join_ = true;
    starting_ = false;
    work_ = true;
  }
  changed_.notify_all();
  if (!worker_) TakeOver();
}

void MappingThread::Start(std::uint64_t key, engine::InitialPair pair) {
  {
    const std::scoped_lock lock(mutex_);
    if (key != wanted_key_) return;
    pair_ = std::move(pair);
    starting_ = work_ = true;
  }
  changed_.notify_all();
}

void MappingThread::Join(std::uint64_t key, std::uint64_t number,
                         std::shared_ptr<const engine::MapSnapshot> other) {
  {
    const std::scoped_lock lock(mutex_);
    if (key != wanted_key_) return;
    join_ = JoinRequest{number, std::move(other)};
    work_ = true;
  }
  changed_.notify_all();
}

bool MappingThread::Offer(std::uint64_t key, engine::KeyFrameCandidate candidate,
                          std::vector<engine::PointReport> reports) {
  {
    const std::scoped_lock lock(mutex_);
    // A keyframe that came before the adoption was carried out would be dropped by it, or worse, join the
    // map before.
    if (key != wanted_key_ || adoption_) return false;
    mapper_.Report(std::move(reports));
    if (!mapper_.Offer(std::move(candidate))) return false;
    work_ = true;
  }
  changed_.notify_all();
  return true;
}

void MappingThread::TakeOver() {
  std::unique_lock lock(mutex_);
  while (adoption_) {
    // The copy of a large map takes a while; adoption_ stays set meanwhile, so that nobody offers to it.
    const Adoption adoption = *adoption_;
    lock.unlock();
    mapper_.Adopt(adoption.snapshot);
    mapper_.TakeEvents();  // of the map before
    key_ = adoption.key;
    told_ = adoption.snapshot;
    lock.lock();
    if (adoption_->key == adoption.key && adoption_->snapshot == adoption.snapshot) adoption_.reset();
  }
  if (pair_) mapper_.Start(std::move(*pair_));
  pair_.reset();
}

void MappingThread::JoinIfAsked() {
  std::optional<JoinRequest> request;
  {
    const std::scoped_lock lock(mutex_);
    if (adoption_ || !join_) return;
    request = std::exchange(join_, std::nullopt);
    interrupt_join_ = false;
  }
  MapperUpdate news;
  news.key = key_;
  news.join = MapperUpdate::Join{request->number, mapper_.Join(*request->other, &interrupt_join_)};
  request.reset();
  if (news.join->attempt.joined) news.snapshot = told_ = mapper_.Snapshot();
  tell_(news);
}

bool MappingThread::StepOnce() {
  const bool worked = mapper_.Step();
  MapperUpdate news;
  news.key = key_;
  news.events = mapper_.TakeEvents();
  if (auto snapshot = mapper_.Snapshot(); snapshot != told_) news.snapshot = told_ = std::move(snapshot);
  if (news.snapshot || !news.events.empty()) {
    tell_(news);
    using Kind = engine::MapperEvent::Kind;
    for (const engine::MapperEvent& event : news.events) {
      if (event.kind != Kind::kMapStarted && event.kind != Kind::kStartFailed) continue;
      const std::scoped_lock lock(mutex_);
      if (wanted_key_ == key_) starting_ = false;
    }
  }
  return worked;
}

void MappingThread::RunInTurn() {
  TakeOver();
  JoinIfAsked();
  for (int step = 0; step < kMaxSteps && !mapper_.IsIdle(); ++step) StepOnce();
  StepOnce();
}

void MappingThread::Run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    {
      std::unique_lock lock(mutex_);
      resting_ = true;
      changed_.notify_all();
      if (!changed_.wait(lock, stop, [this] { return work_; })) return;
      resting_ = work_ = false;
    }
    TakeOver();
    JoinIfAsked();
    bool more = true;
    while (more && !stop.stop_requested()) {
      more = StepOnce();
      {
        const std::scoped_lock lock(mutex_);
        // work_ is set as well: the outer loop goes on with them.
        if (adoption_ || pair_ || join_) more = false;
      }
      changed_.notify_all();
    }
  }
}

bool MappingThread::Busy() const {
  return adoption_.has_value() || starting_ || mapper_.QueueLength() > 1;
}

bool MappingThread::Resting() const {
  const std::scoped_lock lock(mutex_);
  return resting_ && !work_;
}

void MappingThread::WaitUntilIdle(std::chrono::steady_clock::time_point latest, const std::stop_token& stop) {
  if (!worker_) return;
  std::unique_lock lock(mutex_);
  changed_.wait_until(lock, stop, latest, [this] { return failed_ || (resting_ && !work_); });
  changed_.wait(lock, stop, [this] { return failed_ || !Busy(); });
}

void MappingThread::Finish() {
  // In turn the number of steps ends it and not the clock, so that two runs make the same map.
  constexpr int kMaxLastSteps = 500;
  constexpr auto kLongest = std::chrono::seconds(2);
  const bool threaded = worker_.has_value();
  {
    const std::scoped_lock lock(mutex_);
    join_.reset();
    interrupt_join_ = true;
  }
  if (threaded) {
    worker_->RequestStop();
    worker_->Join();
  }
  const auto start = std::chrono::steady_clock::now();
  for (int step = 0; step < kMaxLastSteps && StepOnce(); ++step) {
    if (threaded && std::chrono::steady_clock::now() - start > kLongest) return;
  }
}

}  // namespace docent::app
