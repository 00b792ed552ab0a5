// SPDX-License-Identifier: Apache-2.0
#include "ui/theme.h"

#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace docent::ui::theme {
namespace {

constexpr Color kWhite{1, 1, 1, 1};

ImVec4 Imgui(const Color& color) {
  return {color.red, color.green, color.blue, color.alpha};
}

double LinearFromSrgb(double value) {
  return value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
}

double Luminance(const Color& color) {
  return 0.2126 * LinearFromSrgb(color.red) + 0.7152 * LinearFromSrgb(color.green) +
         0.0722 * LinearFromSrgb(color.blue);
}

}  // namespace

Color Blend(const Color& over, const Color& ground) {
  const auto mix = [&](float a, float b) { return over.alpha * a + (1 - over.alpha) * b; };
  return {mix(over.red, ground.red), mix(over.green, ground.green), mix(over.blue, ground.blue), 1.0f};
}

double ContrastRatio(const Color& a, const Color& b) {
  const double first = Luminance(a) + 0.05, second = Luminance(b) + 0.05;
  return std::max(first, second) / std::min(first, second);
}

std::span<const TextOnGround> TextPairs() {
  static const std::array kPairs = {
      TextOnGround{"text on the panel", kText, kPanel},
      TextOnGround{"text in a field", kText, kField},
      TextOnGround{"text in a field under the pointer", kText, kFieldHovered},
      TextOnGround{"text on a button", kText, kButton},
      TextOnGround{"text on a button under the pointer", kText, kButtonHovered},
      TextOnGround{"text on a pressed button", kText, kButtonActive},
      TextOnGround{"text in a selected row", kText, kSelectedRow},
      TextOnGround{"text of an error", kText, kError},
      TextOnGround{"text of what was done", kText, kDone},
      TextOnGround{"remark on the panel", kMutedText, kPanel},
      TextOnGround{"hint in a field", kMutedText, kField},
      TextOnGround{"advice on the panel", kAccentText, kPanel},
      TextOnGround{"text over the image", kText, Blend(kHeadsUp, kWhite), 7},
      TextOnGround{"text of a card", kText, kPanel, 7},
      TextOnGround{"hint of a card", kMutedText, kPanel, 7},
      TextOnGround{"chosen row of the menu", kText, kButton, 7},
      TextOnGround{"text of a signpost", kSignText, kSignBoard, 7},
      TextOnGround{"map that a signpost leads to", kSignStripText, kSignStrip, 7},
  };
  return kPairs;
}

void ApplyTheme(double scale) {
  ImGuiStyle style;
  ImGui::StyleColorsDark(&style);
  style.WindowRounding = 0.0f;
  style.ChildRounding = style.PopupRounding = 6.0f;
  style.FrameRounding = 4.0f;
  style.WindowPadding = ImVec2(10, 8);
  style.FramePadding = ImVec2(7, 4);
  style.ItemSpacing = ImVec2(7, 6);
  style.ScrollbarSize = 12.0f;
  style.WindowBorderSize = style.ChildBorderSize = 0.0f;
  style.PopupBorderSize = 1.0f;
  style.DisabledAlpha = 0.5f;
  const auto set = [&](std::initializer_list<ImGuiCol> entries, const Color& color) {
    for (const ImGuiCol entry : entries) style.Colors[entry] = Imgui(color);
  };
  set({ImGuiCol_Text}, kText);
  set({ImGuiCol_TextDisabled}, kMutedText);
  set({ImGuiCol_WindowBg, ImGuiCol_PopupBg, ImGuiCol_TitleBg, ImGuiCol_TitleBgActive, ImGuiCol_ScrollbarBg,
       ImGuiCol_TableRowBg, ImGuiCol_TableRowBgAlt},
      kPanel);
  set({ImGuiCol_FrameBg, ImGuiCol_TableHeaderBg}, kField);
  set({ImGuiCol_FrameBgHovered, ImGuiCol_FrameBgActive}, kFieldHovered);
  set({ImGuiCol_Button}, kButton);
  set({ImGuiCol_ButtonHovered, ImGuiCol_HeaderHovered}, kButtonHovered);
  set({ImGuiCol_ButtonActive, ImGuiCol_HeaderActive}, kButtonActive);
  set({ImGuiCol_Header}, kSelectedRow);
  set({ImGuiCol_Border, ImGuiCol_Separator, ImGuiCol_ScrollbarGrab}, kBorder);
  set({ImGuiCol_CheckMark, ImGuiCol_NavHighlight, ImGuiCol_ScrollbarGrabActive,
       ImGuiCol_ScrollbarGrabHovered},
      kAccentText);
  style.Colors[ImGuiCol_TextSelectedBg] = Imgui(kButtonHovered);
  style.Colors[ImGuiCol_ModalWindowDimBg] = ImVec4(0, 0, 0, 0.55f);
  style.ScaleAllSizes(static_cast<float>(scale));
  ImGui::GetStyle() = style;
}

}  // namespace docent::ui::theme
