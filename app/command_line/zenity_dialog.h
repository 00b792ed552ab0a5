// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace docent::app {

// The file dialog of the desktop, shown by the program `zenity` while the window goes on. One thread.
class ZenityDialog {
 public:
  ZenityDialog() = default;
  // Closes the dialog.
  ~ZenityDialog();
  ZenityDialog(const ZenityDialog&) = delete;
  ZenityDialog& operator=(const ZenityDialog&) = delete;

  // Whether the program is installed, by PATH.
  static bool IsAvailable();
  // Shows the dialog unless it is shown already. Returns false when the program cannot be started.
  // `patterns`: the files that it lists first, as "*.png *.jpg".
  bool Open(const std::string& title, const std::string& patterns);
  bool is_open() const { return child_ > 0; }
  // The chosen file, once, when the dialog was closed with a choice. Does not wait.
  std::optional<std::filesystem::path> Poll();

 private:
  int child_ = -1, pipe_ = -1;
  std::string output_;
};

}  // namespace docent::app
