// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <map>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "content/scene.h"
#include "engine/dense/light_estimate.h"
#include "engine/dense/surface_mesh.h"
#include "engine/geometry/camera_model.h"
#include "engine/tracking/tracked_frame.h"
#include "ui/edge_arrow.h"

namespace docent::ui {

// Where a visitor can go on, if that is outside the image.
struct WayOn {
  EdgeArrow arrow;   // In the camera's image.
  std::string text;  // "To the lions".
};

// Something in view of which a visitor can open a card.
struct CardTarget {
  std::string entity;                              // Its name.
  Eigen::Vector2d low = Eigen::Vector2d::Zero();   // The rectangle of the camera's image that it covers,
  Eigen::Vector2d high = Eigen::Vector2d::Zero();  // in pixels.
};

// Where a label is drawn, for an author who points at it: its board, or a square about its dot where it
// is far away.
struct LabelArea {
  std::string entity;        // Its name.
  Eigen::AlignedBox2d area;  // Pixels of the camera's image.
};

// What a visitor has opened; it is drawn over everything but the sentences at the bottom.
struct Card {
  std::string entity;  // The name of what was opened.
  std::string text;    // The page that is read; may be empty.
  std::string hint;    // How one goes on.
  // A model or an image, which is shown alone, whatever its pose; null for none.
  std::shared_ptr<const content::Entity> shown;
  double seconds = 0;  // Since it was opened; animations begin with it.
  // How far the model was turned by hand, about the vertical and the horizontal axis. Empty: it turns by
  // itself.
  std::optional<Eigen::Vector2d> turned_rad;
};

// A view of a place that a visitor may know it by.
struct KnownView {
  cv::Mat image;     // CV_8UC1 or CV_8UC3.
  std::string name;  // Of the place, which stands below the image.
};

// What a visitor on a tour is told, without the words of an engineer.
struct VisitorDisplay {
  std::string place;               // The name of the place where the visitor is; empty while it is not known.
  double arrival = 0;              // The opacity of its announcement in large letters, 0 to 1.
  bool is_searching = false;       // The place is not known, and an animation asks to look around.
  std::string sentence;            // What to do; empty for nothing.
  std::vector<std::string> stops;  // The known places by name, as a help to find one.
  std::optional<WayOn> way_on;     // Shown if it is given.
  // Known places that resemble what the camera sees, which are drawn beside each other.
  std::vector<KnownView> views;
  // On a tour with stops: how far the visitor has come and where to go next, shown below the place. The stops
  // themselves are shown on demand.
  std::string route_line;
  std::vector<std::string> route_stops;  // A line for each stop.
  bool lists_route = false;              // Whether these lines are shown.
  bool is_right_to_left = false;         // Texts begin at the right.
  // What has a card, and which of it the one button opens.
  std::vector<CardTarget> targets;
  std::optional<std::size_t> marked;  // Index in `targets`.
  // With gaze alone: how much of the time has passed after which what is looked at opens, 0 to 1. Empty
  // without.
  std::optional<double> dwell;
  std::optional<Card> card;  // The one that is open.
  // Whether the visitor is asked by `sentence` if a tour that was left goes on; the menu has the answers.
  bool asks_to_continue = false;
  // The choices of the menu while it is open, and the one that is chosen by the next long press.
  std::vector<std::string> menu;
  std::size_t chosen = 0;        // Index in `menu`.
  bool has_menu_button = false;  // Where a touch opens the menu.
};

// What is drawn besides the video and the content.
struct Overlay {
  bool points = false;     // Matched map points, coloured by pyramid level.
  bool keyframes = false;  // Keyframes of the map, as small frusta.
  // State, map name and hint, the search figure while there is no pose, and the labels of the content, which
  // have the resolution of these texts.
  bool hud = true;
  bool status = true;       // The state panel of the HUD; false when nothing is tracked.
  std::string map_name;     // Empty when there is no map.
  bool is_waiting = false;  // No map is tracked or started: the HUD does not ask to move the camera.
  std::string mapping;      // Mapping status of the current map; empty when nobody extends it.
  std::string message;      // One sentence at the bottom; empty for none.
  std::string hint;         // What to do so that the camera is tracked, above it; empty for none.
  // How close a map that is being started has come to its first points with depth, 0 to 1; empty when none
  // is.
  std::optional<double> starting_progress;
  // Given on a tour: it replaces state, map name and hint.
  std::optional<VisitorDisplay> visitor;
  // The newest frame of another camera, of any size; null for none. It is shown small in a corner (see
  // inset.h) with a border whose colour is its tracking state.
  const engine::TrackedFrame* inset = nullptr;
  // The content that the other camera sees, with its lens; null for none.
  const content::Scene* inset_scene = nullptr;
  const engine::CameraModel* inset_camera = nullptr;  // That lens.
  std::string inset_text;                             // Where the other camera is, below its image.
  bool markers = false;                               // Where sounds are, for authors.
  std::string caption;  // Of the sounds that play, near the bottom; empty for none.
};

// The size and place of the texts over the image.
struct HeadsUpStyle {
  double unit_px = 1;    // Pixels of the canvas per unit; a text of normal size has 15 units.
  double bottom_px = 0;  // Height at the bottom that the sentences leave free.
  double target_px = 0;  // The least side of what is touched; 0 where nothing is.
};

// All inputs of one output image. The video, pose and content always belong to the same frame.
struct View {
  const engine::TrackedFrame* tracked = nullptr;  // Image, pose and map; null: a dark background.
  const engine::CameraModel* camera = nullptr;    // The lens of the image; null: no content is drawn.
  const content::Scene* scene = nullptr;          // Null when there is no content.
  // Where the camera was a moment ago. If the frame has no pose, the content is drawn from there. Null for
  // none.
  const engine::Rigid3* held_camera_from_map = nullptr;
  // From where the content is seen, if not from the camera: by an eye beside it. Null for the camera. The
  // frame must have a pose, or a held one.
  const engine::Rigid3* seen_from_map = nullptr;
  bool shows_video = true;  // False: the content is on black, as see-through displays need it.
  // Surfaces of the map of the scene that hide content behind them; null: none do.
  std::shared_ptr<const engine::SurfaceMesh> surfaces;
  // The light in the map of the scene; null where it is not known.
  const engine::LightEstimate* light = nullptr;
  bool shadows = true;           // Models and signposts cast them on the room.
  bool follows_exposure = true;  // Models are as bright as the video is exposed.
  // Content has the noise and motion blur of the video and, with its exposure, the shading of the lens.
  bool follows_degradation = true;
  // Whether the occluders of the scene hide content behind them. Surfaces that they stand for then do not.
  bool occluders = true;
  // Names of hidden entities that are drawn all the same, faintly, because an author has selected them.
  std::span<const std::string> faint = {};
  double animation_seconds = 0;  // Time of the animations of the models, which repeat.
  // When they began, by the name of the entity; others stand still at their beginning. Null: all at 0.
  const std::map<std::string, double>* animation_starts = nullptr;
  Overlay overlay;  // What is drawn on top.
};

// Quality against speed.
struct RendererOptions {
  int samples = 4;  // Multisampling of the content, per pixel; 1 disables anti-aliasing and is fastest.
  int max_texture_px = 2048;  // Largest side of a model's textures on the graphics card, in pixels.
  std::string language = {};  // Of the reader, a tag in lower case; empty: every text is the first one.
};

// A part of a window, in pixels of its framebuffer.
struct WindowPart {
  int x = 0, y = 0;                 // Upper left corner, from the window's upper left corner.
  int width_px = 1, height_px = 1;  // Positive.
  int window_height_px = 1;         // Height of the whole window.
};

// Draws a View with OpenGL 3.3 core into an internal framebuffer, from which it can be shown or read back. A
// context (see context.h) must be current from construction to destruction, on one thread.
class Renderer {
 public:
  // Throws docent::Error when the driver rejects a shader or a framebuffer.
  explicit Renderer(const RendererOptions& options = {});
  ~Renderer();
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  // Draws into the internal framebuffer at the size of the camera's image, or at a multiple of it
  // (SetQuality).
  void Draw(const View& view);
  // From the next Draw on: `samples` as in RendererOptions, and the size of the drawn image in sizes of the
  // camera's (1 at first), with which ReadBack and the camera's pixels agree only at 1. `smooth`:
  // PresentWithHeadsUp interpolates its pixels.
  void SetQuality(int samples, double scale, bool smooth = true);
  // Shows the last drawn image in the default framebuffer, letterboxed to width_px x height_px.
  void Present(int width_px, int height_px);
  // Shows the last drawn image in a part of the default framebuffer, letterboxed, and over it the view's
  // heads-up display at the window's resolution, whatever that of the camera is; the image should have been
  // drawn without it.
  void PresentWithHeadsUp(const View& view, const WindowPart& part, const HeadsUpStyle& style);
  // What had a card in the heads-up display that was drawn last, with the boards of labels where they were
  // drawn. Valid until the next one is drawn.
  const std::vector<CardTarget>& card_targets() const;
  // The labels of the heads-up display that was drawn last, in the order in which they were drawn; none for a
  // visitor. The reference stays valid, and what it refers to changes when the next one is drawn.
  const std::vector<LabelArea>& label_areas() const;
  // Reads back the last drawn image as CV_8UC3 (BGR). *image's memory is reused if it fits.
  void ReadBack(cv::Mat* image);
  // The same with the view's heads-up display, which the drawn image shall not have. The drawn image is not
  // changed.
  void ReadBackWithHeadsUp(const View& view, cv::Mat* image);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace docent::ui
