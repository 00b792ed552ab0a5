// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

namespace docent::app {

// The file dialog of the desktop, asked for over D-Bus at the XDG desktop portal
// (org.freedesktop.portal.FileChooser, https://flatpak.github.io/xdg-desktop-portal), which shows it in a
// process of its own while the window goes on. One thread, and no call waits for a person.
class PortalDialog {
 public:
  PortalDialog();
  // Closes the dialog.
  ~PortalDialog();
  PortalDialog(const PortalDialog&) = delete;
  PortalDialog& operator=(const PortalDialog&) = delete;

  // Asks for the dialog unless it is shown already. Returns false when there is no session bus or no portal
  // on it. `patterns`: the files that it lists first, as "*.png *.jpg".
  bool Open(const std::string& title, const std::string& patterns);
  bool is_open() const;
  // The chosen file, once, when the dialog was closed with a choice. Does not wait.
  std::optional<std::filesystem::path> Poll();
  // Whether the last dialog was not shown because the portal refused, as one without a file dialog does.
  // Once.
  bool TakeRefusal();

 private:
  struct Request;
  std::unique_ptr<Request> request_;
  bool refused_ = false;
};

}  // namespace docent::app
