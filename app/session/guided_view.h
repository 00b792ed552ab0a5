// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "app/session/session.h"
#include "app/session/visitor_strings.h"
#include "app/session/way_on.h"
#include "ui/recorder.h"
#include "ui/renderer.h"

// Converts what a session knows about a frame into the image that a user sees.
namespace docent::app {

// A tracked frame with its content. The window's thread draws it while the camera's thread continues.
struct ShownFrame {
  engine::TrackedFrame tracked;
  Session::Shown shown;
  double seconds = 0;  // since the first image
  // Larger the later it was made, also where the image is the same; 0 where that does not matter.
  std::uint64_t serial = 0;
  // Capture time on CLOCK_MONOTONIC; empty where it is unknown (see FrameLoopOptions::latency).
  std::optional<Timestamp> taken = {};
  std::string message;  // one sentence, often empty
  std::string caption;  // of the sounds that play; often empty
  // Only on a tour; see VisitState.
  std::optional<ui::VisitorDisplay> visitor = {};
  // Only on a tour: how many visitors of this camera came before, as far as that was noticed.
  int visitors_before = 0;
  // Only on a tour: the way on that `visitor` shows, if there is one.
  std::optional<ShownWay> way = {};
  // If a visitor was lost a moment ago: the last pose before, whose content is in `shown`.
  std::optional<engine::Rigid3> held_camera_from_map = {};
  // Only on a tour: when the animations of models have begun (ApproachWatch).
  std::shared_ptr<const std::map<std::string, double>> animation_starts = {};
  // The current camera model of a camera whose calibration is estimated; else null.
  std::shared_ptr<const engine::CameraModel> camera = nullptr;
};

// Lets a frame show another image of its camera, which has no pose, and so no content, but everything that is
// said.
void ShowWithoutPose(const engine::Frame& image, ShownFrame* frame);

// The input of the renderer; it points into `frame` and `camera`.
ui::View ViewOf(const ShownFrame& frame, const engine::CameraModel& camera);

// Adds to a view the image, the content and the place of the other camera, whose newest frame and lens these
// are. The view points into them.
void AddOther(const ShownFrame& other, const engine::CameraModel& camera, const VisitorStrings& strings,
              ui::View* view);

// Records the drawn frames as a video with the speed of the camera: frames that were not drawn (dropped, or
// replaced by a newer one before the window drew them) repeat the previous one. One thread.
class ViewRecorder {
 public:
  ViewRecorder(const std::filesystem::path& path, double frames_per_second)
      : recorder_(path.string(), frames_per_second) {}

  // The image of frame `index`; indices ascend.
  void Write(const cv::Mat& image, std::uint64_t index);
  // Throws Error when the file is incomplete.
  void Close() { recorder_.Close(); }

 private:
  ui::Recorder recorder_;
  std::optional<std::uint64_t> last_index_;
};

}  // namespace docent::app
