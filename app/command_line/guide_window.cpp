// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/guide_window.h"

#include <algorithm>
#include <set>
#include <utility>

#include "app/command_line/interruption.h"
#include "app/script/script_file.h"
#include "engine/base/error.h"
#include "ui/authoring_panel.h"
#include "ui/letterbox.h"
#include "ui/window.h"

namespace docent::app {

void FrameSlot::Put(std::shared_ptr<const ShownFrame> frame) {
  {
    const std::scoped_lock lock(mutex_);
    frame_ = std::move(frame);
  }
  changed_.notify_one();
}

void FrameSlot::Close() {
  {
    const std::scoped_lock lock(mutex_);
    closed_ = true;
  }
  changed_.notify_one();
}

std::shared_ptr<const ShownFrame> FrameSlot::Take() {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, std::chrono::microseconds(16667), [this] { return frame_ || closed_; });
  return std::exchange(frame_, nullptr);
}

bool FrameSlot::closed() const {
  const std::scoped_lock lock(mutex_);
  return closed_ && !frame_;
}

namespace {

// The window with all that is drawn in it, and what the person's hands do there.
class GuideWindow {
 public:
  GuideWindow(const GuideRequest& request, const engine::CameraModel& camera, double frames_per_second,
              CommandInbox* inbox)
      : request_(request),
        camera_(camera),
        inbox_(inbox),
        window_(request.title, camera.width_px(), camera.height_px()) {
    if (request.record) recorder_.emplace(*request.record, frames_per_second);
    if (request.may_write)
      panel_.emplace(
          &window_, [this](const std::string& line) { Emit(line); }, Models());
  }

  // False when it was closed.
  bool Turn(std::shared_ptr<const ShownFrame> frame) {
    HandleEvents();
    if (window_.IsClosing() || closing_) return false;
    if (frame && frame->tracked.state != engine::TrackingState::kDropped) {
      shown_ = std::move(frame);
      DrawPicture();
    }
    const Eigen::Vector2i size = window_.FramebufferSize();
    renderer_.Present(std::max(1, size.x()), std::max(1, size.y()));
    if (panel_) panel_->Draw();
    window_.Show();
    return true;
  }

  void Close() {
    if (recorder_) recorder_->Close();
  }

 private:
  // Model files that the panel offers: those of the working folder.
  static std::vector<std::string> Models() {
    static const std::set<std::string> kEndings = {".glb", ".gltf", ".obj", ".ply", ".stl", ".fbx", ".dae"};
    std::vector<std::string> models;
    std::error_code error;
    for (const auto& entry : std::filesystem::directory_iterator(".", error)) {
      if (kEndings.contains(entry.path().extension().string())) {
        models.push_back(entry.path().filename().string());
      }
    }
    std::sort(models.begin(), models.end());
    return models;
  }

  void DrawPicture() {
    ui::View view = ViewOf(*shown_, camera_);
    view.overlay.points = points_;
    view.overlay.keyframes = keyframes_;
    view.overlay.hud = hud_;
    if (panel_) {
      panel_->ApplyTo(&view.overlay);
      map_names_.insert(shown_->shown.map_name);
      map_names_.erase("");
      panel_->SetMapNames({map_names_.begin(), map_names_.end()});
    }
    if (!refusal_.empty()) view.overlay.message = refusal_;
    renderer_.Draw(view);
    if (!recorder_ && !request_.on_picture) return;
    renderer_.ReadBack(&picture_);
    if (recorder_) recorder_->Write(picture_, shown_->tracked.frame.index);
    if (request_.on_picture) request_.on_picture(*shown_, picture_);
  }

  // A line of the script language becomes a command at the frame that is on the screen.
  void Emit(const std::string& line) {
    refusal_.clear();
    try {
      for (const TimedCommand& command : ParseScript("0 " + line, "window")) {
        const auto frame = shown_ ? std::shared_ptr<const engine::TrackedFrame>(shown_, &shown_->tracked)
                                  : std::shared_ptr<const engine::TrackedFrame>();
        inbox_->Push({command.command, frame});
      }
    } catch (const Error& error) {
      refusal_ = error.what();
    }
  }

  void HandleEvents() {
    using Kind = ui::InputEvent::Kind;
    for (const ui::InputEvent& event : window_.PollEvents()) {
      if (event.kind == Kind::kKey && !(panel_ && panel_->WantsKeyboard())) HandleKey(event);
      if (event.kind == Kind::kClick && event.button == 0 && panel_ && !panel_->WantsMouse()) {
        HandleClick(event);
      }
    }
  }

  void HandleKey(const ui::InputEvent& event) {
    if (event.control) {
      if (!request_.may_write) return;
      if (event.key == "z") Emit("undo");
      if (event.key == "y") Emit("redo");
      if (event.key == "s") Emit("save");
      return;
    }
    if (event.key == "escape" || event.key == "q") closing_ = true;
    bool& points = panel_ ? panel_->state().show_points : points_;
    bool& keyframes = panel_ ? panel_->state().show_keyframes : keyframes_;
    bool& hud = panel_ ? panel_->state().show_hud : hud_;
    if (event.key == "p") points = !points;
    if (event.key == "k") keyframes = !keyframes;
    if (event.key == "h") hud = !hud;
  }

  void HandleClick(const ui::InputEvent& event) {
    const Eigen::Vector2i size = window_.WindowSize();
    if (!shown_ || size.x() < 1 || size.y() < 1) return;
    const ui::Letterbox box = ui::FitPicture(camera_.width_px(), camera_.height_px(), size.x(), size.y());
    const Eigen::Vector2d pixel = box.PictureFromWindow(event.position);
    if (camera_.IsInside(pixel)) panel_->ClickPicture(pixel);
  }

  const GuideRequest& request_;
  const engine::CameraModel& camera_;
  CommandInbox* const inbox_;
  ui::Window window_;
  ui::Renderer renderer_;
  std::optional<ui::AuthoringPanel> panel_;
  std::optional<ViewRecorder> recorder_;
  std::shared_ptr<const ShownFrame> shown_;
  std::set<std::string> map_names_;
  std::string refusal_;
  cv::Mat picture_;
  bool points_ = false, keyframes_ = false, hud_ = true, closing_ = false;
};

}  // namespace

void ShowInWindow(const GuideRequest& request, const engine::CameraModel& camera, double frames_per_second,
                  FrameSlot* slot, CommandInbox* inbox) {
  GuideWindow window(request, camera, frames_per_second, inbox);
  while (!slot->closed() && !Interruption::requested()) {
    if (!window.Turn(slot->Take())) break;
  }
  window.Close();
}

}  // namespace docent::app
