// SPDX-License-Identifier: Apache-2.0
#include "ui/gui.h"

#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#include <imgui.h>
#include <imgui_internal.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <filesystem>
#include <string>
#include <utility>

#include "engine/base/error.h"
#include "ui/key_queue.h"
#include "ui/theme.h"

namespace docent::ui {
namespace {

// Dear ImGui's built-in font covers Latin letters only. These fonts cover more, at the paths that Debian
// installs them to.
constexpr std::array<const char*, 2> kFonts = {"/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf",
                                               "/usr/share/fonts/truetype/noto/NotoSans-Regular.ttf"};
constexpr double kFontSize = 14.0;

void LoadFont(double scale) {
  // Latin, Greek, Cyrillic, punctuation, arrows and geometric shapes.
  static const ImWchar kRanges[] = {0x20,   0x24F,  0x370,  0x52F,  0x2010, 0x2044,
                                    0x2190, 0x21FF, 0x25A0, 0x25FF, 0};
  ImFontAtlas& fonts = *ImGui::GetIO().Fonts;
  fonts.Clear();
  const auto size_px = static_cast<float>(std::round(kFontSize * scale));
  for (const char* font : kFonts) {
    std::error_code ignored;
    if (std::filesystem::exists(font, ignored) &&
        fonts.AddFontFromFileTTF(font, size_px, nullptr, kRanges) != nullptr)
      return;
  }
  ImFontConfig config;
  config.SizePixels = size_px;
  fonts.AddFontDefault(&config);
}

}  // namespace

struct Gui::Impl {
  Window* window = nullptr;
  ImGuiContext* context = nullptr;
  double scale = 0;
  KeyQueue keys;
  int focus_frames = 0;  // During which a window that FocusWindow chose keeps the keyboard in any case.
  int leave_frames = 0;  // Until the field is left that LeaveField leaves; 0 for none.

  std::string window_to_focus;         // By the next frame; empty for none.
  std::deque<Eigen::Vector2d> clicks;  // That are to be given to Dear ImGui.
  bool holds_click = false;            // The first of these holds the button in the present frame.

  void Use() const { ImGui::SetCurrentContext(context); }
  // After the mouse was asked for its state, and before the frame that sees it begins.
  void GiveClick();
  // Within a frame, because Dear ImGui forgets such requests between frames.
  void Focus();
  // Within a frame too: only a field that loses the keyboard there says that it was changed.
  void Leave();
};

void Gui::Impl::GiveClick() {
  if (clicks.empty()) return;
  ImGuiIO& io = ImGui::GetIO();
  io.MousePos = ImVec2(static_cast<float>(clicks.front().x()), static_cast<float>(clicks.front().y()));
  holds_click = !holds_click;
  if (holds_click) {
    io.MouseDown[ImGuiMouseButton_Left] = true;
  } else {
    clicks.pop_front();  // This frame has the state of the mouse again, so that the button is released.
  }
}

void Gui::Impl::Focus() {
  const std::string name = std::exchange(window_to_focus, {});
  ImGuiWindow* const found = name.empty() ? nullptr : ImGui::FindWindowByName(name.c_str());
  if (found == nullptr) return;
  ImGui::FocusWindow(found);
  ImGui::NavInitWindow(found, true);
  ImGui::GetCurrentContext()->NavDisableHighlight = false;
  constexpr int kFocusFrames = 5;
  focus_frames = kFocusFrames;
}

void Gui::Impl::Leave() {
  if (leave_frames == 1 && !keys.empty()) return;  // They were pressed before.
  if (leave_frames > 0 && --leave_frames == 0) ImGui::ClearActiveID();
}

Gui::Gui(Window* window) : impl_(std::make_unique<Impl>()) {
  impl_->window = window;
  window->MakeCurrent();
  impl_->context = ImGui::CreateContext();
  impl_->Use();
  ImGui::GetIO().IniFilename = nullptr;  // Otherwise ImGui writes a file into the working directory.
  ImGui::GetIO().ConfigFlags |= ImGuiConfigFlags_NavEnableKeyboard;
  // ImGui chains to the callbacks that the window installed before.
  if (!ImGui_ImplGlfw_InitForOpenGL(window->handle(), true) || !ImGui_ImplOpenGL3_Init("#version 330 core")) {
    ImGui::DestroyContext(impl_->context);
    throw Error("Cannot show the authoring panel: Dear ImGui does not work with this OpenGL driver.");
  }
}

Gui::~Gui() {
  impl_->window->MakeCurrent();
  impl_->Use();
  ImGui_ImplOpenGL3_Shutdown();
  ImGui_ImplGlfw_Shutdown();
  ImGui::DestroyContext(impl_->context);
}

void Gui::Begin(double scale) {
  impl_->Use();
  if (impl_->scale != scale) {
    impl_->scale = scale;
    LoadFont(scale);
    ImGui_ImplOpenGL3_DestroyFontsTexture();
    theme::ApplyTheme(scale);
    // The texture is made again by the first frame, which also makes the other objects.
    ImGui_ImplOpenGL3_NewFrame();
    if (ImGui::GetIO().Fonts->TexID == nullptr) ImGui_ImplOpenGL3_CreateFontsTexture();
  } else {
    ImGui_ImplOpenGL3_NewFrame();
  }
  ImGui_ImplGlfw_NewFrame();
  impl_->keys.Update(impl_->window);
  impl_->GiveClick();
  ImGui::NewFrame();
  impl_->Focus();
  impl_->Leave();
}

void Gui::Draw() {
  impl_->Use();
  // A widget that was clicked does not keep the keyboard: keys then belong to the image again.
  impl_->focus_frames = std::max(0, impl_->focus_frames - 1);
  if (impl_->focus_frames == 0 && !ImGui::IsAnyItemActive() && !ImGui::IsAnyMouseDown() && !HasPopup() &&
      !ImGui::GetIO().NavVisible && ImGui::GetIO().NavActive)
    ImGui::SetWindowFocus(nullptr);
  ImGui::Render();
  ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
}

// Dear ImGui says at the beginning of a frame whether it wants the mouse, so that what it has said is not
// true for a pointer that has moved since. This is how it decides then.
bool Gui::WantsMouse(const Eigen::Vector2d& point) const {
  impl_->Use();
  if (HasPopup()) return true;
  // A pointer that is held belongs to what it was pressed on.
  if (ImGui::IsAnyMouseDown() && !impl_->holds_click) return ImGui::GetIO().WantCaptureMouse;
  const ImVec2 at(static_cast<float>(point.x()), static_cast<float>(point.y()));
  for (const ImGuiWindow* window : impl_->context->Windows) {
    const bool is_shown = impl_->context->WithinFrameScope ? window->WasActive : window->Active;
    const bool takes = is_shown && !window->Hidden && (window->Flags & ImGuiWindowFlags_NoMouseInputs) == 0;
    if (takes && window->OuterRectClipped.Contains(at)) return true;
  }
  return false;
}

void Gui::Click(const Eigen::Vector2d& point) {
  impl_->clicks.push_back(point);
}

bool Gui::WritesText() const {
  impl_->Use();
  return ImGui::GetIO().WantTextInput;
}

bool Gui::HasPopup() const {
  impl_->Use();
  return ImGui::IsPopupOpen("", ImGuiPopupFlags_AnyPopup);
}

bool Gui::IsNavigated() const {
  impl_->Use();
  return ImGui::GetIO().NavVisible;
}

void Gui::FocusWindow(const char* name) {
  impl_->window_to_focus = name;
}

void Gui::LeaveWidgets() {
  impl_->Use();
  ImGui::SetWindowFocus(nullptr);
}

void Gui::LeaveField() {
  impl_->leave_frames = 2;
}

bool Gui::IsLeavingField() const {
  return impl_->leave_frames > 0;
}

}  // namespace docent::ui
