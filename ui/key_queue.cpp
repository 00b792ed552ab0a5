// SPDX-License-Identifier: Apache-2.0
#include "ui/key_queue.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <imgui.h>

namespace docent::ui {

void KeyQueue::Update(Window* window) {
  ImGuiIO& io = ImGui::GetIO();
  if (given_) {
    // Nothing says when a key is released whose letter has another place on a US keyboard.
    io.KeysDown[given_->index] =
        given_->index == given_->key && glfwGetKey(window->handle(), given_->key) == GLFW_PRESS;
    given_.reset();
  }
  io.KeyCtrl = io.KeysDown[GLFW_KEY_LEFT_CONTROL] || io.KeysDown[GLFW_KEY_RIGHT_CONTROL];
  io.KeyShift = io.KeysDown[GLFW_KEY_LEFT_SHIFT] || io.KeysDown[GLFW_KEY_RIGHT_SHIFT];
  io.ClearInputCharacters();
  for (const TypedInput& typed : window->TakeTyped()) waiting_.push_back(typed);
  for (const TypedInput& typed : waiting_) {
    if (typed.character == 0) io.KeysDown[typed.index] = io.KeysDown[typed.key] = false;
  }
  if (waiting_.empty()) return;
  if (waiting_.front().character != 0) {
    io.KeyCtrl = false;
    for (; !waiting_.empty() && waiting_.front().character != 0; waiting_.pop_front())
      io.AddInputCharacter(waiting_.front().character);
    return;
  }
  // A key that was down in the last frame has to be up in this one, or it would count as held.
  if (io.KeysDownDuration[waiting_.front().index] >= 0) return;
  given_ = waiting_.front();
  waiting_.pop_front();
  io.KeysDown[given_->index] = true;
  io.KeyCtrl = given_->control;
  io.KeyShift = given_->shift;
}

}  // namespace docent::ui
