// SPDX-License-Identifier: Apache-2.0
#include "ui/message_area.h"

#include <imgui.h>
#include <imgui_internal.h>

#include <algorithm>
#include <optional>

#include "ui/strings.h"
#include "ui/theme.h"

namespace docent::ui {
namespace {

ImVec4 GroundOf(Message::Kind kind) {
  const Color& color = kind == Message::Kind::kError ? theme::kError : theme::kDone;
  return {color.red, color.green, color.blue, color.alpha};
}

// The text of a message in lines of this width, with its button at the right. Returns whether the button was
// pressed.
bool DrawMessage(const Message& message, float width, float scale) {
  const char* const label = message.kind == Message::Kind::kError ? strings::kDismiss : strings::kUndo;
  const bool has_button = message.kind == Message::Kind::kError || message.offers_undo;
  const ImGuiStyle& style = ImGui::GetStyle();
  const float button_width =
      has_button ? ImGui::CalcTextSize(label).x + 2 * style.FramePadding.x + style.ItemSpacing.x : 0.0f;
  std::string text = message.text;
  if (message.count > 1) {
    char counted[32];
    std::snprintf(counted, sizeof counted, strings::kTimes, "", message.count);
    text += counted;
  }
  const float text_width = std::max(40.0f * scale, width - button_width - 2 * style.WindowPadding.x);
  const ImVec2 size = ImGui::CalcTextSize(text.c_str(), nullptr, false, text_width);
  const float height =
      std::max(size.y, has_button ? ImGui::GetFrameHeight() : 0.0f) + 2 * style.FramePadding.y;
  ImGui::PushID(static_cast<int>(message.id));
  ImGui::PushStyleColor(ImGuiCol_ChildBg, GroundOf(message.kind));
  bool pressed = false;
  if (ImGui::BeginChild("message", ImVec2(width, height), false, ImGuiWindowFlags_NoScrollbar)) {
    ImGui::SetCursorPos(ImVec2(style.WindowPadding.x, 0.5f * (height - size.y)));
    ImGui::PushTextWrapPos(style.WindowPadding.x + text_width);
    ImGui::TextUnformatted(text.c_str());
    ImGui::PopTextWrapPos();
    if (has_button) {
      ImGui::SetCursorPos(ImVec2(width - button_width, 0.5f * (height - ImGui::GetFrameHeight())));
      pressed = ImGui::Button(label);
    }
  }
  ImGui::EndChild();
  ImGui::PopStyleColor();
  ImGui::PopID();
  return pressed;
}

// A button that Enter presses too when the keyboard has chosen it.
bool Answer(const char* label) {
  const bool pressed = ImGui::Button(label);
  return pressed ||
         (ImGui::IsItemFocused() && ImGui::IsKeyPressed(ImGui::GetKeyIndex(ImGuiKey_Enter), false));
}

}  // namespace

double DrawMessages(const WindowLayout& layout, MessageBoard* board, AuthoringActions* actions) {
  if (board->messages().empty()) return 0;
  constexpr double kMostWidth = 560, kMargin = 12, kMostShare = 0.45;
  const double margin = kMargin * layout.scale;
  const double width = std::min(kMostWidth * layout.scale, layout.image.width - 2 * margin);
  if (width < 1) return 0;
  ImGui::SetNextWindowPos(ImVec2(static_cast<float>(layout.image.x + 0.5 * layout.image.width),
                                 static_cast<float>(layout.image.bottom() - margin)),
                          ImGuiCond_Always, ImVec2(0.5f, 1.0f));
  ImGui::SetNextWindowSizeConstraints(
      ImVec2(static_cast<float>(width), 0),
      ImVec2(static_cast<float>(width), static_cast<float>(kMostShare * layout.image.height)));
  ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, ImVec2(0, 0));
  ImGui::PushStyleColor(ImGuiCol_WindowBg, ImVec4(0, 0, 0, 0));
  ImGui::Begin("messages", nullptr,
               ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoCollapse |
                   ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoMove |
                   ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoFocusOnAppearing);
  std::optional<Message> answered;
  const bool scrolls = ImGui::GetScrollMaxY() > 0;
  const float inner = static_cast<float>(width) - (scrolls ? ImGui::GetStyle().ScrollbarSize : 0.0f);
  ImGui::PopStyleVar();
  for (const Message& message : board->messages()) {
    if (DrawMessage(message, inner, static_cast<float>(layout.scale))) answered = message;
  }
  const auto errors =
      std::count_if(board->messages().begin(), board->messages().end(),
                    [](const Message& message) { return message.kind == Message::Kind::kError; });
  const bool all_dismissed = errors > 1 && ImGui::Button(strings::kDismissAll);
  const double height = ImGui::GetWindowHeight();
  ImGui::End();
  ImGui::PopStyleColor();
  if (answered && answered->kind == Message::Kind::kDone) actions->Undo();
  if (answered) board->Dismiss(answered->id);
  if (all_dismissed) board->DismissAll();
  return height + margin;
}

void QuitDialog::Draw(const WindowLayout& layout, AuthoringActions* actions) {
  if (opens_) ImGui::OpenPopup(strings::kQuitTitle);
  opens_ = false;
  const double width = layout.image.width + layout.panel.width;
  ImGui::SetNextWindowPos(
      ImVec2(static_cast<float>(0.5 * width), static_cast<float>(0.5 * layout.image.height)),
      ImGuiCond_Always, ImVec2(0.5f, 0.5f));
  is_open_ = ImGui::BeginPopupModal(
      strings::kQuitTitle, nullptr,
      ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings);
  if (!is_open_) return;
  ImGui::TextUnformatted(strings::kQuitQuestion);
  ImGui::Spacing();
  const bool appears = ImGui::IsWindowAppearing();
  if (Answer(strings::kSaveAndQuit)) actions->Quit(true);
  if (appears) {
    ImGui::SetItemDefaultFocus();
    ImGui::GetCurrentContext()->NavDisableHighlight = false;  // Shows which answer Enter gives.
  }
  ImGui::SameLine();
  if (Answer(strings::kQuitWithoutSaving)) actions->Quit(false);
  ImGui::SameLine();
  if (Answer(strings::kCancel) || ImGui::IsKeyPressed(ImGui::GetKeyIndex(ImGuiKey_Escape), false))
    ImGui::CloseCurrentPopup();
  ImGui::EndPopup();
}

}  // namespace docent::ui
