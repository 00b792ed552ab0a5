// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/command_line/author_view.h"
#include "app/command_line/command_actions.h"
#include "app/command_line/file_dialog.h"
#include "app/command_line/fitting_tool.h"
#include "app/command_line/notices.h"
#include "app/command_line/placing_ghost.h"
#include "app/command_line/placing_tool.h"
#include "app/command_line/pointer_tool.h"
#include "app/command_line/recent_files.h"
#include "app/script/commands.h"
#include "ui/authoring_panel.h"
#include "ui/gui.h"
#include "ui/message_area.h"
#include "ui/message_board.h"

namespace docent::app {

// What an author does at the window: keys, clicks, drags and the panel become commands. On the window's
// thread.
class AuthorControls final : public CommandActions {
 public:
  // How a session ends that the author wants to leave.
  enum class Ending { kNone, kSave, kDiscard };
  // What the controls need from the window.
  struct Host {
    // Queues a command for the frame on the screen.
    std::function<void(Command)> emit;
    std::function<void()> toggle_full_screen, swap_cameras;
    std::function<void()> toggle_pause;  // Of recordings.
    // See WindowLink::scene_of.
    std::function<std::shared_ptr<const content::Scene>(std::uint64_t map_key)> scene_of;
    std::string language;  // Of the texts that are shown.
  };

  AuthorControls(ui::Window* window, Host host, std::filesystem::path model_folder);

  // Makes notices of the session messages.
  void Take(const std::vector<Notice>& notices);
  // What is shown from now on, until the next call.
  void SetView(AuthorView view, const SavingState& saving, std::vector<ui::MapFacts> maps);
  void Handle(const ui::InputEvent& event);
  // Follows the pointer; once per frame after the events.
  void Update();
  // The content as it is drawn, with what is being dragged or about to be placed.
  std::shared_ptr<const content::Scene> Preview() const { return preview_; }
  // What is selected although it is hidden, and is therefore drawn faintly.
  const std::vector<std::string>& faint() const { return faint_; }
  // Whether the preview differs from what was drawn last, so that the image has to be drawn again.
  bool TakePreviewChange() { return std::exchange(preview_changed_, false); }
  // Draws panel, messages, dialogs, outlines and handles. Returns the height at the bottom of the image that
  // the messages take, in window units.
  double Draw(const ui::WindowLayout& layout);
  // Asks whether to save, unless nothing is unsaved. What is being written becomes a change before.
  void AskToQuit();
  Ending ending() const { return ending_; }
  const ui::AuthoringChoices& choices() const { return panel_.choices(); }
  ui::AuthoringChoices& choices() { return panel_.choices(); }

  // The actions that depend on the selection and the window.
  void Quit(bool save) override;
  void ChooseFile(content::AssetKind kind) override;
  void Select(const std::string& name, bool add) override;
  void RemoveSelected() override;
  void DuplicateSelected() override;
  void CopySelected() override;
  void Paste() override;
  void Group(const std::vector<std::string>& names) override;
  void Fit(ui::FitStep step) override;
  void ToggleFullScreen() override { host_.toggle_full_screen(); }

 private:
  void HandleKey(const ui::InputEvent& event);
  void HandleControlKey(const std::string& key);
  // Moves the pointer and clicks in the image or on a widget, for authors without a mouse. Whether the key is
  // one for that.
  bool HandlePointerKey(const ui::InputEvent& event);
  void Escape();
  void Emit(Command command);
  // What is being written becomes a change before the panel closes.
  void TogglePanel();
  // Closes the panel, or quits, once no field is being written any more.
  void GoOnAfterWriting();
  void HandleClick(const ui::InputEvent& event);
  void HandleDrop(const ui::InputEvent& event);
  void HandlePick(const Eigen::Vector2d& pixel);
  // Ends the measuring of a length when its first end was shown in another image.
  void EndMeasuringInAnotherImage();
  void Place(const ui::AuthoringChoices& choices, const Eigen::Vector2d& pixel);
  std::string SelectedTrail() const;
  std::optional<Eigen::Vector3d> TrailEnd() const;
  bool IsPlacing() const;
  // Before a command that adds entities, so that SelectNew finds them.
  void RememberNames();
  void SelectNew();
  // Keeps what the panel shows of the map of the view.
  void KeepContent();
  void UpdatePreview();
  double Now() const;
  ui::AuthoringFacts Facts() const;

  ui::Window* const window_;
  const Host host_;
  ui::Gui gui_;
  ui::AuthoringPanel panel_;
  ui::MessageBoard board_;
  ui::QuitDialog quit_dialog_;
  ui::Selection selection_;
  ui::EntityShapes shapes_;
  PointerTool pointer_;
  PlacingTool placing_;
  FittingTool fitting_;
  PlacingGhost ghost_;
  FileDialog dialog_;
  content::AssetKind dialog_kind_ = content::AssetKind::kModel;  // What it is open for.
  RecentFiles recent_;
  std::vector<std::string> files_;  // To choose from: those in the working folder, then the recent ones.

  AuthorView view_;
  SavingState saving_;
  std::vector<ui::MapFacts> maps_;
  std::shared_ptr<const content::Scene> preview_;
  std::vector<std::string> faint_;
  bool preview_changed_ = false;
  std::string ghost_note_;                                   // Why nothing can be placed under the pointer.
  Eigen::Vector2d measured_from_ = Eigen::Vector2d::Zero();  // Pixel of the first end; see ui::MapPick.
  std::shared_ptr<const ShownFrame> measured_in_;            // Its image.
  // What was copied, and the map that it is in.
  std::vector<std::string> copied_names_;
  std::string copied_from_;
  // Names before a command that adds entities, which are selected when they appear.
  std::optional<std::vector<std::string>> names_before_;
  std::uint64_t scene_map_ = 0;                     // The map whose entities are selected.
  std::string map_name_;                            // Its name.
  std::pair<std::uint64_t, std::string> seen_map_;  // Key and name in the last frame with a map.
  // What the panel shows of that map, so that what is being written there is not lost with the camera. The
  // content is null before it was seen, and while a lost camera is meant to leave the map.
  std::shared_ptr<const content::Scene> content_;
  engine::Rotation3 map_from_upright_;
  engine::Rigid3 camera_from_map_;
  bool leaves_map_ = false;                          // By a command; until the camera is in a map again.
  bool closes_panel_ = false, is_quitting_ = false;  // Once the field that is being written is left.
  bool has_emitted_ = false;                         // Since the author began to quit.
  Ending ending_ = Ending::kNone;
};

}  // namespace docent::app
