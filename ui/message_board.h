// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace docent::ui {

// A message to the person at the window.
struct Message {
  enum class Kind {
    kError,  // Stays until it is dismissed.
    kDone,   // What was done; goes by itself.
  };
  Kind kind = Kind::kError;
  std::uint64_t id = 0;  // Unique on its board.
  std::string text;      // One sentence.
  int count = 1;         // How often it was given.
  // Of kDone: whether it is about the last change, which can be undone.
  bool offers_undo = false;
  double end_s = 0;  // Of kDone: when it goes.
};

// The messages that are shown, the oldest first. Times are seconds on any clock that does not go back. One
// thread.
class MessageBoard {
 public:
  // An error that is shown already is counted instead. Beyond fifty errors the oldest one is dropped. An
  // empty text is ignored.
  void AddError(const std::string& text);
  // A newer one replaces the older ones: only the last change can be undone.
  void AddDone(const std::string& text, bool offers_undo, double now_s);
  // What was done was done in another map, so that undoing would undo something else.
  void WithdrawUndo();
  void Dismiss(std::uint64_t id);
  void DismissAll() { messages_.clear(); }
  // Removes what has been shown long enough: five seconds, and eight with an Undo button.
  void Expire(double now_s);

  const std::vector<Message>& messages() const { return messages_; }

 private:
  std::uint64_t next_id_ = 1;
  std::vector<Message> messages_;
};

}  // namespace docent::ui
