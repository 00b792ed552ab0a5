// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "ui/authoring_actions.h"

namespace docent::ui {

// Fits the selected model to the room by pairs of points: what to click next, how well each pair fits, and
// what can be done with them. Between Gui::Begin and Gui::Draw.
class FitSection {
 public:
  // `actions` must outlive the section.
  explicit FitSection(AuthoringActions* actions) : actions_(actions) {}

  void Draw(const AuthoringFacts& facts);

 private:
  void DrawBegin(const AuthoringFacts& facts);
  void DrawPairs(const FitFacts& fit);
  void DrawButtons(const FitFacts& fit);

  AuthoringActions* const actions_;
};

}  // namespace docent::ui
