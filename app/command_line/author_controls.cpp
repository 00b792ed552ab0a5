// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/author_controls.h"

#include <algorithm>
#include <map>
#include <utility>

#include "app/command_line/command_words.h"
#include "app/session/file_kind.h"
#include "ui/strings.h"

namespace docent::app {

namespace {

// Chooses the tool and the file with which one of the dropped files is placed. Returns false where it cannot
// be.
bool ChooseToPlace(const std::string& file, const std::vector<std::string>& dropped,
                   ui::AuthoringChoices* choices) {
  switch (KindOfFile(file)) {
    case content::AssetKind::kImage:
      choices->tool = ui::AuthoringTool::kImage;
      choices->image_file = file;
      return true;
    case content::AssetKind::kSound: {
      // The caption in the panel is for one sound, and for this one only while it can be seen there. Without
      // another caption, its name is shown.
      const auto is_sound = [](const std::string& other) {
        return KindOfFile(other) == content::AssetKind::kSound;
      };
      const bool is_only_one = std::ranges::count_if(dropped, is_sound) == 1;
      const bool is_seen = choices->tool == ui::AuthoringTool::kSound && choices->panel_open;
      if (!is_only_one || !is_seen || choices->caption.empty())
        choices->caption = content::NameFromFile(file);
      choices->tool = ui::AuthoringTool::kSound;
      choices->sound_file = file;
      return true;
    }
    case content::AssetKind::kModel:
      choices->tool = ui::AuthoringTool::kModel;
      choices->model_file = file;
      return IsModelFile(file);
  }
  return false;
}

// Whether commands are no longer for the map with this name, which the camera was in.
bool LeavesMap(const Command& done, const std::string& map) {
  if (const auto* use = std::get_if<UseMap>(&done)) return use->name != map;
  if (const auto* remove = std::get_if<RemoveMap>(&done)) return remove->name == map;
  return std::holds_alternative<NewMap>(done) || std::holds_alternative<StopMap>(done);
}

}  // namespace

AuthorControls::AuthorControls(ui::Window* window, Host host, std::filesystem::path model_folder)
    : CommandActions([this](Command command) { Emit(std::move(command)); }),
      window_(window),
      host_(std::move(host)),
      gui_(window),
      panel_(this),
      shapes_(host_.language),
      pointer_(&selection_, &shapes_, this),
      fitting_(&shapes_),
      ghost_(std::move(model_folder)),
      recent_(RecentFiles::DefaultPlace()) {
  files_ = ModelFilesIn(".");
  for (const std::string& file : recent_.files()) {
    std::error_code error;
    const bool is_here = std::any_of(files_.begin(), files_.end(), [&](const std::string& other) {
      return std::filesystem::equivalent(file, other, error);
    });
    if (!is_here) files_.push_back(file);
  }
  if (!files_.empty()) panel_.choices().model_file = files_.front();
}

double AuthorControls::Now() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

void AuthorControls::Take(const std::vector<Notice>& notices) {
  for (const Notice& notice : notices) {
    board_.AddError(notice.problem);
    if (!notice.problem.empty()) pointer_.ForgetSteps();
    if (notice.activity) board_.AddDone(*notice.activity, false, Now());
    if (!notice.done) continue;
    board_.AddDone(DoneText(*notice.done), CanBeUndone(*notice.done), Now());
    leaves_map_ = leaves_map_ || LeavesMap(*notice.done, map_name_);
    if (const auto* renamed_map = std::get_if<app::RenameMap>(&*notice.done)) {
      for (std::string* name : {&map_name_, &copied_from_, &panel_.choices().sign_to_map}) {
        if (*name == renamed_map->name) *name = renamed_map->new_name;
      }
    }
    if (const auto* removed_map = std::get_if<app::RemoveMap>(&*notice.done)) {
      std::string& to_map = panel_.choices().sign_to_map;
      if (to_map == removed_map->name) to_map.clear();
    }
    if (const auto* renamed = std::get_if<RenameEntity>(&*notice.done)) {
      selection_.Rename(renamed->name, renamed->new_name);
      if (copied_from_ == map_name_) std::ranges::replace(copied_names_, renamed->name, renamed->new_name);
    }
  }
}

void AuthorControls::SetView(AuthorView view, const SavingState& saving, std::vector<ui::MapFacts> maps) {
  view_ = std::move(view);
  saving_ = saving;
  maps_ = std::move(maps);
  EndMeasuringInAnotherImage();
  const std::uint64_t map = view_.frame ? view_.frame->tracked.map_key : 0;
  // Of a lost camera, the selection waits until it is back in the map.
  if (map != 0 && std::exchange(scene_map_, map) != map) {
    board_.WithdrawUndo();
    selection_.Clear();
    pointer_.Cancel();
    placing_.Cancel();
    fitting_.End();
    names_before_.reset();
    content_.reset();
    map_from_upright_ = {};
  }
  KeepContent();
  if (map == 0) return;
  SelectNew();
  selection_.KeepExisting(view_.scene.get());
  fitting_.KeepExisting(view_.scene.get());
}

void AuthorControls::KeepContent() {
  if (!view_.frame) return;
  if (view_.frame->tracked.map_key == 0) {
    if (leaves_map_ || !view_.frame->shown.starting_map.empty()) {
      content_.reset();
      board_.WithdrawUndo();
    }
    // The content goes on changing: commands that need no pose are for this map.
    if (auto scene = content_ ? host_.scene_of(scene_map_) : nullptr) content_ = std::move(scene);
    return;
  }
  // A frozen frame keeps the name that the map had before it was renamed (see Take).
  std::pair seen(view_.frame->tracked.map_key, view_.frame->shown.map_name);
  if (seen != seen_map_) map_name_ = seen.second;
  seen_map_ = std::move(seen);
  if (!content_) leaves_map_ = false;
  if (!view_.scene) return;
  content_ = view_.scene;
  if (!view_.has_pose()) return;
  map_from_upright_ = UprightRotation(*content_, *view_.frame->tracked.map);
  camera_from_map_ = view_.camera.camera_from_map;
}

// Entities that a command of this window has added are selected when they appear.
void AuthorControls::SelectNew() {
  if (!names_before_ || !view_.scene) return;
  std::vector<std::string> added;
  for (const content::Entity& entity : view_.scene->entities) {
    if (std::find(names_before_->begin(), names_before_->end(), entity.name) == names_before_->end())
      added.push_back(entity.name);
  }
  if (added.empty()) return;
  names_before_.reset();
  selection_.Set(std::move(added));
}

void AuthorControls::RememberNames() {
  names_before_.emplace();
  if (!content_) return;
  for (const content::Entity& entity : content_->entities) names_before_->push_back(entity.name);
}

bool AuthorControls::IsPlacing() const {
  return panel_.choices().tool != ui::AuthoringTool::kSelect;
}

void AuthorControls::Handle(const ui::InputEvent& event) {
  using Kind = ui::InputEvent::Kind;
  if (event.kind == Kind::kClose) {
    window_->KeepOpen();
    return AskToQuit();
  }
  if (event.kind == Kind::kRelease && event.button == 0) return pointer_.Release();
  // What comes after the wish to quit changes nothing. Fields still get their keys, which do not come here.
  if (quit_dialog_.is_open() || is_quitting_ || ending_ != Ending::kNone) return;
  if (event.kind == Kind::kKey) HandleKey(event);
  if (event.kind == Kind::kClick && event.button == 0 && !gui_.WantsMouse(event.position)) HandleClick(event);
  if (event.kind == Kind::kDrop) HandleDrop(event);
}

void AuthorControls::Escape() {
  if (gui_.HasPopup()) return;  // It closes.
  if (gui_.IsNavigated()) return gui_.LeaveWidgets();
  if (pointer_.Cancel() || placing_.Cancel()) return;
  if (fitting_.is_active()) return fitting_.End();
  const ui::MapPick pick = std::exchange(panel_.choices().pick, ui::MapPick::kNone);
  if (pick == ui::MapPick::kMeasureFrom || pick == ui::MapPick::kMeasureTo) panel_.choices().frozen = false;
  if (pick != ui::MapPick::kNone) return;
  if (IsPlacing()) {
    panel_.choices().tool = ui::AuthoringTool::kSelect;
    return;
  }
  selection_.Clear();
}

void AuthorControls::HandleKey(const ui::InputEvent& event) {
  ui::AuthoringChoices& choices = panel_.choices();
  if (event.key == "f11" && !event.repeated) return ToggleFullScreen();
  if (event.key == "f9" && !event.repeated) return TogglePanel();
  if (event.control && event.key == "q") return AskToQuit();
  if (event.control && event.key == "s") return Save();
  if (gui_.WritesText()) return;
  if (event.key == "escape") return Escape();
  if (gui_.HasPopup()) return;
  if (!gui_.IsNavigated() && HandlePointerKey(event)) return;
  if (event.control) return HandleControlKey(event.key);
  if (event.key == "delete") return RemoveSelected();
  if (event.key == "f2" && selection_.names().size() <= 1) {
    choices.panel_open = true;
    return selection_.names().empty() ? panel_.BeginMapRename() : panel_.BeginRename();
  }
  if (event.key == "tab" && !gui_.IsNavigated()) {
    choices.panel_open = true;
    return gui_.FocusWindow(ui::AuthoringPanel::window_name());
  }
  if (!gui_.IsNavigated()) {
    if (event.key == "left") pointer_.Nudge(view_, -1, 0);
    if (event.key == "right") pointer_.Nudge(view_, 1, 0);
    if (event.key == "up") pointer_.Nudge(view_, 0, 1);
    if (event.key == "down") pointer_.Nudge(view_, 0, -1);
  }
  if (event.repeated) return;
  if (event.key.size() == 1 && event.key[0] >= '1' && event.key[0] <= '8')
    choices.tool = static_cast<ui::AuthoringTool>(event.key[0] - '1');  // In their order.
  if (event.key == "space" && !gui_.IsNavigated()) host_.toggle_pause();
  if (event.key == "c") host_.swap_cameras();
  if (event.key == "f") choices.frozen = !choices.frozen;
  if (event.key == "m") choices.from_above = !choices.from_above;
  if (event.key == "g") choices.show_coverage = !choices.show_coverage;
  if (event.key == "p") choices.show_points = !choices.show_points;
  if (event.key == "k") choices.show_keyframes = !choices.show_keyframes;
  if (event.key == "h") choices.show_status = !choices.show_status;
}

bool AuthorControls::HandlePointerKey(const ui::InputEvent& event) {
  constexpr double kStep = 12, kSmallStep = 1;  // Window units at a scale of 1.
  const std::map<std::string, Eigen::Vector2d> directions = {
      {"left", {-1, 0}}, {"right", {1, 0}}, {"up", {0, -1}}, {"down", {0, 1}}};
  const auto direction = directions.find(event.key);
  if (direction != directions.end() && (event.shift || event.control)) {
    window_->MovePointer((event.control ? kSmallStep : kStep) * view_.scale * direction->second);
    return true;
  }
  if (event.key != "enter" || event.repeated) return false;
  ui::InputEvent click = event;
  click.position = window_->PointerPosition();
  if (gui_.WantsMouse(click.position)) {
    gui_.Click(click.position);
    return true;
  }
  HandleClick(click);
  pointer_.Release();
  return true;
}

void AuthorControls::HandleControlKey(const std::string& key) {
  if (key == "z") Undo();
  if (key == "y") Redo();
  if (key == "d") DuplicateSelected();
  if (key == "c") CopySelected();
  if (key == "v") Paste();
}

void AuthorControls::HandleClick(const ui::InputEvent& event) {
  if (panel_.choices().from_above || !view_.frame) return;
  if (view_.inset.Contains(event.position)) return host_.swap_cameras();
  if (!view_.ShowsImageAt(event.position)) return;
  const Eigen::Vector2d pixel = view_.PixelAt(event.position);
  if (panel_.choices().pick != ui::MapPick::kNone) return HandlePick(pixel);
  if (fitting_.is_active()) {
    const std::string note = fitting_.Click(view_, pixel);
    if (!note.empty()) board_.AddDone(note, false, Now());
    return;
  }
  if (!IsPlacing()) return pointer_.Press(view_, event.position, event.shift);
  Place(panel_.choices(), pixel);
}

// The name of the selected trail that further points may be added to; empty for none.
std::string AuthorControls::SelectedTrail() const {
  if (selection_.names().size() != 1 || !view_.scene) return "";
  const content::Entity* const entity = view_.scene->Find(selection_.names().front());
  const bool is_trail = entity != nullptr && entity->kind == content::Entity::Kind::kTrail && !entity->locked;
  return is_trail ? entity->name : "";
}

void AuthorControls::Place(const ui::AuthoringChoices& choices, const Eigen::Vector2d& pixel) {
  std::string note;
  auto command = placing_.Click(view_, choices, pixel, SelectedTrail(), &note);
  if (!note.empty()) board_.AddDone(note, false, Now());
  if (!command) return;
  if (!std::holds_alternative<ExtendTrail>(*command)) RememberNames();
  Emit(*std::move(command));
  const std::string& file = choices.model_file;
  std::error_code error;
  if (choices.tool != ui::AuthoringTool::kModel || !std::filesystem::exists(file, error)) return;
  recent_.Add(file);
  if (std::find(files_.begin(), files_.end(), file) == files_.end()) files_.push_back(file);
}

// The files are placed beside each other, in a row from the place where they were dropped.
void AuthorControls::HandleDrop(const ui::InputEvent& event) {
  constexpr double kStep = 60;  // Window units at a scale of 1.
  if (panel_.choices().from_above) return board_.AddError(ui::strings::kDropOnMap);
  Eigen::Vector2d point = event.position;
  for (const std::string& file : event.files) {
    ui::AuthoringChoices choices = panel_.choices();
    if (!ChooseToPlace(file, event.files, &choices)) {
      board_.AddError(std::filesystem::path(file).filename().string() + ui::strings::kNoModelFile);
    } else if (!view_.ShowsImageAt(point)) {
      board_.AddError(ui::strings::kDropOnImage);
    } else {
      Place(choices, view_.PixelAt(point));
      point.x() += kStep * view_.scale;
    }
  }
}

void AuthorControls::Update() {
  if (const auto chosen = dialog_.Poll()) {
    ui::AuthoringChoices& choices = panel_.choices();
    (dialog_kind_ == content::AssetKind::kImage   ? choices.image_file
     : dialog_kind_ == content::AssetKind::kSound ? choices.sound_file
                                                  : choices.model_file) = chosen->string();
    const bool is_model = dialog_kind_ == content::AssetKind::kModel;
    if (is_model && std::find(files_.begin(), files_.end(), chosen->string()) == files_.end())
      files_.push_back(chosen->string());
  }
  if (dialog_.TakeRefusal()) board_.AddError(ui::strings::kNoFileDialog);
  pointer_.Move(view_, window_->PointerPosition(), window_->IsControlDown());
  UpdatePreview();
  board_.Expire(Now());
  shapes_.EndFrame();
}

void AuthorControls::UpdatePreview() {
  const std::shared_ptr<const content::Scene> before = std::move(preview_);
  const Eigen::Vector2d point = window_->PointerPosition();
  ghost_note_.clear();
  const bool shows_ghost = IsPlacing() && !fitting_.is_active() && !panel_.choices().from_above &&
                           !gui_.WantsMouse(point) && view_.ShowsImageAt(point);
  preview_ = shows_ghost ? ghost_.AddTo(view_.scene, view_, panel_.choices(), view_.PixelAt(point),
                                        TrailEnd(), &ghost_note_)
                         : pointer_.Preview(view_.scene);
  const std::vector<std::string> faint_before = std::move(faint_);
  faint_.clear();
  for (const std::string& name : selection_.names()) {
    const content::Entity* const entity = preview_ ? preview_->Find(name) : nullptr;
    if (entity != nullptr && entity->hidden) faint_.push_back(name);
  }
  preview_changed_ = preview_changed_ || preview_ != before || faint_ != faint_before;
}

// Where a trail that the pointer makes longer ends; empty if a click would begin one.
std::optional<Eigen::Vector3d> AuthorControls::TrailEnd() const {
  if (placing_.trail_begin()) return placing_.trail_begin();
  const std::string name = SelectedTrail();
  if (name.empty()) return std::nullopt;
  return view_.scene->Find(name)->trail.points.back();
}

ui::AuthoringFacts AuthorControls::Facts() const {
  ui::AuthoringFacts facts;
  facts.maps = maps_;
  facts.unsaved = saving_.unsaved;
  if (saving_.saved_at)
    facts.saved_ago_s =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - *saving_.saved_at).count();
  facts.selection = &selection_;
  facts.files = &files_;
  facts.has_copy = !copied_names_.empty();
  facts.fit = fitting_.Facts(content_.get());
  facts.scene = content_.get();
  facts.map_key = scene_map_;
  facts.map_from_upright = map_from_upright_;
  facts.camera_from_map = camera_from_map_;
  if (!view_.frame) return facts;
  const Session::Shown& shown = view_.frame->shown;
  facts.starting = !shown.starting_map.empty();
  facts.map_name = facts.starting ? shown.starting_map : shown.map_name;
  facts.has_pose = view_.has_pose();
  return facts;
}

double AuthorControls::Draw(const ui::WindowLayout& layout) {
  gui_.Begin(layout.scale);
  const ui::AuthoringFacts facts = Facts();
  if (!panel_.choices().from_above) {
    const Eigen::Vector2d pointer = window_->PointerPosition();
    ui::SceneOverlay overlay(view_.camera, view_.box, view_.image, view_.scale);
    if (panel_.choices().show_boundary && view_.has_pose() && view_.frame->shown.bounds) {
      const maps::Bounds& bounds = *view_.frame->shown.bounds;
      overlay.DrawBoundary({bounds.min, bounds.max});
    }
    if (preview_) {
      // Handles would cover the object whose points are to be clicked.
      if (fitting_.is_active()) {
        fitting_.Draw(view_, *preview_, &overlay);
      } else {
        pointer_.Draw(view_, *preview_, pointer, &overlay);
      }
    }
    if (!ghost_note_.empty()) overlay.DrawNote(pointer, ghost_note_);
    if (panel_.choices().frozen) overlay.DrawBanner(ui::strings::kFrozen);
  }
  panel_.Draw(layout, facts);
  GoOnAfterWriting();
  const double height = ui::DrawMessages(layout, &board_, this);
  quit_dialog_.Draw(layout, this);
  gui_.Draw();
  return height;
}

void AuthorControls::Fit(ui::FitStep step) {
  switch (step) {
    case ui::FitStep::kBegin:
      if (selection_.names().size() == 1) fitting_.Begin(selection_.names().front());
      return;
    case ui::FitStep::kRemoveLast:
      return fitting_.RemoveLast();
    case ui::FitStep::kAlign:
      return Emit(fitting_.AlignCommand());
    case ui::FitStep::kBend:
      return Emit(fitting_.BendCommand());
    case ui::FitStep::kEnd:
      return fitting_.End();
  }
}

void AuthorControls::Emit(Command command) {
  has_emitted_ = true;
  host_.emit(std::move(command));
}

void AuthorControls::TogglePanel() {
  bool& is_open = panel_.choices().panel_open;
  closes_panel_ = is_open && gui_.WritesText();
  if (closes_panel_) return gui_.LeaveField();
  is_open = !is_open;
}

void AuthorControls::AskToQuit() {
  is_quitting_ = true;
  has_emitted_ = false;
  gui_.LeaveField();  // Also without a field: keys that were pressed before do not answer the question.
}

void AuthorControls::GoOnAfterWriting() {
  if (gui_.IsLeavingField()) return;
  if (std::exchange(closes_panel_, false)) panel_.choices().panel_open = false;
  if (!std::exchange(is_quitting_, false)) return;
  // What was written is not in the state of saving before it was carried out.
  if (!saving_.unsaved && !has_emitted_) return Quit(true);
  quit_dialog_.Open();
}

void AuthorControls::Quit(bool save) {
  ending_ = save ? Ending::kSave : Ending::kDiscard;
}

void AuthorControls::ChooseFile(content::AssetKind kind) {
  const bool is_image = kind == content::AssetKind::kImage, is_sound = kind == content::AssetKind::kSound;
  const char* const title = is_image   ? ui::strings::kBrowseImageTitle
                            : is_sound ? ui::strings::kBrowseSoundTitle
                                       : ui::strings::kBrowseTitle;
  const std::string patterns = is_image   ? "*.png *.jpg *.jpeg"
                               : is_sound ? "*.wav *.flac *.ogg *.oga"
                                          : ModelFilePatterns();
  if (dialog_.is_open()) return;
  dialog_kind_ = kind;
  if (!dialog_.Open(title, patterns)) board_.AddError(ui::strings::kNoFileDialog);
}

// Entities of a group are selected together.
void AuthorControls::Select(const std::string& name, bool add) {
  const content::Entity* const entity = content_ ? content_->Find(name) : nullptr;
  if (entity == nullptr || entity->group.empty()) return selection_.Select(name, add);
  const bool removes = add && selection_.Contains(name);
  std::vector<std::string> names;
  if (add) names = selection_.names();
  for (const content::Entity& other : content_->entities) {
    if (other.group != entity->group) continue;
    std::erase(names, other.name);
    if (!removes) names.push_back(other.name);
  }
  selection_.Set(std::move(names));
}

void AuthorControls::RemoveSelected() {
  if (!selection_.empty()) Emit(RemoveEntities{selection_.names()});
}

void AuthorControls::DuplicateSelected() {
  if (selection_.empty()) return;
  RememberNames();
  Emit(DuplicateEntities{selection_.names()});
}

void AuthorControls::CopySelected() {
  if (selection_.empty() || map_name_.empty()) return;
  copied_names_ = selection_.names();
  copied_from_ = map_name_;
}

// At the pointer, if it is over the image, else in the middle of the image.
void AuthorControls::Paste() {
  if (copied_names_.empty()) return;
  RememberNames();
  PasteEntities command{copied_names_, copied_from_, std::nullopt};
  const Eigen::Vector2d point = window_->PointerPosition();
  if (!panel_.choices().from_above && !gui_.WantsMouse(point) && view_.ShowsImageAt(point))
    command.to_pixel = view_.PixelAt(point);
  Emit(std::move(command));
}

// Under the first unused name of "group-1", "group-2" ...
void AuthorControls::Group(const std::vector<std::string>& names) {
  if (!content_) return;
  const auto is_used = [&](const std::string& group) {
    return std::any_of(content_->entities.begin(), content_->entities.end(),
                       [&](const content::Entity& entity) { return entity.group == group; });
  };
  int number = 1;
  while (is_used("group-" + std::to_string(number))) ++number;
  Emit(GroupEntities{names, "group-" + std::to_string(number)});
}

// The view is frozen while a length is measured, so that both points are those of one image.
void AuthorControls::HandlePick(const Eigen::Vector2d& pixel) {
  ui::AuthoringChoices& choices = panel_.choices();
  switch (std::exchange(choices.pick, ui::MapPick::kNone)) {
    case ui::MapPick::kNone:
      return;
    case ui::MapPick::kFloor:
      return Emit(SetMapUp{pixel});
    case ui::MapPick::kMeasureFrom:
      measured_from_ = pixel;
      measured_in_ = view_.frame;
      choices.frozen = true;
      choices.pick = ui::MapPick::kMeasureTo;
      return;
    case ui::MapPick::kMeasureTo:
      Emit(SetMapScale{measured_from_, pixel, choices.length_m});
      choices.frozen = false;
      return;
  }
}

void AuthorControls::EndMeasuringInAnotherImage() {
  ui::AuthoringChoices& choices = panel_.choices();
  if (choices.pick != ui::MapPick::kMeasureTo || view_.frame == measured_in_) return;
  choices.pick = ui::MapPick::kNone;
  choices.frozen = false;
  board_.AddDone(ui::strings::kMeasureEnded, false, Now());
}

}  // namespace docent::app
