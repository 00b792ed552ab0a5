// SPDX-License-Identifier: Apache-2.0
#include "ui/window.h"

#include <epoxy/gl.h>
// GLFW includes its own OpenGL header unless this is defined.
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <algorithm>
#include <utility>

#include "engine/base/error.h"

namespace docent::ui {
namespace {

// GLFW is one library for the whole process. It is initialized with the first window and terminated with the
// last.
int window_count = 0;

std::string LastProblem() {
  const char* description = nullptr;
  glfwGetError(&description);
  return description == nullptr ? std::string("unknown reason") : std::string(description);
}

bool IsLetter(const std::string& text) {
  return text.size() == 1 && text[0] >= 'a' && text[0] <= 'z';
}

// Whether the key does more in a widget than to write a character. Modifiers belong to other keys.
bool IsForWidgets(int key, bool control) {
  return key < GLFW_KEY_LEFT_SHIFT && (control || key >= GLFW_KEY_ESCAPE || key == GLFW_KEY_SPACE);
}

bool IsAscii(const std::string& text) {
  return std::ranges::all_of(text, [](char c) { return static_cast<unsigned char>(c) < 0x80; });
}

}  // namespace

// GLFW names keys by their places on a US keyboard. The row of digits is taken so: some layouts write its
// digits with Shift only.
std::string KeyName(int key, const std::string& written) {
  if (IsLetter(written)) return written;
  if (key >= GLFW_KEY_A && key <= GLFW_KEY_Z) {
    // Where the layout has other letters, as a Russian one, the place says which one is meant.
    if (written.empty() || !IsAscii(written))
      return std::string(1, static_cast<char>('a' + key - GLFW_KEY_A));
    return "";
  }
  if (key >= GLFW_KEY_KP_0 && key <= GLFW_KEY_KP_9)
    return std::string(1, static_cast<char>('0' + key - GLFW_KEY_KP_0));
  if (key >= GLFW_KEY_0 && key <= GLFW_KEY_9)
    return std::string(1, static_cast<char>('0' + key - GLFW_KEY_0));
  if (key >= GLFW_KEY_F1 && key <= GLFW_KEY_F12) return "f" + std::to_string(1 + key - GLFW_KEY_F1);
  switch (key) {
    case GLFW_KEY_ESCAPE:
      return "escape";
    case GLFW_KEY_SPACE:
      return "space";
    case GLFW_KEY_ENTER:
    case GLFW_KEY_KP_ENTER:
      return "enter";
    case GLFW_KEY_TAB:
      return "tab";
    case GLFW_KEY_DELETE:
      return "delete";
    case GLFW_KEY_BACKSPACE:
      return "backspace";
    case GLFW_KEY_LEFT:
      return "left";
    case GLFW_KEY_RIGHT:
      return "right";
    case GLFW_KEY_UP:
      return "up";
    case GLFW_KEY_DOWN:
      return "down";
    default:
      return "";
  }
}

struct Window::Impl {
  GLFWwindow* window = nullptr;
  std::vector<InputEvent> events;
  std::vector<TypedInput> typed;
  // The place and size of the window before it became full screen.
  Eigen::Vector2i place = Eigen::Vector2i::Zero(), size = Eigen::Vector2i::Zero();

  static Impl& Of(GLFWwindow* window) { return *static_cast<Impl*>(glfwGetWindowUserPointer(window)); }

  static void OnButton(GLFWwindow* window, int button, int action, int modifiers) {
    InputEvent event;
    event.kind = action == GLFW_PRESS ? InputEvent::Kind::kClick : InputEvent::Kind::kRelease;
    glfwGetCursorPos(window, &event.position.x(), &event.position.y());
    event.button = button;
    event.control = (modifiers & GLFW_MOD_CONTROL) != 0;
    event.shift = (modifiers & GLFW_MOD_SHIFT) != 0;
    Of(window).events.push_back(std::move(event));
  }
  static void OnKey(GLFWwindow* window, int key, int scancode, int action, int modifiers) {
    InputEvent event;
    if (action == GLFW_RELEASE) event.kind = InputEvent::Kind::kKeyUp;
    if (key == GLFW_KEY_UNKNOWN) return;
    const char* const written = glfwGetKeyName(key, scancode);
    event.key = KeyName(key, written == nullptr ? "" : written);
    event.repeated = action == GLFW_REPEAT;
    event.control = (modifiers & GLFW_MOD_CONTROL) != 0;
    event.shift = (modifiers & GLFW_MOD_SHIFT) != 0;
    if (action == GLFW_PRESS && IsForWidgets(key, event.control)) {
      const int index = IsLetter(event.key) ? GLFW_KEY_A + event.key[0] - 'a' : key;
      Of(window).typed.push_back({0, key, index, event.control, event.shift});
    }
    if (!event.key.empty()) Of(window).events.push_back(std::move(event));
  }
  static void OnCharacter(GLFWwindow* window, unsigned character) {
    TypedInput typed;
    typed.character = character;
    Of(window).typed.push_back(typed);
  }
  static void OnDrop(GLFWwindow* window, int count, const char** paths) {
    InputEvent event;
    event.kind = InputEvent::Kind::kDrop;
    glfwGetCursorPos(window, &event.position.x(), &event.position.y());
    event.files.assign(paths, paths + count);
    Of(window).events.push_back(std::move(event));
  }
  static void OnResize(GLFWwindow* window, int width_px, int height_px) {
    InputEvent event;
    event.kind = InputEvent::Kind::kResize;
    event.width_px = width_px;
    event.height_px = height_px;
    Of(window).events.push_back(std::move(event));
  }
  static void OnClose(GLFWwindow* window) {
    InputEvent event;
    event.kind = InputEvent::Kind::kClose;
    Of(window).events.push_back(std::move(event));
  }
};

Window::Window(const std::string& title, int width_px, int height_px) : impl_(std::make_unique<Impl>()) {
  if (window_count == 0 && glfwInit() != GLFW_TRUE)
    throw Error("Cannot open a window: there is no display (" + LastProblem() + "); use --headless.");
  if (GLFWmonitor* const monitor = glfwGetPrimaryMonitor(); monitor != nullptr) {
    int x = 0, y = 0, most_width = 0, most_height = 0;
    glfwGetMonitorWorkarea(monitor, &x, &y, &most_width, &most_height);
    if (most_width > 0) width_px = std::min(width_px, most_width);
    if (most_height > 0) height_px = std::min(height_px, most_height);
  }
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  glfwWindowHint(GLFW_OPENGL_FORWARD_COMPAT, GLFW_TRUE);
  // A full screen stays when another window, such as a file dialog or a notification, gets the keyboard.
  glfwWindowHint(GLFW_AUTO_ICONIFY, GLFW_FALSE);
  impl_->window = glfwCreateWindow(width_px, height_px, title.c_str(), nullptr, nullptr);
  if (impl_->window == nullptr) {
    const std::string problem = LastProblem();
    if (window_count == 0) glfwTerminate();
    throw Error("Cannot open a window: the display offers no OpenGL 3.3 core context (" + problem + ").");
  }
  ++window_count;
  glfwSetWindowUserPointer(impl_->window, impl_.get());
  glfwSetMouseButtonCallback(impl_->window, Impl::OnButton);
  glfwSetKeyCallback(impl_->window, Impl::OnKey);
  glfwSetCharCallback(impl_->window, Impl::OnCharacter);
  glfwSetDropCallback(impl_->window, Impl::OnDrop);
  glfwSetFramebufferSizeCallback(impl_->window, Impl::OnResize);
  glfwSetWindowCloseCallback(impl_->window, Impl::OnClose);
  glfwMakeContextCurrent(impl_->window);
  glfwSwapInterval(1);
}

Window::~Window() {
  glfwDestroyWindow(impl_->window);
  if (--window_count == 0) glfwTerminate();
}

void Window::MakeCurrent() {
  glfwMakeContextCurrent(impl_->window);
}

std::vector<InputEvent> Window::PollEvents() {
  impl_->typed.clear();
  glfwPollEvents();
  return std::exchange(impl_->events, {});
}

std::vector<TypedInput> Window::TakeTyped() {
  return std::exchange(impl_->typed, {});
}

void Window::Show() {
  glfwSwapBuffers(impl_->window);
}

double Window::PixelsPerMillimetre() const {
  constexpr double kUsual = 96 / 25.4, kLeast = 2, kMost = 40;  // From a projector to a telephone.
  GLFWmonitor* const monitor = glfwGetPrimaryMonitor();
  const GLFWvidmode* const mode = monitor != nullptr ? glfwGetVideoMode(monitor) : nullptr;
  int width_mm = 0, height_mm = 0;
  if (monitor != nullptr) glfwGetMonitorPhysicalSize(monitor, &width_mm, &height_mm);
  const double reported = mode != nullptr && width_mm > 0 ? static_cast<double>(mode->width) / width_mm : 0;
  const double units = reported >= kLeast && reported <= kMost ? reported : kUsual;
  return units * FramebufferSize().x() / std::max(1, WindowSize().x());
}

bool Window::IsClosing() const {
  return glfwWindowShouldClose(impl_->window) == GLFW_TRUE;
}

void Window::KeepOpen() {
  glfwSetWindowShouldClose(impl_->window, GLFW_FALSE);
}

void Window::ToggleFullScreen() {
  GLFWwindow* const window = impl_->window;
  if (glfwGetWindowMonitor(window) != nullptr) {
    glfwSetWindowMonitor(window, nullptr, impl_->place.x(), impl_->place.y(), impl_->size.x(),
                         impl_->size.y(), GLFW_DONT_CARE);
    return;
  }
  GLFWmonitor* const monitor = glfwGetPrimaryMonitor();
  const GLFWvidmode* const mode = monitor != nullptr ? glfwGetVideoMode(monitor) : nullptr;
  if (mode == nullptr) return;
  glfwGetWindowPos(window, &impl_->place.x(), &impl_->place.y());
  glfwGetWindowSize(window, &impl_->size.x(), &impl_->size.y());
  glfwSetWindowMonitor(window, monitor, 0, 0, mode->width, mode->height, mode->refreshRate);
}

Eigen::Vector2d Window::PointerPosition() const {
  Eigen::Vector2d position;
  glfwGetCursorPos(impl_->window, &position.x(), &position.y());
  return position;
}

void Window::MovePointer(const Eigen::Vector2d& by) {
  int width = 0, height = 0;
  glfwGetWindowSize(impl_->window, &width, &height);
  const Eigen::Vector2d last(std::max(width - 1, 0), std::max(height - 1, 0));
  const Eigen::Vector2d position = (PointerPosition() + by).cwiseMax(0).cwiseMin(last);
  glfwSetCursorPos(impl_->window, position.x(), position.y());
}

bool Window::IsControlDown() const {
  return glfwGetKey(impl_->window, GLFW_KEY_LEFT_CONTROL) == GLFW_PRESS ||
         glfwGetKey(impl_->window, GLFW_KEY_RIGHT_CONTROL) == GLFW_PRESS;
}

double Window::ContentScale() const {
  float across = 1, down = 1;
  glfwGetWindowContentScale(impl_->window, &across, &down);
  // Where a window unit has several pixels, the texts are that much larger already.
  const double pixels = static_cast<double>(FramebufferSize().x()) / std::max(1, WindowSize().x());
  return pixels > 0 ? across / pixels : 1.0;
}

Eigen::Vector2i Window::FramebufferSize() const {
  Eigen::Vector2i size;
  glfwGetFramebufferSize(impl_->window, &size.x(), &size.y());
  return size;
}

Eigen::Vector2i Window::WindowSize() const {
  Eigen::Vector2i size;
  glfwGetWindowSize(impl_->window, &size.x(), &size.y());
  return size;
}

GLFWwindow* Window::handle() const {
  return impl_->window;
}

}  // namespace docent::ui
