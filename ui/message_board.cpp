// SPDX-License-Identifier: Apache-2.0
#include "ui/message_board.h"

#include <algorithm>

namespace docent::ui {

void MessageBoard::AddError(const std::string& text) {
  constexpr std::ptrdiff_t kMostErrors = 50;
  if (text.empty()) return;
  const auto is_error = [](const Message& message) { return message.kind == Message::Kind::kError; };
  const auto same = std::find_if(messages_.begin(), messages_.end(), [&](const Message& message) {
    return is_error(message) && message.text == text;
  });
  if (same != messages_.end()) {
    ++same->count;
    return;
  }
  if (std::count_if(messages_.begin(), messages_.end(), is_error) >= kMostErrors)
    messages_.erase(std::find_if(messages_.begin(), messages_.end(), is_error));
  Message message;
  message.id = next_id_++;
  message.text = text;
  messages_.push_back(std::move(message));
}

void MessageBoard::AddDone(const std::string& text, bool offers_undo, double now_s) {
  constexpr double kShown_s = 5, kShownWithUndo_s = 8;
  if (text.empty()) return;
  std::erase_if(messages_, [](const Message& message) { return message.kind == Message::Kind::kDone; });
  Message message;
  message.kind = Message::Kind::kDone;
  message.id = next_id_++;
  message.text = text;
  message.offers_undo = offers_undo;
  message.end_s = now_s + (offers_undo ? kShownWithUndo_s : kShown_s);
  messages_.push_back(std::move(message));
}

void MessageBoard::WithdrawUndo() {
  for (Message& message : messages_) message.offers_undo = false;
}

void MessageBoard::Dismiss(std::uint64_t id) {
  std::erase_if(messages_, [&](const Message& message) { return message.id == id; });
}

void MessageBoard::Expire(double now_s) {
  std::erase_if(messages_, [&](const Message& message) {
    return message.kind == Message::Kind::kDone && message.end_s <= now_s;
  });
}

}  // namespace docent::ui
