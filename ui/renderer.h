// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "content/scene.h"
#include "engine/geometry/camera_model.h"
#include "engine/tracking/tracked_frame.h"

namespace docent::ui {

// What to show besides the video and the content.
struct Overlay {
  bool points = false;     // map points as found in the image, coloured by level
  bool keyframes = false;  // keyframes of the map as small frusta
  bool hud = true;         // state, map name, hint; the lost indicator while there is no pose
  bool status = true;      // of the hud: the state; false where nothing is tracked
  std::string map_name;    // empty when there is none
  std::string mapping;     // how far the map here has come, in a word; empty when nobody builds it
  std::string message;     // one sentence at the bottom, empty for none
  // The newest frame of another camera, shown small in a corner (see inset.h) in a frame whose colour is its
  // state; null for none. May be of any size.
  const engine::TrackedFrame* inset = nullptr;
};

// Everything of one image: video, pose and content always belong to the same frame.
struct View {
  const engine::TrackedFrame* tracked = nullptr;
  const engine::CameraModel* camera = nullptr;
  const content::Scene* scene = nullptr;  // null: nothing to draw
  double animation_seconds = 0;
  Overlay overlay;
};

struct RendererOptions {
  int samples = 4;            // of each pixel of the content (multisampling); 1 is fastest and jagged
  int max_texture_px = 2048;  // longest side of a model's images on the graphics card
};

// Draws a View with OpenGL 3.3 core into the current context's framebuffer, and reads it back on demand.
// Needs a current context (see context.h) from construction to destruction, on one thread.
class Renderer {
 public:
  // Throws docent::Error when the driver refuses a shader or a framebuffer.
  explicit Renderer(const RendererOptions& options = {});
  ~Renderer();
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  // Draws into an internal framebuffer of the size of the camera's image.
  void Draw(const View& view);
  // Shows the last drawn image in the default framebuffer, letterboxed into width_px x height_px.
  void Present(int width_px, int height_px);
  // The last drawn image, CV_8UC3 (BGR). The memory is reused by the next call when *image fits.
  void ReadBack(cv::Mat* image);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace docent::ui
