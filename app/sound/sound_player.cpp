// SPDX-License-Identifier: Apache-2.0
#include "app/sound/sound_player.h"

#include <chrono>
#include <utility>

#include "app/sound/sound_device.h"
#include "engine/base/error.h"

namespace docent::app {

namespace {

constexpr std::size_t kMostOrders = 64;
constexpr auto kWait = std::chrono::milliseconds(250);  // Between two looks for what is to be decoded.

}  // namespace

SoundPlayer::SoundPlayer(std::chrono::milliseconds retry) : retry_(retry) {
  worker_.emplace("sound", [this](const std::stop_token& stop) { Run(stop); });
}

SoundPlayer::~SoundPlayer() = default;

void SoundPlayer::Give(const SoundDirector::Orders& orders) {
  if (orders.start.empty() && orders.stop.empty()) return;
  {
    const std::scoped_lock lock(mutex_);
    if (orders_.size() >= kMostOrders) orders_.pop_front();
    orders_.push_back(orders);
  }
  changed_.notify_one();
}

std::string SoundPlayer::TakeProblem() {
  const std::scoped_lock lock(mutex_);
  return std::exchange(problem_, {});
}

void SoundPlayer::Report(const std::string& problem) {
  const std::scoped_lock lock(mutex_);
  if (std::exchange(reported_, true)) return;
  problem_ = "Sounds are not heard: " + problem + ". Their captions are shown.";
}

std::optional<SoundDirector::Orders> SoundPlayer::Next(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, stop, kWait, [this] { return !orders_.empty(); });
  if (orders_.empty() || stop.stop_requested()) return std::nullopt;
  SoundDirector::Orders orders = std::move(orders_.front());
  orders_.pop_front();
  return orders;
}

void SoundPlayer::Run(const std::stop_token& stop) {
  std::unique_ptr<SoundDevice> device;
  std::chrono::steady_clock::time_point next_try{};
  // A damaged file costs only its own sound.
  const auto guarded = [this](const auto& action) {
    try {
      action();
    } catch (const Error& error) {
      Report(error.what());
    }
  };
  while (!stop.stop_requested()) {
    const auto orders = Next(stop);
    guarded([&] {
      if (device && !device->is_connected()) {
        device.reset();
        Report("the sound device was lost");
      }
      if (device) guarded([&] { device->Update(); });
      if (!orders) return;
      const auto now = std::chrono::steady_clock::now();
      if (!device && !orders->start.empty() && now >= next_try) {
        next_try = now + retry_;
        device = std::make_unique<SoundDevice>();
        next_try = {};
      }
      if (!device) return;
      for (const SoundDirector::Key& key : orders->stop) device->Stop(key);
      for (const auto& start : orders->start) guarded([&] { device->Start(start.first, start.second); });
    });
  }
}

}  // namespace docent::app
