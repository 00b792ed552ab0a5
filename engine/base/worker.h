// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <exception>
#include <functional>
#include <stop_token>
#include <string>
#include <thread>

namespace docent {

// A thread that stops on request and passes its exception to the thread that joins it. The constructor starts
// it; `body` runs until it returns, and should return soon after a stop is requested. Only the owner calls
// Join; RequestStop, stop_requested and finished may be called from any thread.
class Worker {
 public:
  // name: shown by debuggers and profilers, up to 15 bytes. body: runs in the thread.
  Worker(const std::string& name, std::function<void(std::stop_token)> body);
  // Requests a stop and waits. An exception that Join did not rethrow is discarded; an owner that needs it
  // calls Join first.
  ~Worker();
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  void RequestStop() { thread_.request_stop(); }
  bool stop_requested() const { return thread_.get_stop_token().stop_requested(); }
  // True once the body has returned or thrown.
  bool finished() const { return finished_.load(std::memory_order_acquire); }

  // Waits for the body to end without requesting a stop, then rethrows the body's exception, once.
  void Join();

 private:
  std::exception_ptr error_;  // written by the thread before it ends, read after the join
  std::atomic<bool> finished_ = false;
  std::jthread thread_;  // last, so that the members above outlive it
};

}  // namespace docent
