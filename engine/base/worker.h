// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <exception>
#include <functional>
#include <stop_token>
#include <string>
#include <thread>

namespace docent {

// A thread that stops when it is asked to and hands its exception to whoever joins it. The owner starts it by
// construction; `body` runs until it returns, and should return soon after its stop token says so. The owner
// alone calls Join; RequestStop, stop_requested and finished may be called from any thread.
class Worker {
 public:
  // name: for debuggers and profilers, 15 bytes are shown. body: what runs in the thread.
  Worker(const std::string& name, std::function<void(std::stop_token)> body);
  // Asks to stop and waits. An exception that nobody joined for is dropped here, so an owner who wants to
  // know calls Join first.
  ~Worker();
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  void RequestStop() { thread_.request_stop(); }
  bool stop_requested() const { return thread_.get_stop_token().stop_requested(); }
  // True once the body has returned or thrown.
  bool finished() const { return finished_.load(std::memory_order_acquire); }

  // Waits for the body to end (it does not ask it to), then rethrows what the body threw, once.
  void Join();

 private:
  std::exception_ptr error_;  // written by the thread before it ends, read after it was joined
  std::atomic<bool> finished_ = false;
  std::jthread thread_;  // last, so that the members above outlive it
};

}  // namespace docent
