// SPDX-License-Identifier: Apache-2.0
#include "engine/base/worker.h"

#include <pthread.h>

#include <utility>

namespace docent {

Worker::Worker(const std::string& name, std::function<void(std::stop_token)> body)
    : thread_([this, name, body = std::move(body)](std::stop_token stop) {
        pthread_setname_np(pthread_self(), name.substr(0, 15).c_str());
        try {
          body(std::move(stop));
        } catch (...) {
          error_ = std::current_exception();
        }
        finished_.store(true, std::memory_order_release);
      }) {}

Worker::~Worker() {
  thread_.request_stop();
  if (thread_.joinable()) thread_.join();
}

void Worker::Join() {
  if (thread_.joinable()) thread_.join();
  if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
}

}  // namespace docent
