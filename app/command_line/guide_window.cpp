// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/guide_window.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <set>
#include <utility>

#include "app/command_line/interruption.h"
#include "app/command_line/map_panel.h"
#include "app/command_line/window_times.h"
#include "ui/authoring_panel.h"
#include "ui/inset.h"
#include "ui/letterbox.h"
#include "ui/window.h"

namespace docent::app {

void FrameSlot::Put(std::shared_ptr<const ShownFrame> frame) {
  {
    const std::scoped_lock lock(mutex_);
    frames_.at(static_cast<std::size_t>(frame->tracked.frame.camera)) = std::move(frame);
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

bool FrameSlot::HasFrame() const {
  return std::any_of(frames_.begin(), frames_.end(), [](const auto& frame) { return frame != nullptr; });
}

std::vector<std::shared_ptr<const ShownFrame>> FrameSlot::Take() {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, std::chrono::microseconds(16667), [this] { return HasFrame() || closed_; });
  return std::exchange(frames_, std::vector<std::shared_ptr<const ShownFrame>>(frames_.size()));
}

bool FrameSlot::closed() const {
  const std::scoped_lock lock(mutex_);
  return closed_ && !HasFrame();
}

namespace {

// The window, its renderers and the handling of keyboard and mouse input.
class GuideWindow final : public ui::AuthoringActions {
 public:
  GuideWindow(const GuideRequest& request, std::span<const CalibratedCamera> cameras,
              std::span<CommandInbox> inboxes, const std::function<void(const ShownFrame&)>& drawn)
      : request_(request),
        drawn_(drawn),
        cameras_(cameras),
        inboxes_(inboxes),
        window_(request.title, cameras.front().model->width_px(), cameras.front().model->height_px()),
        shown_(cameras.size()) {
    if (request.record) recorder_.emplace(*request.record, cameras.front().source->info().nominal_fps);
    if (request.may_write) panel_.emplace(&window_, this, Models());
  }

  // Handles the input and draws the frames. Returns false when the window was closed.
  bool Update(std::vector<std::shared_ptr<const ShownFrame>> frames) {
    using Part = WindowTimes::Part;
    times_.Start();
    HandleEvents();
    times_.Add(Part::kInput);
    if (window_.IsClosing() || closing_) return false;
    std::vector<std::shared_ptr<const ShownFrame>> fresh;
    for (std::size_t i = 0; i < frames.size(); ++i) {
      if (!frames[i] || frames[i]->tracked.state == engine::TrackingState::kDropped) continue;
      shown_[i] = std::move(frames[i]);
      fresh.push_back(shown_[i]);
    }
    if (!fresh.empty()) DrawImage();
    times_.Add(Part::kImage);
    const Eigen::Vector2i size = window_.FramebufferSize();
    const int width_px = std::max(1, size.x()), height_px = std::max(1, size.y());
    if (shows_map_ && large()) {
      if (!fresh.empty()) map_panel_.Draw(*large(), width_px, height_px);
      map_panel_.Present(width_px, height_px);
    } else {
      renderer_.Present(width_px, height_px);
    }
    times_.Add(Part::kPresent);
    if (panel_) panel_->Draw();
    times_.Add(Part::kInterface);
    window_.Show();
    times_.Add(Part::kShow);
    for (const auto& frame : fresh) drawn_(*frame);
    return true;
  }

  void Close() {
    if (recorder_) recorder_->Close();
    spdlog::debug("{}", times_.Summary());
  }

 private:
  // Model files that the panel offers: those in the working directory.
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

  const std::shared_ptr<const ShownFrame>& large() const { return shown_[large_]; }
  const engine::CameraModel& camera() const { return *cameras_[large_].model; }

  void Swap() {
    if (shown_.size() < 2 || !shown_[1 - large_]) return;
    large_ = 1 - large_;
    DrawImage();
  }

  void DrawImage() {
    if (!large()) return;
    ui::View view = ViewOf(*large(), camera());
    if (shown_.size() > 1 && shown_[1 - large_]) view.overlay.inset = &shown_[1 - large_]->tracked;
    view.overlay.points = points_;
    view.overlay.keyframes = keyframes_;
    view.overlay.hud = hud_;
    if (panel_) {
      panel_->ApplyTo(&view.overlay);
      map_names_.insert(large()->shown.map_name);
      map_names_.erase("");
      panel_->SetMapNames({map_names_.begin(), map_names_.end()});
    }
    renderer_.Draw(view);
    if (!recorder_ && !request_.on_image) return;
    renderer_.ReadBack(&image_);
    // The video has the rate and size of the first camera, so a frame is written for each of that camera's
    // images.
    const std::uint64_t index = shown_[0] ? shown_[0]->tracked.frame.index : 0;
    if (recorder_ && shown_[0] && index != recorded_ && HasFirstCameraSize(image_))
      recorder_->Write(image_, index);
    recorded_ = index;
    if (request_.on_image) request_.on_image(*large(), image_);
  }

  // Queues a command for the frame on the screen.
  void Emit(Command command) {
    const auto frame = large() ? std::shared_ptr<const engine::TrackedFrame>(large(), &large()->tracked)
                               : std::shared_ptr<const engine::TrackedFrame>();
    inboxes_[large_].Push({std::move(command), frame});
  }
  void NewMap(const std::string& name) override { Emit(app::NewMap{name}); }
  void StopMap() override { Emit(app::StopMap{}); }
  void PlaceModel(const std::string& file, const Eigen::Vector2d& pixel, double scale,
                  double yaw_deg) override {
    Emit(app::PlaceModel{file, pixel, scale, yaw_deg});
  }
  void PlaceSignpost(const std::string& text, const Eigen::Vector2d& pixel,
                     const std::string& to_map) override {
    Emit(app::PlaceSignpost{text, pixel, to_map});
  }
  void Undo() override { Emit(app::Undo{}); }
  void Redo() override { Emit(app::Redo{}); }
  void Save() override { Emit(app::Save{}); }

  void HandleEvents() {
    using Kind = ui::InputEvent::Kind;
    for (const ui::InputEvent& event : window_.PollEvents()) {
      if (event.kind == Kind::kKey && !(panel_ && panel_->WantsKeyboard())) HandleKey(event);
      if (event.kind == Kind::kClick && event.button == 0 && !(panel_ && panel_->WantsMouse())) {
        HandleClick(event);
      }
    }
  }

  void HandleKey(const ui::InputEvent& event) {
    if (event.control) {
      if (!request_.may_write) return;
      if (event.key == "z") Undo();
      if (event.key == "y") Redo();
      if (event.key == "s") Save();
      return;
    }
    if (event.key == "tab") Swap();
    if (event.key == "m" && request_.may_write) shows_map_ = !shows_map_;
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
    if (!large() || size.x() < 1 || size.y() < 1) return;
    const int width = camera().width_px(), height = camera().height_px();
    const ui::Letterbox box = ui::FitImage(width, height, size.x(), size.y());
    const Eigen::Vector2d pixel = box.ImageFromWindow(event.position);
    if (shown_.size() > 1 && shown_[1 - large_]) {
      const engine::CameraModel& other = *cameras_[1 - large_].model;
      if (ui::PlaceInset(width, height, other.width_px(), other.height_px()).Contains(pixel)) return Swap();
    }
    if (panel_ && !shows_map_ && camera().IsInside(pixel)) panel_->ClickImage(pixel);
  }
  bool HasFirstCameraSize(const cv::Mat& image) const {
    const engine::CameraModel& first = *cameras_.front().model;
    return image.cols == first.width_px() && image.rows == first.height_px();
  }

  const GuideRequest& request_;
  const std::function<void(const ShownFrame&)>& drawn_;
  const std::span<const CalibratedCamera> cameras_;
  const std::span<CommandInbox> inboxes_;
  ui::Window window_;
  ui::Renderer renderer_;
  MapPanel map_panel_;
  WindowTimes times_;
  std::optional<ui::AuthoringPanel> panel_;
  std::optional<ViewRecorder> recorder_;
  std::vector<std::shared_ptr<const ShownFrame>> shown_;  // By camera.
  std::size_t large_ = 0;                                 // Index of the camera that is shown large.
  std::optional<std::uint64_t> recorded_;
  std::set<std::string> map_names_;
  cv::Mat image_;
  bool points_ = false, keyframes_ = false, hud_ = true, shows_map_ = false, closing_ = false;
};

}  // namespace

void ShowInWindow(const GuideRequest& request, std::span<const CalibratedCamera> cameras, FrameSlot* slot,
                  std::span<CommandInbox> inboxes, const std::function<void(const ShownFrame&)>& drawn) {
  GuideWindow window(request, cameras, inboxes, drawn);
  while (!slot->closed() && !Interruption::requested()) {
    if (!window.Update(slot->Take())) break;
  }
  window.Close();
}

}  // namespace docent::app
