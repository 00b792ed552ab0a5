// SPDX-License-Identifier: Apache-2.0
#include "app/sound/speech.h"

#ifdef DOCENT_HAS_SPEECH
#include <libspeechd.h>
#endif

#include <cstdlib>
#include <memory>
#include <utility>

#include "engine/base/error.h"

namespace docent::app {

namespace {

constexpr std::size_t kMostTexts = 16;

#ifdef DOCENT_HAS_SPEECH
struct SpeechCloser {
  void operator()(SPDConnection* connection) const { spd_close(connection); }
};

// A connection to the service, which starts the service where it does not run.
class SpeechService {
 public:
  // Throws Error when there is no service.
  explicit SpeechService(const std::string& language) {
    char* error = nullptr;
    connection_.reset(spd_open2("docent", "visitor", nullptr, SPD_MODE_SINGLE, nullptr, 1, &error));
    if (!connection_) {
      const std::string reason = error != nullptr ? error : "there is no speech service";
      std::free(error);
      throw Error(reason);
    }
    spd_set_language(connection_.get(), language.c_str());
  }
  // Throws Error when the service does not take the text.
  void Say(const std::string& text) {
    if (spd_say(connection_.get(), SPD_MESSAGE, text.c_str()) < 0)
      throw Error("the speech service does not answer");
  }

 private:
  std::unique_ptr<SPDConnection, SpeechCloser> connection_;
};
#else
class SpeechService {
 public:
  explicit SpeechService(const std::string&) {
    throw Error("this program was built without Speech Dispatcher");
  }
  void Say(const std::string&) {}
};
#endif

}  // namespace

Speech::Speech(std::string language) : language_(std::move(language)) {
  worker_.emplace("speech", [this](const std::stop_token& stop) { Run(stop); });
}

Speech::~Speech() = default;

void Speech::Say(std::string text) {
  {
    const std::scoped_lock lock(mutex_);
    if (texts_.size() >= kMostTexts) texts_.pop_front();
    texts_.push_back(std::move(text));
  }
  changed_.notify_one();
}

std::string Speech::TakeProblem() {
  const std::scoped_lock lock(mutex_);
  return std::exchange(problem_, {});
}

void Speech::Report(const std::string& problem) {
  const std::scoped_lock lock(mutex_);
  if (std::exchange(reported_, true)) return;
  problem_ = "Nothing is spoken: " + problem + ".";
}

std::optional<std::string> Speech::Next(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, stop, [this] { return !texts_.empty(); });
  if (texts_.empty() || stop.stop_requested()) return std::nullopt;
  std::string text = std::move(texts_.front());
  texts_.pop_front();
  return text;
}

void Speech::Run(const std::stop_token& stop) {
  std::unique_ptr<SpeechService> service;
  bool failed = false;
  while (const auto text = Next(stop)) {
    if (failed) continue;
    try {
      if (!service) service = std::make_unique<SpeechService>(language_);
      service->Say(*text);
    } catch (const Error& error) {
      failed = true;
      Report(error.what());
    }
  }
}

}  // namespace docent::app
