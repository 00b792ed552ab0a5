// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/file_dialog.h"

#include <utility>

namespace docent::app {

bool FileDialog::Open(const std::string& title, const std::string& patterns) {
  if (is_open()) return true;
  title_ = title;
  patterns_ = patterns;
  return portal_.Open(title, patterns) || OpenZenity();
}

bool FileDialog::OpenZenity() {
  return ZenityDialog::IsAvailable() && zenity_.Open(title_, patterns_);
}

std::optional<std::filesystem::path> FileDialog::Poll() {
  if (zenity_.is_open()) return zenity_.Poll();
  const std::optional<std::filesystem::path> chosen = portal_.Poll();
  if (portal_.TakeRefusal()) refused_ = !OpenZenity();
  return chosen;
}

bool FileDialog::TakeRefusal() {
  return std::exchange(refused_, false);
}

}  // namespace docent::app
