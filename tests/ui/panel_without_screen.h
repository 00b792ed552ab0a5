// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>
#include <imgui.h>

#include "tests/ui/asked_for.h"

// Shared by the tests of parts of the panel.
namespace docent::ui {

// A part of the panel that is drawn by Dear ImGui alone, without a screen, in the left upper corner of a
// window whose other parts are the image, with the pointer and the keyboard of a person.
class PanelWithoutScreen : public ::testing::Test {
 protected:
  static constexpr float kWidth = 400, kHeight = 900;

  PanelWithoutScreen() {
    ImGui::SetCurrentContext(context_);
    ImGuiIO& io = ImGui::GetIO();
    io.IniFilename = nullptr;
    io.DisplaySize = ImVec2(2 * kWidth, kHeight);
    io.KeyMap[ImGuiKey_Backspace] = kBackspace;
    io.MouseDoubleClickTime = 0;  // Two clicks that follow each other are two.
    // There is no renderer that would need the texture.
    unsigned char* pixels = nullptr;
    int width_px = 0, height_px = 0;
    io.Fonts->GetTexDataAsAlpha8(&pixels, &width_px, &height_px);
  }
  ~PanelWithoutScreen() override { ImGui::DestroyContext(context_); }

  virtual void DrawPart() = 0;

  void Draw() {
    ImGui::NewFrame();
    ImGui::SetNextWindowPos(ImVec2(0, 0));
    ImGui::SetNextWindowSize(ImVec2(kWidth, kHeight));
    ImGui::Begin("panel", nullptr,
                 ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove);
    DrawPart();
    ImGui::End();
    ImGui::EndFrame();
  }

  // The pointer is seen over a widget in the frame after that in which it came there.
  void MoveTo(float x, float y) {
    ImGui::GetIO().MousePos = ImVec2(x, y);
    for (int i = 0; i < 3; ++i) Draw();
  }
  void PressAndRelease() {
    for (const bool down : {true, false}) {
      ImGui::GetIO().MouseDown[0] = down;
      Draw();
    }
    Draw();
  }
  void Click(float x, float y) {
    MoveTo(x, y);
    PressAndRelease();
  }
  void MoveToImage() { MoveTo(1.5f * kWidth, 0.5f * kHeight); }
  void ClickImage() {
    MoveToImage();
    PressAndRelease();
  }
  void Type(const char* text) {
    ImGui::GetIO().AddInputCharactersUTF8(text);
    Draw();
    Draw();
  }
  void PressBackspace() {
    for (const bool down : {true, false}) {
      ImGui::GetIO().KeysDown[kBackspace] = down;
      Draw();
    }
  }
  static bool WritesText() { return ImGui::GetIO().WantTextInput; }

  AskedFor asked_;
  AuthoringFacts facts_;

 private:
  static constexpr int kBackspace = 8;  // Any number below 512.

  ImGuiContext* const context_ = ImGui::CreateContext();
};

}  // namespace docent::ui
