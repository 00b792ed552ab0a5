// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gmock/gmock.h>
#include <signal.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <opencv2/imgcodecs.hpp>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "app/files/text_file.h"
#include "tests/end_to_end/run_docent.h"
#include "tests/end_to_end/screen_reader.h"
#include "tests/support/virtual_screen.h"
#include "ui/letterbox.h"
#include "ui/window_layout.h"

namespace docent::app {

// The author's window of the real program on a virtual screen, used as a person does: by mouse and keyboard,
// and by looking at the screen.
class CuratorWindow {
 public:
  static constexpr int kWidth = 1280, kHeight = 1160;  // Of the window; the whole panel is seen.

  // `folder` is for the files of the program and of the screen.
  explicit CuratorWindow(const std::filesystem::path& folder)
      : folder_(folder), screen_("1280x1200", folder.string()), reader_(folder) {
    setenv("XDG_STATE_HOME", folder.c_str(), 1);  // The lists of recent files of other runs stay out of it.
  }
  CuratorWindow(const CuratorWindow&) = delete;
  CuratorWindow& operator=(const CuratorWindow&) = delete;
  ~CuratorWindow() {
    if (child_ > 0) {
      kill(child_, SIGKILL);
      waitpid(child_, nullptr, 0);
    }
    unsetenv("XDG_STATE_HOME");
  }

  // Why the test cannot run here; empty if it can.
  std::string MissingTool() const {
    if (!screen_.works()) return "Xvfb is not installed";
    if (!HasXdotool()) return "xdotool is not installed";
    if (!std::filesystem::exists(kDragFiles)) return "libx11 was not found when this was built";
    return "";
  }

  // Starts a session; `output` is a folder for what it writes.
  void Open(std::vector<std::string> arguments, const std::filesystem::path& output) {
    output_ = output;
    arguments.insert(arguments.end(), {"--output", output.string()});
    child_ = StartDocent(arguments, output.string() + ".out", output.string() + ".err");
    // A window that has just been made may refuse the keyboard.
    const std::string focus = "xdotool search --onlyvisible --name Docent windowsize " +
                              std::to_string(kWidth) + " " + std::to_string(kHeight) +
                              " windowfocus --sync > /dev/null 2>&1";
    Wait("the window", [&] { return std::system(focus.c_str()) == 0; });
    WaitForText("Nothing is placed in this map.");
  }

  // Waits until something is the case, at most two minutes; then the test fails, and the screen is kept.
  bool Wait(const std::string& what, const std::function<bool()>& is_so) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(120);
    while (std::chrono::steady_clock::now() < end && IsRunning()) {
      if (is_so()) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
    if (is_so()) return true;
    cv::imwrite(DOCENT_BINARY_DIR "/curator-window.png", reader_.Capture());
    ADD_FAILURE() << "waited in vain for: " << what << (IsRunning() ? "" : " (the program has ended)")
                  << "\nthe screen is in " DOCENT_BINARY_DIR "/curator-window.png\n"
                  << ReadAll(output_.string() + ".err");
    return false;
  }
  // In the panel.
  std::optional<cv::Point> FindText(const std::string& text, int margin_px = 0) const {
    const ui::Area panel = ui::LayOutWindow(kWidth, kHeight, 1, true).panel;
    const cv::Rect part(static_cast<int>(panel.x), 0, static_cast<int>(panel.width), kHeight);
    return reader_.Find(text, part, margin_px);
  }
  std::optional<cv::Point> WaitForText(const std::string& text, int margin_px = 0) {
    std::optional<cv::Point> found;
    Wait("the text '" + text + "'", [&] { return (found = FindText(text, margin_px)).has_value(); });
    return found;
  }

  // The lines of events.csv so far, without those of the header.
  std::vector<std::string> Events() const {
    std::filesystem::path file = output_ / "events.csv";
    if (!std::filesystem::exists(file)) file += ".part";
    std::istringstream lines(std::filesystem::exists(file) ? ReadAll(file) : "");
    std::vector<std::string> events;
    for (std::string line; std::getline(lines, line);) events.push_back(line);
    return events;
  }
  // Those that contain this.
  std::vector<std::string> Events(const std::string& part) const {
    std::vector<std::string> events = Events();
    std::erase_if(events, [&](const std::string& line) { return line.find(part) == std::string::npos; });
    return events;
  }
  // Waits for the given number of events that contain this; returns the last one.
  std::string WaitForEvent(const std::string& part, std::size_t count = 1) {
    Wait(std::to_string(count) + " events with '" + part + "'", [&] { return Events(part).size() >= count; });
    const std::vector<std::string> events = Events(part);
    return events.empty() ? "" : events.back();
  }

  void Click(const cv::Point& point) {
    ++actions_;
    Xdotool("mousemove " + std::to_string(point.x) + " " + std::to_string(point.y) +
            " sleep 0.25 mousedown 1 sleep 0.15 mouseup 1 sleep 0.15");
  }
  void ClickText(const std::string& text, int margin_px = 0) {
    Xdotool("mousemove 480 1120 sleep 0.2");  // Below the image; what the pointer shows may cover the text.
    if (const auto place = WaitForText(text, margin_px)) Click(*place);
  }
  void Key(const std::string& key) {
    ++actions_;
    Xdotool("keydown " + key + " sleep 0.25 keyup " + key + " sleep 0.1");
  }
  void ControlKey(const std::string& key) {
    ++actions_;
    Xdotool("keydown ctrl sleep 0.05 keydown " + key + " sleep 0.15 keyup " + key + " keyup ctrl sleep 0.1");
  }
  // The field that was clicked needs a moment to take the text.
  void Type(const std::string& text) {
    ++actions_;
    Xdotool("sleep 0.3 type --delay 40 '" + text + "'");
  }
  // Drags a file to a point of the window.
  void Drop(const std::filesystem::path& file, const cv::Point& point) {
    ++actions_;
    const std::string command = std::string(kDragFiles) + " " + std::to_string(point.x) + " " +
                                std::to_string(point.y) + " " + file.string();
    EXPECT_EQ(std::system(command.c_str()), 0) << command;
  }
  // How many clicks, drags, keys and texts there were so far.
  int actions() const { return actions_; }
  // The part of the window that is beside the panel.
  cv::Mat Capture() const {
    const ui::Area image = ui::LayOutWindow(kWidth, kHeight, 1, true).image;
    return reader_.Capture()(cv::Rect(0, 0, static_cast<int>(image.width), kHeight)).clone();
  }

  // Between pixels of the camera's image and points of the window; points are whole numbers.
  static cv::Point PointOf(const Eigen::Vector2d& pixel) {
    const Eigen::Vector2d point = Box().WindowFromImage(pixel);
    return {static_cast<int>(std::lround(point.x())), static_cast<int>(std::lround(point.y()))};
  }
  static Eigen::Vector2d PixelOf(const cv::Point& point) {
    return Box().ImageFromWindow(Eigen::Vector2d(point.x, point.y));
  }

  // Quits, saving what is not saved yet. Returns the exit status.
  int Quit() {
    Xdotool("keydown ctrl sleep 0.05 keydown q sleep 0.15", false);
    Wait("the end or the question whether to save", [&] {
      return !IsRunning() || reader_.Find("Save and quit", {0, 0, kWidth, kHeight});
    });
    Xdotool("keyup q keyup ctrl sleep 0.1", false);
    if (IsRunning()) Xdotool("keydown Return sleep 0.3", false);
    Xdotool("keyup Return", false);
    for (int i = 0; i < 600 && IsRunning(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(100));
    if (IsRunning()) return -1;
    int status = 0;
    waitpid(std::exchange(child_, -1), &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }

 private:
  static constexpr const char* kDragFiles = DOCENT_BINARY_DIR "/tests/end_to_end/drag_files";

  static ui::Letterbox Box() {
    return ui::FitImage(640, 480, ui::LayOutWindow(kWidth, kHeight, 1, true).image);
  }
  // Keys and buttons that end the program reach no window any more, which xdotool takes for an error.
  static void Xdotool(const std::string& commands, bool has_to_succeed = true) {
    const int status = std::system(("xdotool " + commands + " > /dev/null 2>&1").c_str());
    if (has_to_succeed) {
      EXPECT_EQ(status, 0) << commands;
    }
  }
  bool IsRunning() const {
    if (child_ <= 0) return false;
    siginfo_t ended{};
    waitid(P_PID, static_cast<id_t>(child_), &ended, WEXITED | WNOHANG | WNOWAIT);
    return ended.si_pid == 0;
  }

  const std::filesystem::path folder_;
  VirtualScreen screen_;
  ScreenReader reader_;
  std::filesystem::path output_;
  pid_t child_ = -1;
  int actions_ = 0;
};

}  // namespace docent::app
