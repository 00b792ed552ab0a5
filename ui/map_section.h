// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "ui/authoring_actions.h"

namespace docent::ui {

// The list of all maps of the library, whether they are in memory or not, and what can be done with the
// chosen one. Between Gui::Begin and Gui::Draw.
class MapSection {
 public:
  // `actions` must outlive the section.
  explicit MapSection(AuthoringActions* actions) : actions_(actions) {}

  void Draw(const AuthoringFacts& facts);
  // Writes into the name of the current map from the next frame on.
  void BeginRename() { begins_rename_ = true; }
  bool begins_rename() const { return begins_rename_; }

 private:
  void DrawList(const AuthoringFacts& facts);
  // Chooses the chosen map under its new name once the list has that.
  void FollowRename(const AuthoringFacts& facts);
  void DrawChosen(const MapFacts& map, const AuthoringFacts& facts);
  void DrawName(const MapFacts& map, const AuthoringFacts& facts);
  void DrawPolicy(const MapFacts& map);
  void DrawRemoval(const MapFacts& map);

  AuthoringActions* const actions_;
  std::string filter_;
  std::string chosen_;      // Name of the chosen map; empty for none.
  std::string name_;        // As it is being written.
  std::string asked_name_;  // The new name of the chosen map that was asked for; empty for none.
  bool asks_removal_ = false;
  bool begins_rename_ = false;
};

// Whether `name` contains `filter`, whatever the case of ASCII letters; true for an empty filter.
bool MatchesFilter(const std::string& name, const std::string& filter);

}  // namespace docent::ui
