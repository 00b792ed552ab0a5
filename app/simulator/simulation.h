// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "app/simulator/camera_faults.h"
#include "app/simulator/scene.h"
#include "app/simulator/sensor.h"
#include "app/simulator/surface_renderer.h"
#include "app/simulator/tremor.h"
#include "engine/base/time.h"
#include "engine/geometry/camera_model.h"
#include "engine/geometry/rigid3.h"

// The built-in simulator: painted worlds, seen by a hand-held camera through its real lens, with the truth
// known exactly; on request with the faults that real cameras have. World frame x right, y down, z forward,
// metres; camera frame as everywhere (x right, y down, z forward).
namespace docent::app {

struct SimulationOptions {
  std::optional<engine::CameraModel> camera;  // empty: the scene's own, or SimulatedCamera()
  double frame_rate_hz = 30;
  double duration_s = 0;         // the most that is simulated; 0: the whole way of the scene
  double exposure_s = 1.0 / 60;  // the image's time is the middle of the exposure
  int blur_samples = 1;      // images averaged over the exposure; 1: no motion blur. Costs as many renderings
  double noise_sigma = 1.5;  // of each channel, grey levels of 255; what a webcam shows indoors
  double exposure_drift = 0.04;  // wandering of the logarithm of the gain
  double vignetting = 0.1;       // part of the light lost in the corners, [0, 1)
  bool identical_places =
      false;  // the places of museum and desks hold the same things: nothing tells them apart
  CameraFaults faults;
  std::uint64_t seed = 1;

  // A sentence that says what is wrong with these options, or empty.
  std::optional<std::string> Validate() const;
  // No noise, drift, vignetting, or faults: the light as it falls on the sensor.
  static SimulationOptions Clean();
};

// A wide camera of 640 x 480 pixels (77 degrees across) with radial and tangential distortion; width_px
// scales it to other sizes of the same shape.
engine::CameraModel SimulatedCamera(int width_px = 640);

// One simulated sequence. Immutable; all members may be called from any thread.
class Simulation {
 public:
  // The scene's own options have been checked (MakeSimulation does).
  Simulation(const std::string& name, Scene scene, const SimulationOptions& options);
  Simulation(const Simulation&) = delete;
  Simulation& operator=(const Simulation&) = delete;

  const std::string& name() const { return name_; }
  // The name without its number and options: "museum".
  std::string_view scene_name() const { return std::string_view(name_).substr(0, name_.find_first_of(":,")); }
  // The lens as it is.
  const engine::CameraModel& camera() const { return camera_; }
  // The lens as the calibration that comes with the sequence describes it: wrong by CameraFaults' errors.
  const engine::CameraModel& calibration() const { return calibration_; }
  const SimulationOptions& options() const { return options_; }
  std::span<const SimulatedPlace> places() const { return scene_.places; }

  // Frames are numbered from 0; a number outside [0, frame_count) is a fault of the caller. Frames that are
  // lost on the way (CameraFaults::dropped_share) have no number: times jump over them.
  int frame_count() const { return static_cast<int>(exposures_.size()); }
  Timestamp time(int frame) const;
  engine::Rigid3 world_from_camera(int frame) const;
  const std::string& label(int frame) const;
  // The image, CV_8UC3 in BGR: the same bytes for the same scene, options, and number.
  void Render(int frame, cv::Mat* bgr) const { RenderTurned(frame, std::nullopt, bgr); }
  // The same when the camera is turned on its mount, if it is.
  void RenderTurned(int frame, const std::optional<engine::Rigid3>& camera_from_turned, cv::Mat* bgr) const;

  // What the camera would have taken from somewhere else if it had stood still: without motion blur, and all
  // rows at once.
  void RenderFrom(const engine::Rigid3& world_from_camera, int frame, cv::Mat* bgr) const;

  // The point of the world that a frame shows at a pixel, seen from where the camera was when the pixel's row
  // was exposed. Empty where the lens has no ray, or the ray meets nothing.
  std::optional<Eigen::Vector3d> SurfaceAt(int frame, const Eigen::Vector2d& pixel) const;
  // The same for any pose: for checks from viewpoints that no frame has.
  std::optional<Eigen::Vector3d> SurfaceAlong(const engine::Rigid3& world_from_camera,
                                              const Eigen::Vector2d& pixel) const;
  // Whether a point on a surface is in view from a frame's pose, and nothing stands before it (to within a
  // centimetre).
  bool IsVisible(int frame, const Eigen::Vector3d& point_in_world) const;

 private:
  engine::Rigid3 PoseAt(double time_s) const;
  // How long after a frame's time a row is exposed; rows may be fractional.
  double RowOffset_s(double row) const;
  bool rows_differ() const { return options_.faults.readout_s > 0 || options_.faults.interlaced; }
  // The light that falls on the sensor at a time, or row by row after it.
  void RenderLight(double time_s, const std::optional<engine::Rigid3>& camera_from_turned,
                   cv::Mat* bgr) const;

  std::string name_;
  SimulationOptions options_;
  Scene scene_;
  engine::CameraModel camera_, calibration_;
  SurfaceRenderer renderer_;  // refers to scene_.surfaces
  double duration_s_;
  Sensor sensor_;
  Tremor tremor_;
  std::vector<int> exposures_;  // by frame: its number among all exposures, lost ones too
};

// A scene by its name, with a number after a colon where it takes one, and options after commas
// (named_options.h), which go before those that are passed: "room", "museum:6", "room,rolling-shutter=20".
// Throws docent::Error with the list of scenes for an unknown one, or with what is wrong with number or
// options.
std::unique_ptr<Simulation> MakeSimulation(const std::string& scene_spec,
                                           const SimulationOptions& options = {});

// One line a scene: name, number, what it means.
std::string ListOfScenes();

}  // namespace docent::app
