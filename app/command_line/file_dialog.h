// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "app/command_line/portal_dialog.h"
#include "app/command_line/zenity_dialog.h"

namespace docent::app {

// The file dialog of the desktop, while the window goes on: that of the desktop portal, else `zenity`. One
// thread.
class FileDialog {
 public:
  // Shows the dialog unless it is shown already. Returns false when there is none. `patterns`: the files that
  // it lists first, as "*.png *.jpg".
  bool Open(const std::string& title, const std::string& patterns);
  bool is_open() const { return portal_.is_open() || zenity_.is_open(); }
  // The chosen file, once, when the dialog was closed with a choice. Does not wait.
  std::optional<std::filesystem::path> Poll();
  // Whether it came out only after Open that there is no dialog. Once.
  bool TakeRefusal();

 private:
  bool OpenZenity();

  PortalDialog portal_;
  ZenityDialog zenity_;
  std::string title_, patterns_;
  bool refused_ = false;
};

}  // namespace docent::app
