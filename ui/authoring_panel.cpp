// SPDX-License-Identifier: Apache-2.0
#include "ui/authoring_panel.h"

#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#include <imgui.h>
#include <imgui_stdlib.h>

#include <array>
#include <filesystem>
#include <utility>

#include "engine/base/error.h"

namespace docent::ui {
namespace {

// Dear ImGui's built-in font covers Latin letters only. These fonts cover more, at the paths that Debian
// installs them to.
constexpr std::array<const char*, 2> kFonts = {"/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf",
                                               "/usr/share/fonts/truetype/noto/NotoSans-Regular.ttf"};

void LoadFont() {
  static const ImWchar kRanges[] = {0x20, 0x24F, 0x370, 0x52F, 0x2010, 0x2044, 0};
  for (const char* font : kFonts) {
    std::error_code ignored;
    if (std::filesystem::exists(font, ignored) &&
        ImGui::GetIO().Fonts->AddFontFromFileTTF(font, 15.0f, nullptr, kRanges) != nullptr)
      return;
  }
  ImGui::GetIO().Fonts->AddFontDefault();
}

}  // namespace

struct AuthoringPanel::Impl {
  Window* window = nullptr;
  AuthoringActions* actions = nullptr;
  std::vector<std::string> models, map_names;
  State state;
  ImGuiContext* context = nullptr;

  void DrawMapSection();
  void DrawPlaceSection();
  void DrawShowSection();
};

AuthoringPanel::AuthoringPanel(Window* window, AuthoringActions* actions, std::vector<std::string> models)
    : impl_(std::make_unique<Impl>()) {
  impl_->window = window;
  impl_->actions = actions;
  impl_->models = std::move(models);
  if (!impl_->models.empty()) impl_->state.model_file = impl_->models.front();
  window->MakeCurrent();
  impl_->context = ImGui::CreateContext();
  ImGui::SetCurrentContext(impl_->context);
  ImGui::GetIO().IniFilename = nullptr;  // Otherwise ImGui writes a file into the working directory.
  ImGui::StyleColorsDark();
  ImGui::GetStyle().WindowRounding = 8.0f;
  ImGui::GetStyle().FrameRounding = 4.0f;
  LoadFont();
  // ImGui chains to the callbacks that the window installed before.
  if (!ImGui_ImplGlfw_InitForOpenGL(window->handle(), true) || !ImGui_ImplOpenGL3_Init("#version 330 core")) {
    ImGui::DestroyContext(impl_->context);
    throw Error("Cannot show the authoring panel: Dear ImGui does not work with this OpenGL driver.");
  }
}

AuthoringPanel::~AuthoringPanel() {
  impl_->window->MakeCurrent();
  ImGui::SetCurrentContext(impl_->context);
  ImGui_ImplOpenGL3_Shutdown();
  ImGui_ImplGlfw_Shutdown();
  ImGui::DestroyContext(impl_->context);
}

void AuthoringPanel::SetMapNames(std::vector<std::string> map_names) {
  impl_->map_names = std::move(map_names);
}

AuthoringPanel::State& AuthoringPanel::state() {
  return impl_->state;
}

void AuthoringPanel::ApplyTo(Overlay* overlay) const {
  overlay->points = impl_->state.show_points;
  overlay->keyframes = impl_->state.show_keyframes;
  overlay->hud = impl_->state.show_hud;
}

void AuthoringPanel::Draw() {
  ImGui::SetCurrentContext(impl_->context);
  ImGui_ImplOpenGL3_NewFrame();
  ImGui_ImplGlfw_NewFrame();
  ImGui::NewFrame();
  const float width = ImGui::GetIO().DisplaySize.x;
  ImGui::SetNextWindowPos(ImVec2(width - 10.0f, 10.0f), ImGuiCond_FirstUseEver, ImVec2(1.0f, 0.0f));
  ImGui::SetNextWindowBgAlpha(0.8f);
  ImGui::Begin("Author", nullptr, ImGuiWindowFlags_AlwaysAutoResize);
  ImGui::PushItemWidth(150.0f);
  impl_->DrawMapSection();
  ImGui::Separator();
  impl_->DrawPlaceSection();
  ImGui::Separator();
  impl_->DrawShowSection();
  ImGui::PopItemWidth();
  ImGui::End();
  ImGui::Render();
  ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
}

void AuthoringPanel::Impl::DrawMapSection() {
  ImGui::InputTextWithHint("##map name", "Name of the new map", &state.map_name);
  ImGui::SameLine();
  if (ImGui::Button("New map") && !state.map_name.empty()) {
    actions->NewMap(state.map_name);
    state.map_name.clear();
  }
  if (ImGui::Button("Stop map")) actions->StopMap();
  ImGui::SameLine();
  if (ImGui::Button("Undo")) actions->Undo();
  ImGui::SameLine();
  if (ImGui::Button("Redo")) actions->Redo();
  ImGui::SameLine();
  if (ImGui::Button("Save")) actions->Save();
}

void AuthoringPanel::Impl::DrawPlaceSection() {
  const auto tool_button = [&](const char* label, Tool tool) {
    if (ImGui::RadioButton(label, state.tool == tool)) state.tool = tool;
  };
  tool_button("View only", Tool::kNone);
  ImGui::SameLine();
  tool_button("Place model", Tool::kModel);
  ImGui::SameLine();
  tool_button("Signpost", Tool::kSignpost);
  if (state.tool == Tool::kModel) {
    ImGui::InputTextWithHint("Model file", "FILE.glb", &state.model_file);
    for (const std::string& model : models) {
      const std::string label = std::filesystem::path(model).filename().string() + "##" + model;
      if (ImGui::Selectable(label.c_str(), state.model_file == model)) state.model_file = model;
    }
    constexpr double kScaleStep = 0.1, kYawStep = 15.0;
    ImGui::InputDouble("Scale", &state.scale, kScaleStep, 10 * kScaleStep, "%.3g");
    ImGui::InputDouble("Rotation", &state.yaw_deg, kYawStep, 6 * kYawStep, "%.0f deg");
    if (!(state.scale > 0)) state.scale = kScaleStep;
    ImGui::TextUnformatted("Click in the image to place the model.");
  } else if (state.tool == Tool::kSignpost) {
    ImGui::InputTextMultiline("Text", &state.sign_text, ImVec2(150.0f, 60.0f));
    if (ImGui::BeginCombo("Leads to", state.sign_to_map.empty() ? "(none)" : state.sign_to_map.c_str())) {
      if (ImGui::Selectable("(none)", state.sign_to_map.empty())) state.sign_to_map.clear();
      for (const std::string& name : map_names) {
        if (ImGui::Selectable(name.c_str(), state.sign_to_map == name)) state.sign_to_map = name;
      }
      ImGui::EndCombo();
    }
    ImGui::TextUnformatted("Click in the image to place the signpost.");
  }
}

void AuthoringPanel::Impl::DrawShowSection() {
  ImGui::Checkbox("Map points", &state.show_points);
  ImGui::SameLine();
  ImGui::Checkbox("Keyframes", &state.show_keyframes);
  ImGui::SameLine();
  ImGui::Checkbox("Status", &state.show_hud);
}

bool AuthoringPanel::WantsMouse() const {
  ImGui::SetCurrentContext(impl_->context);
  return ImGui::GetIO().WantCaptureMouse;
}

bool AuthoringPanel::WantsKeyboard() const {
  ImGui::SetCurrentContext(impl_->context);
  return ImGui::GetIO().WantCaptureKeyboard;
}

bool AuthoringPanel::ClickImage(const Eigen::Vector2d& pixel) {
  const State& state = impl_->state;
  if (state.tool == Tool::kModel && !state.model_file.empty()) {
    impl_->actions->PlaceModel(state.model_file, pixel, state.scale, state.yaw_deg);
    return true;
  }
  if (state.tool == Tool::kSignpost && !state.sign_text.empty()) {
    impl_->actions->PlaceSignpost(state.sign_text, pixel, state.sign_to_map);
    return true;
  }
  return false;
}

}  // namespace docent::ui
