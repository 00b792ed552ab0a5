// SPDX-License-Identifier: Apache-2.0
#include "engine/base/worker.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <stdexcept>
#include <thread>

namespace docent {
namespace {

TEST(Worker, StopsWhenRequested) {
  std::atomic<long> rounds = 0;
  Worker worker("counter", [&](std::stop_token stop) {
    while (!stop.stop_requested()) ++rounds;
  });
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (rounds == 0 && std::chrono::steady_clock::now() < deadline) std::this_thread::yield();
  EXPECT_GT(rounds, 0) << "the body did not run";
  EXPECT_FALSE(worker.finished());
  worker.RequestStop();
  worker.Join();
  EXPECT_TRUE(worker.stop_requested());
  EXPECT_TRUE(worker.finished());
}

TEST(Worker, JoinRethrowsTheException) {
  Worker worker("thrower", [](std::stop_token) { throw std::runtime_error("out of paint"); });
  try {
    worker.Join();
    FAIL() << "the exception was lost";
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "out of paint");
  }
  worker.Join();  // the exception was already rethrown
}

TEST(Worker, JoinWaitsForTheBodyToFinish) {
  std::atomic<bool> done = false;
  Worker worker("sleeper", [&](std::stop_token) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    done = true;
  });
  worker.Join();
  EXPECT_TRUE(done);
  EXPECT_FALSE(worker.stop_requested());
}

TEST(Worker, DestructorStopsAndJoinsTheThread) {
  std::atomic<bool> ended = false;
  {
    Worker worker("orphan", [&](std::stop_token stop) {
      while (!stop.stop_requested()) std::this_thread::yield();
      ended = true;
    });
  }
  EXPECT_TRUE(ended);
}

}  // namespace
}  // namespace docent
