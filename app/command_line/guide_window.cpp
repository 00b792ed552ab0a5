// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/guide_window.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "app/command_line/author_controls.h"
#include "app/command_line/interruption.h"
#include "app/command_line/kiosk.h"
#include "app/command_line/map_panel.h"
#include "app/command_line/window_times.h"
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

constexpr int kAuthorWidth = 1280, kAuthorHeight = 800;

// The window, its renderers and the handling of keyboard and mouse input.
class GuideWindow {
 public:
  GuideWindow(const GuideRequest& request, std::span<const CalibratedCamera> cameras, const WindowLink& link)
      : request_(request),
        link_(link),
        cameras_(cameras),
        kiosk_(request.kiosk_code),
        window_(request.title, request.may_write ? kAuthorWidth : cameras.front().model->width_px(),
                request.may_write ? kAuthorHeight : cameras.front().model->height_px()),
        renderer_(OptionsFor(request)),
        newest_(cameras.size()),
        shown_(cameras.size()) {
    if (request.record) recorder_.emplace(*request.record, cameras.front().source->info().nominal_fps);
    if (kiosk_.is_locked()) window_.ToggleFullScreen();
    if (!request.may_write) return;
    AuthorControls::Host host;
    host.language = request.language;
    host.emit = [this](Command command) { Emit(std::move(command)); };
    host.toggle_full_screen = [this] { window_.ToggleFullScreen(); };
    host.swap_cameras = [this] { Swap(); };
    host.toggle_pause = [this] { link_.toggle_pause(); };
    controls_.emplace(&window_, std::move(host), request.model_folder);
  }

  // Handles the input and draws the frames. Returns false when the window was closed.
  bool Update(std::vector<std::shared_ptr<const ShownFrame>> frames) {
    using Part = WindowTimes::Part;
    times_.Start();
    HandleEvents();
    const auto fresh = Take(std::move(frames));
    const ui::WindowLayout layout = Layout();
    if (controls_) {
      controls_->Take(link_.notices->TakeAll());
      controls_->SetView(ViewIn(layout), link_.saving(), Maps());
      controls_->Update();
    }
    times_.Add(Part::kInput);
    if (IsClosing()) return false;
    if (!fresh.empty() || NeedsDrawing()) DrawImage();
    times_.Add(Part::kImage);
    Present(layout, !fresh.empty());
    times_.Add(Part::kPresent);
    if (controls_) message_height_ = controls_->Draw(layout);
    times_.Add(Part::kInterface);
    window_.Show();
    times_.Add(Part::kShow);
    for (const auto& frame : fresh) link_.drawn(*frame);
    return true;
  }

  void Close() {
    if (recorder_) recorder_->Close();
    spdlog::debug("{}", times_.Summary());
  }

 private:
  static ui::RendererOptions OptionsFor(const GuideRequest& request) {
    ui::RendererOptions options;
    options.language = request.language;
    return options;
  }
  const std::shared_ptr<const ShownFrame>& large() const { return shown_[large_]; }
  const engine::CameraModel& camera() const {
    return large() && large()->camera ? *large()->camera : *cameras_[large_].model;
  }
  bool has_inset() const { return shown_.size() > 1 && shown_[1 - large_]; }
  bool is_frozen() const { return controls_ && controls_->choices().frozen; }
  bool shows_map() const { return controls_ && controls_->choices().from_above && large(); }

  // Keeps the frames; the shown ones stay while the view is frozen. Returns those that are new on the screen.
  std::vector<std::shared_ptr<const ShownFrame>> Take(std::vector<std::shared_ptr<const ShownFrame>> frames) {
    std::vector<std::shared_ptr<const ShownFrame>> fresh;
    for (std::size_t i = 0; i < frames.size(); ++i) {
      if (!frames[i] || frames[i]->tracked.state == engine::TrackingState::kDropped) continue;
      newest_[i] = std::move(frames[i]);
      if (is_frozen() && shown_[i]) continue;
      shown_[i] = newest_[i];
      fresh.push_back(shown_[i]);
    }
    if (std::exchange(was_frozen_, is_frozen()) && !is_frozen()) {
      shown_ = newest_;
      redraw_ = true;
    }
    return fresh;
  }

  // The content of the shown frame; with a frozen view that of the newest frame in the same map.
  std::shared_ptr<const content::Scene> SceneOfLarge() {
    const auto& newest = newest_[large_];
    if (newest && newest->shown.scene && newest->tracked.map_key == large()->tracked.map_key)
      newer_scene_ = {newest->tracked.map_key, newest->shown.scene};
    const bool has_newer = newer_scene_.first == large()->tracked.map_key && newer_scene_.second;
    return is_frozen() && has_newer ? newer_scene_.second : large()->shown.scene;
  }

  // What is drawn at present, without the heads-up display.
  ui::View CurrentView() {
    ui::View view = ViewOf(*large(), *cameras_[large_].model);
    if (has_inset()) view.overlay.inset = &shown_[1 - large_]->tracked;
    view.overlay.points = points_;
    view.overlay.keyframes = keyframes_;
    view.overlay.status = status_;
    if (details_) view.overlay.visitor.reset();
    if (!status_ && view.overlay.visitor) HideStatus(&*view.overlay.visitor);
    if (view.overlay.visitor) view.overlay.visitor->lists_route = lists_route_;
    if (controls_) {
      const ui::AuthoringChoices& choices = controls_->choices();
      view.overlay.points = choices.show_points;
      view.overlay.keyframes = choices.show_keyframes;
      view.overlay.status = choices.show_status;
      view.overlay.markers = true;
      view.scene = controls_->Preview().get();
      view.faint = controls_->faint();
    }
    return view;
  }

  static void HideStatus(ui::VisitorDisplay* visitor) {
    visitor->place.clear();
    visitor->route_line.clear();
  }

  bool NeedsDrawing() {
    bool needs = std::exchange(redraw_, false);
    if (!controls_) return needs && large();
    const ui::AuthoringChoices& choices = controls_->choices();
    const auto drawn = std::pair(choices.show_points, choices.show_keyframes);
    needs = std::exchange(drawn_choices_, drawn) != drawn || needs;
    needs = controls_->TakePreviewChange() || needs;
    return needs && large();
  }

  ui::WindowLayout Layout() const {
    const Eigen::Vector2d size = window_.WindowSize().cwiseMax(1).cast<double>();
    if (controls_)
      return ui::LayOutWindow(size.x(), size.y(), request_.ui_scale * window_.ContentScale(),
                              controls_->choices().panel_open);
    ui::WindowLayout layout;
    layout.image = {0, 0, size.x(), size.y()};
    return layout;
  }

  AuthorView ViewIn(const ui::WindowLayout& layout) {
    AuthorView view;
    view.frame = large();
    view.image = layout.image;
    view.scale = layout.scale;
    view.camera.lens = camera();
    view.box = ui::FitImage(camera().width_px(), camera().height_px(), layout.image);
    if (!large()) return view;
    view.camera.camera_from_map = large()->tracked.camera_from_map;
    view.scene = SceneOfLarge();
    if (!has_inset()) return view;
    const engine::CameraModel& other = *cameras_[1 - large_].model;
    const ui::Inset inset =
        ui::PlaceInset(camera().width_px(), camera().height_px(), other.width_px(), other.height_px());
    const Eigen::Vector2d low = view.box.WindowFromImage({inset.x - 0.5, inset.y - 0.5});
    view.inset = {low.x(), low.y(), inset.width * view.box.scale, inset.height * view.box.scale};
    return view;
  }

  void DrawImage() {
    ui::View view = CurrentView();
    view.overlay.hud = false;
    renderer_.Draw(view);
    if (!recorder_ && !request_.on_image) return;
    view.overlay.hud = true;
    renderer_.ReadBackWithHeadsUp(view, &image_);
    // The video has the rate and size of the first camera, so a frame is written for each of that camera's
    // images.
    const std::uint64_t index = shown_[0] ? shown_[0]->tracked.frame.index : 0;
    if (recorder_ && shown_[0] && index != recorded_ && HasFirstCameraSize(image_))
      recorder_->Write(image_, index);
    recorded_ = index;
    if (request_.on_image) request_.on_image(*large(), image_);
  }

  // The parts of the layout are in window units, which may have several pixels.
  void Present(const ui::WindowLayout& layout, bool is_fresh) {
    const Eigen::Vector2i size = window_.FramebufferSize().cwiseMax(1);
    const double pixels = size.x() / std::max(1.0, layout.image.width + layout.panel.width);
    ui::WindowPart part;
    part.width_px = std::clamp(static_cast<int>(pixels * layout.image.width), 1, size.x());
    part.height_px = part.window_height_px = size.y();
    if (shows_map()) {
      // The map goes on growing while the view is frozen.
      const auto& newest = newest_[large_];
      if ((is_fresh || is_frozen() || !std::exchange(showed_map_, true)) && newest)
        map_panel_.Draw(*newest, part.width_px, part.height_px, true);
      map_panel_.Present(part);
      return;
    }
    showed_map_ = false;
    ui::View view;
    if (large()) view = CurrentView();
    view.overlay.hud = large() != nullptr;
    const double unit_px = controls_ ? layout.scale * pixels : std::clamp(size.y() / 480.0, 0.5, 4.0);
    renderer_.PresentWithHeadsUp(view, part, unit_px, message_height_ * pixels);
    if (controls_ && large() && controls_->choices().show_coverage) PresentSmallMap(layout, pixels);
  }

  // Drawn anew four times a second, since it costs more than the image itself.
  void PresentSmallMap(const ui::WindowLayout& layout, double pixels) {
    constexpr auto kInterval = std::chrono::milliseconds(250);
    const AuthorView view = ViewIn(layout);
    const ui::Area shown = {view.box.x + 0.0, view.box.y + 0.0, view.box.width + 0.0, view.box.height + 0.0};
    const ui::Area area = ui::PlaceSmallMap(shown, view.inset, layout.scale);
    const auto& newest = newest_[large_];
    if (area.height <= 0 || !newest || !newest->tracked.map) return;
    ui::WindowPart part;
    part.x = static_cast<int>(pixels * area.x);
    part.y = static_cast<int>(pixels * area.y);
    part.width_px = std::max(1, static_cast<int>(pixels * area.width));
    part.height_px = std::max(1, static_cast<int>(pixels * area.height));
    part.window_height_px = window_.FramebufferSize().y();
    const auto now = std::chrono::steady_clock::now();
    if (now - small_map_drawn_ >= kInterval) {
      map_panel_.Draw(*newest, part.width_px, part.height_px, false);
      small_map_drawn_ = now;
    }
    map_panel_.Present(part);
  }

  bool IsClosing() {
    if (kiosk_.is_locked()) window_.KeepOpen();
    if (!controls_) return closing_ || window_.IsClosing();
    if (controls_->ending() == AuthorControls::Ending::kDiscard) link_.discard_changes();
    return controls_->ending() != AuthorControls::Ending::kNone;
  }

  void Swap() {
    if (!has_inset()) return;
    large_ = 1 - large_;
    redraw_ = true;
  }

  // Queues a command for the frame on the screen.
  void Emit(Command command) {
    const auto frame = large() ? std::shared_ptr<const engine::TrackedFrame>(large(), &large()->tracked)
                               : std::shared_ptr<const engine::TrackedFrame>();
    link_.inboxes[large_].Push({std::move(command), frame});
  }

  // All maps, asked for once a second.
  std::vector<ui::MapFacts> Maps() {
    constexpr auto kOften = std::chrono::seconds(1);
    const auto now = std::chrono::steady_clock::now();
    if (!maps_time_ || now - *maps_time_ > kOften) {
      maps_ = link_.maps();
      maps_time_ = now;
    }
    return maps_;
  }

  void HandleEvents() {
    using Kind = ui::InputEvent::Kind;
    for (const ui::InputEvent& event : window_.PollEvents()) {
      if (controls_) {
        controls_->Handle(event);
      } else if (event.kind == Kind::kKey && !event.repeated) {
        HandleKey(event);
      } else if (event.kind == Kind::kClick && event.button == 0 && large() &&
                 ViewIn(Layout()).inset.Contains(event.position)) {
        Swap();
      }
    }
  }

  // Of a tour. Visitors at a kiosk get what leads them only.
  void HandleKey(const ui::InputEvent& event) {
    if (kiosk_.is_locked()) {
      closing_ = kiosk_.Add(event.key, KioskLock::Clock::now()) || closing_;
      if (request_.route && !event.control) HandleRouteKey(event.key);
      redraw_ = true;
      return;
    }
    if (event.control && event.key == "q") closing_ = true;
    if (event.control) return;
    if (event.key == "tab" || event.key == "c") Swap();
    if (event.key == "f11") window_.ToggleFullScreen();
    if (event.key == "p") points_ = !points_;
    if (event.key == "k") keyframes_ = !keyframes_;
    if (event.key == "h") status_ = !status_;
    if (event.key == "d") details_ = !details_;
    if (request_.route) HandleRouteKey(event.key);
    redraw_ = true;
  }

  void HandleRouteKey(const std::string& key) {
    if (key == "n") Emit(GuideVisitor{GuideVisitor::Step::kSkip});
    if (key == "b") Emit(GuideVisitor{GuideVisitor::Step::kBack});
    if (key == "l") lists_route_ = !lists_route_;
  }

  bool HasFirstCameraSize(const cv::Mat& image) const {
    const engine::CameraModel& first = *cameras_.front().model;
    return image.cols == first.width_px() && image.rows == first.height_px();
  }

  const GuideRequest& request_;
  const WindowLink& link_;
  const std::span<const CalibratedCamera> cameras_;
  KioskLock kiosk_;
  ui::Window window_;
  ui::Renderer renderer_;
  MapPanel map_panel_;
  WindowTimes times_;
  std::optional<AuthorControls> controls_;  // Only of an author.
  std::optional<ViewRecorder> recorder_;
  std::vector<std::shared_ptr<const ShownFrame>> newest_, shown_;  // By camera.
  std::size_t large_ = 0;                                          // Index of the camera that is shown large.
  // With a frozen view: the newest content, and its map.
  std::pair<std::uint64_t, std::shared_ptr<const content::Scene>> newer_scene_;
  std::optional<std::uint64_t> recorded_;
  std::vector<ui::MapFacts> maps_;
  std::optional<std::chrono::steady_clock::time_point> maps_time_;
  std::chrono::steady_clock::time_point small_map_drawn_{};
  std::pair<bool, bool> drawn_choices_;  // Points and keyframes.
  double message_height_ = 0;            // Window units.
  cv::Mat image_;
  bool points_ = false, keyframes_ = false, status_ = true, details_ = false;  // Of a tour.
  bool lists_route_ = false;
  bool closing_ = false, redraw_ = false, was_frozen_ = false, showed_map_ = false;
};

}  // namespace

void ShowInWindow(const GuideRequest& request, std::span<const CalibratedCamera> cameras, FrameSlot* slot,
                  const WindowLink& link) {
  GuideWindow window(request, cameras, link);
  while (!slot->closed() && !Interruption::requested()) {
    if (!window.Update(slot->Take())) break;
  }
  window.Close();
}

}  // namespace docent::app
