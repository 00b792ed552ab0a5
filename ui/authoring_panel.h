// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "ui/authoring_actions.h"
#include "ui/entity_section.h"
#include "ui/fit_section.h"
#include "ui/map_section.h"
#include "ui/space_section.h"
#include "ui/window_layout.h"

namespace docent::ui {

// The panel at the right edge of the author's window (Dear ImGui), with a scroll area of its own: map, what
// to place, contents, the selected entity, and the view. It changes nothing itself, but calls the actions. On
// the window's thread.
class AuthoringPanel {
 public:
  // `actions` must outlive the panel.
  explicit AuthoringPanel(AuthoringActions* actions)
      : actions_(actions),
        map_section_(actions),
        space_section_(actions),
        entity_section_(actions),
        fit_section_(actions) {}

  AuthoringChoices& choices() { return choices_; }
  const AuthoringChoices& choices() const { return choices_; }
  // The name of its window, for Gui::FocusWindow.
  static const char* window_name();
  // Writes into the name of the selected entity from the next frame on.
  void BeginRename() { entity_section_.BeginRename(); }

  // Writes into the name of the current map from the next frame on.
  void BeginMapRename() { map_section_.BeginRename(); }

  // Between Gui::Begin and Gui::Draw.
  void Draw(const WindowLayout& layout, const AuthoringFacts& facts);

 private:
  void DrawHeader(const AuthoringFacts& facts);
  void DrawMap(const AuthoringFacts& facts);
  void DrawPlace(const AuthoringFacts& facts);
  void DrawModelChoice(const AuthoringFacts& facts);
  void DrawSignChoice(const AuthoringFacts& facts);
  void DrawLabelChoice();
  void DrawImageChoice();
  void DrawSoundChoice();
  void DrawOccluderChoice();
  // A field for the name of a file of this kind, with a button that opens the desktop's dialog.
  void DrawFileField(const char* hint, content::AssetKind kind, std::string* file);
  void DrawView();
  void StartMap(const AuthoringFacts& facts);

  AuthoringActions* const actions_;
  AuthoringChoices choices_;
  MapSection map_section_;
  SpaceSection space_section_;
  EntitySection entity_section_;
  FitSection fit_section_;
};

// "Saved 12 s ago" and the like.
std::string SavedText(const std::optional<double>& saved_ago_s);
// The first of "Map 1", "Map 2" … that no map has.
std::string FreeMapName(const std::vector<MapFacts>& maps);

}  // namespace docent::ui
