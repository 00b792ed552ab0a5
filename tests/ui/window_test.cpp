// SPDX-License-Identifier: Apache-2.0
#include "ui/window.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <thread>

#include "tests/ui/ui_testing.h"
#include "ui/authoring_panel.h"
#include "ui/letterbox.h"

namespace docent::ui {
namespace {

// A virtual X server for these tests, on a display number that the server chooses.
class VirtualScreen {
 public:
  VirtualScreen() {
    int channel[2];
    if (pipe(channel) != 0) return;
    child_ = fork();
    if (child_ == 0) {
      const std::string descriptor = std::to_string(channel[1]);
      const int nowhere = open("/dev/null", O_WRONLY);
      dup2(nowhere, STDERR_FILENO);
      execlp("Xvfb", "Xvfb", "-displayfd", descriptor.c_str(), "-screen", "0", "1024x768x24", "-nolisten",
             "tcp", static_cast<char*>(nullptr));
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
  bool works() const { return !display_.empty(); }

 private:
  pid_t child_ = -1;
  std::string display_;
};

bool HasXdotool() {
  return std::system("command -v xdotool > /dev/null 2>&1") == 0;
}

// Draws until a click arrives or about six seconds have passed. Returns the click, if any.
std::optional<InputEvent> AwaitClick(Window* window, const std::function<void()>& draw) {
  for (int i = 0; i < 600; ++i) {
    for (const InputEvent& event : window->PollEvents()) {
      if (event.kind == InputEvent::Kind::kClick) return event;
    }
    draw();
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return std::nullopt;
}

TEST(Window, ThrowsAClearErrorWithoutADisplay) {
  unsetenv("DISPLAY");
  unsetenv("WAYLAND_DISPLAY");
  try {
    Window window("none", 100, 100);
    FAIL() << "a window was opened without a display";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("no display"), std::string::npos) << error.what();
  }
}

// The models that were placed; other actions are failures.
class PlacedModels : public AuthoringActions {
 public:
  struct Model {
    std::string file;
    Eigen::Vector2d pixel;
    double scale, yaw_deg;
  };
  void PlaceModel(const std::string& file, const Eigen::Vector2d& pixel, double scale,
                  double yaw_deg) override {
    models.push_back({file, pixel, scale, yaw_deg});
  }
  void NewMap(const std::string&) override { FAIL(); }
  void StopMap() override { FAIL(); }
  void PlaceSignpost(const std::string&, const Eigen::Vector2d&, const std::string&) override { FAIL(); }
  void Undo() override { FAIL(); }
  void Redo() override { FAIL(); }
  void Save() override { FAIL(); }

  std::vector<Model> models;
};

TEST(Window, AClickInTheImagePlacesTheChosenModelThere) {
  VirtualScreen screen;
  if (!screen.works()) GTEST_SKIP() << "Xvfb is not installed";
  if (!HasXdotool()) GTEST_SKIP() << "xdotool is not installed";
  Window window("Docent", 800, 600);
  Renderer renderer;
  PlacedModels placed;
  AuthoringPanel panel(&window, &placed, {"cake.glb"});
  panel.state().tool = AuthoringPanel::Tool::kModel;
  panel.state().scale = 0.25;
  panel.state().yaw_deg = -90;
  const engine::CameraModel camera = StronglyDistorted();
  const engine::TrackedFrame tracked = Tracked(cv::Mat(480, 640, CV_8UC3, cv::Scalar(30, 60, 90)));
  View view;
  view.tracked = &tracked;
  view.camera = &camera;
  const auto draw = [&] {
    renderer.Draw(view);
    const Eigen::Vector2i size = window.FramebufferSize();
    renderer.Present(size.x(), size.y());
    panel.Draw();
    window.Show();
  };
  draw();
  // The button is held long enough that some frame polls it. Without a window manager the window's corner is
  // the screen's corner.
  std::thread hand([] {
    const int status =
        std::system("xdotool mousemove 200 400 && xdotool mousedown 1 && sleep 0.15 && xdotool mouseup 1");
    EXPECT_EQ(status, 0);
  });
  const std::optional<InputEvent> click = AwaitClick(&window, draw);
  hand.join();
  ASSERT_TRUE(click.has_value());
  EXPECT_EQ(click->button, 0);
  EXPECT_FALSE(panel.WantsMouse());
  const Eigen::Vector2i size = window.WindowSize();
  const Letterbox box = FitImage(640, 480, size.x(), size.y());
  const Eigen::Vector2d pixel = box.ImageFromWindow(click->position);
  EXPECT_TRUE(camera.IsInside(pixel));
  EXPECT_TRUE(panel.ClickImage(pixel));
  ASSERT_EQ(placed.models.size(), 1u);
  EXPECT_EQ(placed.models[0].file, "cake.glb");
  EXPECT_EQ(placed.models[0].pixel, pixel);
  EXPECT_EQ(placed.models[0].scale, 0.25);
  EXPECT_EQ(placed.models[0].yaw_deg, -90);
}

TEST(Letterbox, MapsWindowPointsToImagePixels) {
  const Letterbox box = FitImage(640, 480, 1280, 1000);
  EXPECT_EQ(box.width, 1280);
  EXPECT_EQ(box.height, 960);
  EXPECT_EQ(box.y, 20);
  EXPECT_LT((box.ImageFromWindow({1, 21}) - Eigen::Vector2d(0, 0)).norm(), 1e-12);
  EXPECT_LT((box.ImageFromWindow({1279, 979}) - Eigen::Vector2d(639, 479)).norm(), 1e-12);
}

}  // namespace
}  // namespace docent::ui
