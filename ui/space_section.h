// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "ui/authoring_actions.h"

namespace docent::ui {

// What an author says about the space of the current map: where the floor is, and how long something in it
// is, and by which view visitors find it. Between Gui::Begin and Gui::Draw.
class SpaceSection {
 public:
  // `actions` must outlive the section.
  explicit SpaceSection(AuthoringActions* actions) : actions_(actions) {}

  void Draw(const AuthoringFacts& facts, AuthoringChoices* choices);

 private:
  void DrawScale(const AuthoringFacts& facts, AuthoringChoices* choices);
  void DrawEntrance(const AuthoringFacts& facts);

  AuthoringActions* const actions_;
};

}  // namespace docent::ui
