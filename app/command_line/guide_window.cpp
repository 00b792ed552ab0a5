// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/guide_window.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "app/command_line/adaptive_quality.h"
#include "app/command_line/author_controls.h"
#include "app/command_line/interruption.h"
#include "app/command_line/map_panel.h"
#include "app/command_line/visitor_controls.h"
#include "app/command_line/window_times.h"
#include "app/session/eye_view.h"
#include "ui/inset.h"
#include "ui/letterbox.h"
#include "ui/window.h"

namespace docent::app {

namespace {

constexpr int kAuthorWidth = 1280, kAuthorHeight = 800;

// The window, its renderers and the handling of keyboard and mouse input.
class GuideWindow {
 public:
  GuideWindow(const GuideRequest& request, std::span<const CalibratedCamera> cameras, const WindowLink& link)
      : request_(request),
        link_(link),
        cameras_(cameras),
        window_(request.title, request.may_write ? kAuthorWidth : cameras.front().model->width_px(),
                request.may_write ? kAuthorHeight : cameras.front().model->height_px()),
        renderer_(OptionsFor(request)),
        newest_(cameras.size()),
        shown_(cameras.size()) {
    if (request.record) recorder_.emplace(*request.record, cameras.front().source->info().nominal_fps);
    if (!request.may_write) {
      MakeVisitorControls();
      return;
    }
    AuthorControls::Host host;
    host.language = request.language;
    host.emit = [this](Command command) { Emit(std::move(command)); };
    host.toggle_full_screen = [this] { window_.ToggleFullScreen(); };
    host.swap_cameras = [this] { Swap(); };
    host.toggle_pause = [this] { link_.toggle_pause(); };
    host.scene_of = [this](std::uint64_t map_key) { return link_.scene_of(map_key); };
    controls_.emplace(&window_, std::move(host), request.model_folder);
  }

  // Handles the input and draws the frames. Returns false when the window was closed.
  bool Update(std::vector<std::shared_ptr<const ShownFrame>> frames) {
    using Part = WindowTimes::Part;
    times_.Start();
    HandleEvents();
    const auto fresh = Take(std::move(frames));
    Report(FrameStage::kTaken, fresh);
    const ui::WindowLayout layout = Layout();
    if (controls_) {
      controls_->Take(link_.notices->TakeAll());
      controls_->SetView(ViewIn(layout), link_.saving(), Maps());
      controls_->Update();
    }
    if (visitor_) {
      visitor_->SetView(SeenByVisitor(layout));
      visitor_->Update(window_.PointerPosition(), std::chrono::steady_clock::now());
    }
    times_.Add(Part::kInput);
    if (IsClosing()) return false;
    const bool draws = NeedsDrawing() || !fresh.empty();
    if (visitor_ && !draws && !IsDue()) return true;
    const auto begin = std::chrono::steady_clock::now();
    if (draws) DrawImage();
    times_.Add(Part::kImage);
    Present(layout, !fresh.empty());
    times_.Add(Part::kPresent);
    if (controls_) message_height_ = controls_->Draw(layout);
    times_.Add(Part::kInterface);
    Report(FrameStage::kDrawn, fresh);
    window_.Show();
    times_.Add(Part::kShow);
    Report(FrameStage::kShown, fresh);
    if (draws) AdaptQuality(begin);
    return true;
  }

  void Close() {
    try {
      if (recorder_) recorder_->Close();
    } catch (const Error& error) {
      // With a failure, a kiosk that its staff has ended would start again.
      if (request_.kiosk_code.empty()) throw;
      spdlog::error("{}", error.what());
    }
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

  void Report(FrameStage stage, std::span<const std::shared_ptr<const ShownFrame>> frames) const {
    for (const auto& frame : frames) link_.reached(stage, *frame);
  }

  // Keeps the frames; the shown ones stay while the view is frozen. Returns those that are new on the screen.
  std::vector<std::shared_ptr<const ShownFrame>> Take(std::vector<std::shared_ptr<const ShownFrame>> frames) {
    std::vector<std::shared_ptr<const ShownFrame>> fresh;
    for (std::size_t i = 0; i < frames.size(); ++i) {
      if (!frames[i] || frames[i]->tracked.state == engine::TrackingState::kDropped) continue;
      // Made before a step of the visitor that is shown already.
      if (newest_[i] && frames[i]->serial < newest_[i]->serial) continue;
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

  // The content of the shown frame; with a frozen view the one that its map has now, wherever the camera is.
  std::shared_ptr<const content::Scene> SceneOfLarge() {
    if (!is_frozen()) return large()->shown.scene;
    const std::uint64_t map = large()->tracked.map_key;
    if (auto scene = link_.scene_of(map)) newer_scene_ = {map, std::move(scene)};
    const bool has_newer = newer_scene_.first == map && newer_scene_.second;
    return has_newer ? newer_scene_.second : large()->shown.scene;
  }

  void MakeVisitorControls() {
    VisitorControls::Host host;
    host.emit = [this](const GuideVisitor& guide) { Lead(guide); };
    host.swap_cameras = [this] { Swap(); };
    host.toggle_full_screen = [this] { window_.ToggleFullScreen(); };
    host.toggle_fast_forward = [this] { link_.toggle_fast_forward(); };
    host.language = request_.language;
    host.has_route = request_.route.has_value();
    host.kiosk_code = request_.kiosk_code;
    visitor_.emplace(std::move(host));
    AdaptiveQuality::WarmUp(&renderer_);
    if (visitor_->is_locked()) window_.ToggleFullScreen();
  }

  // Without anything new, a visitor's window is shown anew now and then, in case that it was covered.
  bool IsDue() {
    constexpr auto kInterval = std::chrono::milliseconds(250);
    const auto now = std::chrono::steady_clock::now();
    if (now - presented_ < kInterval) return false;
    presented_ = now;
    return true;
  }

  void AdaptQuality(std::chrono::steady_clock::time_point begin) {
    presented_ = std::chrono::steady_clock::now();
    if (!visitor_) return;
    const auto change = quality_.Add(begin, presented_);
    if (!change) return;
    link_.adapted(*change);
    redraw_ = true;
  }

  // The size of what visitors read and touch.
  ui::HeadsUpStyle VisitorStyle() const {
    const Eigen::Vector2i size = window_.FramebufferSize().cwiseMax(1);
    const double pixels_per_mm = window_.PixelsPerMillimetre();
    ui::HeadsUpStyle style;
    style.unit_px = ui::VisitorUnit_px(size.x(), size.y(), pixels_per_mm);
    style.target_px = ui::kTouchTarget_mm * pixels_per_mm;
    return style;
  }

  VisitorControls::Seen SeenByVisitor(const ui::WindowLayout& layout) {
    const Eigen::Vector2i size = window_.FramebufferSize().cwiseMax(1);
    VisitorControls::Seen seen;
    seen.frame = large();
    seen.width_px = size.x();
    // With a display on the head, nothing is touched.
    if (!request_.display) seen.targets = renderer_.card_targets();
    seen.height_px = size.y();
    seen.style = VisitorStyle();
    seen.pixels_per_unit = size.x() / std::max(1.0, layout.image.width);
    seen.box = ui::FitImage(camera().width_px(), camera().height_px(), size.x(), size.y());
    const ui::Area inset = ViewIn(layout).inset;
    const double pixels = seen.pixels_per_unit;
    seen.inset = {pixels * inset.x, pixels * inset.y, pixels * inset.width, pixels * inset.height};
    return seen;
  }

  // What is drawn at present, without the heads-up display.
  ui::View CurrentView() {
    ui::View view = ViewOf(*large(), *cameras_[large_].model);
    if (has_inset())
      AddOther(*shown_[1 - large_], *cameras_[1 - large_].model,
               VisitorStringsFor(controls_ ? "en" : request_.language), &view);
    if (visitor_) visitor_->AddTo(&view);
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

  bool NeedsDrawing() {
    bool needs = std::exchange(redraw_, false);
    if (visitor_) return (visitor_->TakeChange() || needs) && large();
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
    view.labels = &renderer_.label_areas();
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

  // Each eye's image in its half of the window, drawn one after the other.
  void PresentEyes() {
    const Eigen::Vector2i size = window_.FramebufferSize().cwiseMax(1);
    const ui::View view = large() ? CurrentView() : ui::View();
    for (const int eye : {0, 1}) {
      ui::WindowPart part;
      part.x = eye * size.x() / 2;
      part.width_px = std::max(1, size.x() / 2);
      part.height_px = part.window_height_px = size.y();
      EyeView eye_view;
      if (large())
        MakeEyeView(view, *large(), request_.display->eyes[static_cast<std::size_t>(eye)], &eye_view);
      eye_view.view.overlay.hud = false;
      if (large()) {
        const engine::CameraModel& lens = *eye_view.view.camera;
        quality_.Apply(ui::FitImage(lens.width_px(), lens.height_px(), part.width_px, part.height_px).scale,
                       &renderer_, &eye_view.view);
        renderer_.Draw(eye_view.view);
      }
      eye_view.view.overlay.hud = large() != nullptr;
      renderer_.PresentWithHeadsUp(eye_view.view, part,
                                   {ui::VisitorUnit_px(part.width_px, part.height_px, 0), 0, 0});
    }
  }

  void DrawImage() {
    if (request_.display) return;  // See PresentEyes.
    ui::View view = CurrentView();
    // What is recorded has the size of the camera's image.
    if (visitor_ && !recorder_ && !request_.on_image)
      quality_.Apply(ui::FitImage(camera().width_px(), camera().height_px(), window_.FramebufferSize().x(),
                                  window_.FramebufferSize().y())
                         .scale,
                     &renderer_, &view);
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
    if (request_.display) return PresentEyes();
    const Eigen::Vector2i size = window_.FramebufferSize().cwiseMax(1);
    const double pixels = size.x() / std::max(1.0, layout.image.width + layout.panel.width);
    ui::WindowPart part;
    part.width_px = std::clamp(static_cast<int>(pixels * layout.image.width), 1, size.x());
    part.height_px = part.window_height_px = size.y();
    if (shows_map()) {
      // The map goes on growing while the view is frozen. Where no image comes, the window may change its
      // size, and the prediction of relocalization comes later than the map.
      constexpr auto kInterval = std::chrono::milliseconds(250);
      const auto now = std::chrono::steady_clock::now();
      const auto& newest = newest_[large_];
      if ((is_fresh || is_frozen() || now - map_drawn_ >= kInterval) && newest) {
        map_panel_.Draw(*newest, part.width_px, part.height_px, true);
        map_drawn_ = now;
      }
      map_panel_.Present(part);
      return;
    }
    map_drawn_ = {};
    ui::View view;
    if (large()) view = CurrentView();
    view.overlay.hud = large() != nullptr;
    ui::HeadsUpStyle style = VisitorStyle();
    if (controls_) style = {layout.scale * pixels, message_height_ * pixels, 0};
    renderer_.PresentWithHeadsUp(view, part, style);
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
    if (visitor_ && visitor_->is_locked()) window_.KeepOpen();
    if (visitor_) return visitor_->closing() || window_.IsClosing();
    if (controls_->ending() == AuthorControls::Ending::kDiscard) link_.discard_changes();
    return controls_->ending() != AuthorControls::Ending::kNone;
  }

  void Swap() {
    if (!has_inset()) return;
    large_ = 1 - large_;
    redraw_ = true;
  }

  // A slow machine may be busy with an image for a second, so a visitor's step does not wait for it.
  void Lead(const GuideVisitor& guide) {
    std::shared_ptr<const ShownFrame> frame = link_.lead(large_, guide);
    if (!frame) return Emit(guide);
    newest_[large_] = shown_[large_] = std::move(frame);
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
    for (const ui::InputEvent& event : window_.PollEvents()) {
      if (controls_) {
        controls_->Handle(event);
      } else if (visitor_) {
        using Kind = ui::InputEvent::Kind;
        if (event.kind != Kind::kResize && event.kind != Kind::kClose) link_.used();
        visitor_->Handle(event, std::chrono::steady_clock::now());
      }
    }
  }

  bool HasFirstCameraSize(const cv::Mat& image) const {
    const engine::CameraModel& first = *cameras_.front().model;
    return image.cols == first.width_px() && image.rows == first.height_px();
  }

  const GuideRequest& request_;
  const WindowLink& link_;
  const std::span<const CalibratedCamera> cameras_;
  ui::Window window_;
  ui::Renderer renderer_;
  MapPanel map_panel_;
  WindowTimes times_;
  AdaptiveQuality quality_;  // Of a visitor's window.
  std::chrono::steady_clock::time_point presented_{};
  std::optional<AuthorControls> controls_;  // Only of an author,
  std::optional<VisitorControls> visitor_;  // and only of a visitor.
  std::optional<ViewRecorder> recorder_;
  std::vector<std::shared_ptr<const ShownFrame>> newest_, shown_;  // By camera.
  std::size_t large_ = 0;                                          // Index of the camera that is shown large.
  // With a frozen view: the newest content, and its map.
  std::pair<std::uint64_t, std::shared_ptr<const content::Scene>> newer_scene_;
  std::optional<std::uint64_t> recorded_;
  std::vector<ui::MapFacts> maps_;
  std::optional<std::chrono::steady_clock::time_point> maps_time_;
  std::chrono::steady_clock::time_point map_drawn_{}, small_map_drawn_{};
  std::pair<bool, bool> drawn_choices_;  // Points and keyframes.
  double message_height_ = 0;            // Window units.
  cv::Mat image_;
  bool redraw_ = false, was_frozen_ = false;
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
