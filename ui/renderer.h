// SPDX-License-Identifier: Apache-2.0
#pragma once

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

// What a visitor on a tour is told, without the words of an engineer.
struct VisitorDisplay {
  std::string place;               // The name of the place where the visitor is; empty while it is not known.
  double arrival = 0;              // The opacity of its announcement in large letters, 0 to 1.
  bool is_searching = false;       // The place is not known, and an animation asks to look around.
  std::string sentence;            // What to do; empty for nothing.
  std::vector<std::string> stops;  // The known places by name, as a help to find one.
  std::optional<WayOn> way_on;     // Shown if it is given.
  // Images of known places that resemble what the camera sees (CV_8UC1 or CV_8UC3), which are drawn beside
  // each other.
  std::vector<cv::Mat> views;
  // On a tour with stops: how far the visitor has come and where to go next, shown below the place. The stops
  // themselves are shown on demand.
  std::string route_line;
  std::vector<std::string> route_stops;  // A line for each stop.
  bool lists_route = false;              // Whether these lines are shown.
  bool is_right_to_left = false;         // Texts begin at the right.
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
  bool markers = false;  // Where sounds are, for authors.
  std::string caption;   // Of the sounds that play, near the bottom; empty for none.
};

// All inputs of one output image. The video, pose and content always belong to the same frame.
struct View {
  const engine::TrackedFrame* tracked = nullptr;  // Image, pose and map; null: a dark background.
  const engine::CameraModel* camera = nullptr;    // The lens of the image; null: no content is drawn.
  const content::Scene* scene = nullptr;          // Null when there is no content.
  // Where the camera was a moment ago. If the frame has no pose, the content is drawn from there. Null for
  // none.
  const engine::Rigid3* held_camera_from_map = nullptr;
  // Surfaces of the map of the scene that hide content behind them; null: none do.
  std::shared_ptr<const engine::SurfaceMesh> surfaces;
  // The light in the map of the scene; null where it is not known.
  const engine::LightEstimate* light = nullptr;
  bool shadows = true;           // Models and signposts cast them on the room.
  bool follows_exposure = true;  // Models are as bright as the video is exposed.
  // Whether the occluders of the scene hide content behind them. Surfaces that they stand for then do not.
  bool occluders = true;
  // Names of hidden entities that are drawn all the same, faintly, because an author has selected them.
  std::span<const std::string> faint = {};
  double animation_seconds = 0;  // Time of the animations of the models, which repeat.
  Overlay overlay;               // What is drawn on top.
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

  // Draws into the internal framebuffer at the size of the camera's image.
  void Draw(const View& view);
  // Shows the last drawn image in the default framebuffer, letterboxed to width_px x height_px.
  void Present(int width_px, int height_px);
  // Shows the last drawn image in a part of the default framebuffer, letterboxed, and over it the view's
  // heads-up display at the window's resolution, whatever that of the camera is; the image should have been
  // drawn without it. `unit_px` is the size of the texts: normal ones have 15 units. The sentences at the
  // bottom leave bottom_px free.
  void PresentWithHeadsUp(const View& view, const WindowPart& part, double unit_px, double bottom_px);
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
