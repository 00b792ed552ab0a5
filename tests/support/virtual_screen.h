// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <string>

namespace docent {

// A virtual X server for tests of windows, on a display number that the server chooses. It has no window
// manager: a window's corner is the screen's corner. It does not reset when its last client leaves: a client
// that connects during a reset is refused, and a test's xdotool is often the only other client.
class VirtualScreen {
 public:
  // `size` is WIDTHxHEIGHT. Sets DISPLAY. With a folder, the framebuffer is in its file Xvfb_screen0, in the
  // format of xwd, so that tests can look at it.
  explicit VirtualScreen(const std::string& size, const std::string& framebuffer_folder = "") {
    int channel[2];
    if (pipe(channel) != 0) return;
    child_ = fork();
    if (child_ == 0) {
      const std::string descriptor = std::to_string(channel[1]);
      const int nowhere = open("/dev/null", O_WRONLY);
      dup2(nowhere, STDERR_FILENO);
      execlp("Xvfb", "Xvfb", "-displayfd", descriptor.c_str(), "-screen", "0", (size + "x24").c_str(),
             "-nolisten", "tcp", "-noreset", framebuffer_folder.empty() ? nullptr : "-fbdir",
             framebuffer_folder.c_str(), static_cast<char*>(nullptr));
      _exit(127);
    }
    close(channel[1]);
    char c = 0;
    while (read(channel[0], &c, 1) == 1 && c != '\n') display_ += c;
    close(channel[0]);
    if (!display_.empty()) setenv("DISPLAY", (":" + display_).c_str(), 1);
  }
  ~VirtualScreen() {
    unsetenv("DISPLAY");
    if (child_ <= 0) return;
    kill(child_, SIGTERM);
    waitpid(child_, nullptr, 0);
  }
  VirtualScreen(const VirtualScreen&) = delete;
  VirtualScreen& operator=(const VirtualScreen&) = delete;

  bool works() const { return !display_.empty(); }

 private:
  pid_t child_ = -1;
  std::string display_;
};

inline bool HasXdotool() {
  return std::system("command -v xdotool > /dev/null 2>&1") == 0;
}

// Gives the keyboard to the window of the program. Returns whether it has it: a window that has just been
// made may refuse it, so that it takes several attempts.
inline bool FocusWindow() {
  return std::system("xdotool search --onlyvisible --name Docent windowfocus --sync > /dev/null 2>&1") == 0;
}

}  // namespace docent
