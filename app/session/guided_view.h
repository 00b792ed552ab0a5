// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "app/session/session.h"
#include "ui/recorder.h"
#include "ui/renderer.h"

// From what a session says of a frame to the image that a person sees of it.
namespace docent::app {

// A tracked frame with what belongs to it: the window's thread draws it while the camera's goes on.
struct ShownFrame {
  engine::TrackedFrame tracked;
  Session::Shown shown;
  double seconds = 0;  // since the first image
  // When it was taken, on CLOCK_MONOTONIC; empty where nobody knows (see FrameLoopOptions::latency).
  std::optional<Timestamp> taken = {};
  std::string message;  // one sentence, often empty
};

// What the renderer is asked to draw; points into `frame` and `camera`.
ui::View ViewOf(const ShownFrame& frame, const engine::CameraModel& camera);

// Writes the drawn frames as a video that runs as fast as the images came: frames that were not drawn
// (dropped, or overtaken on their way to the window) repeat the one before. One thread.
class ViewRecorder {
 public:
  ViewRecorder(const std::filesystem::path& path, double frames_per_second)
      : recorder_(path.string(), frames_per_second) {}

  // The image of frame `index`; ascending.
  void Write(const cv::Mat& image, std::uint64_t index);
  // Throws Error when the file is not whole.
  void Close() { recorder_.Close(); }

 private:
  ui::Recorder recorder_;
  std::optional<std::uint64_t> last_index_;
};

}  // namespace docent::app
