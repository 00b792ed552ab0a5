// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <span>
#include <string>

#include "app/simulator/scene.h"
#include "app/simulator/sensor.h"
#include "app/simulator/surface_renderer.h"
#include "engine/base/time.h"
#include "engine/geometry/camera_model.h"
#include "engine/geometry/rigid3.h"

// The built-in simulator: painted worlds, seen by a hand-held camera through its real lens, with the truth
// known exactly. World frame x right, y down, z forward, metres; camera frame as everywhere (x right, y down,
// z forward).
namespace docent::app {

struct SimulationOptions {
  std::optional<engine::CameraModel> camera;  // empty: the scene's own, or SimulatedCamera()
  double frame_rate_hz = 30;
  double duration_s = 0;         // the most that is simulated; 0: the whole way of the scene
  double exposure_s = 1.0 / 60;  // the picture's time is the middle of the exposure
  int blur_samples = 1;  // pictures averaged over the exposure; 1: no motion blur. Costs as many renderings
  double noise_sigma = 1.5;      // of each channel, grey levels of 255; what a webcam shows indoors
  double exposure_drift = 0.04;  // wandering of the logarithm of the gain
  double vignetting = 0.1;       // part of the light lost in the corners, [0, 1)
  bool identical_places =
      false;  // the places of museum and desks hold the same things: nothing tells them apart
  std::uint64_t seed = 1;

  // A sentence that says what is wrong with these options, or empty.
  std::optional<std::string> Validate() const;
  // No noise, drift, or vignetting: the light as it falls on the sensor.
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
  const engine::CameraModel& camera() const { return camera_; }
  const SimulationOptions& options() const { return options_; }
  std::span<const SimulatedPlace> places() const { return scene_.places; }

  // Frames are numbered from 0; a number outside [0, frame_count) is a fault of the caller.
  int frame_count() const { return frame_count_; }
  Timestamp time(int frame) const;
  engine::Rigid3 world_from_camera(int frame) const;
  const std::string& label(int frame) const;
  // The picture, CV_8UC3 in BGR: the same bytes for the same scene, options, and number.
  void Render(int frame, cv::Mat* bgr) const;

  // What the camera would have taken from somewhere else, without motion blur.
  void RenderFrom(const engine::Rigid3& world_from_camera, int frame, cv::Mat* bgr) const;

  // The point of the world that a frame shows at a pixel. Empty where the lens has no ray, or the ray meets
  // nothing.
  std::optional<Eigen::Vector3d> SurfaceAt(int frame, const Eigen::Vector2d& pixel) const;
  // The same for any pose: for checks from viewpoints that no frame has.
  std::optional<Eigen::Vector3d> SurfaceAlong(const engine::Rigid3& world_from_camera,
                                              const Eigen::Vector2d& pixel) const;
  // Whether a point on a surface is in a frame's picture and nothing stands before it (to within a
  // centimetre).
  bool IsVisible(int frame, const Eigen::Vector3d& point_in_world) const;

 private:
  engine::Rigid3 PoseAt(double time_s) const;

  std::string name_;
  SimulationOptions options_;
  Scene scene_;
  engine::CameraModel camera_;
  SurfaceRenderer renderer_;  // refers to scene_.surfaces
  Sensor sensor_;
  int frame_count_;
};

// A scene by its name, with a number after a colon where it takes one: "room", "museum:6", "cylinder:10".
// Throws docent::Error with the list of scenes for an unknown one, or with what is wrong with number or
// options.
std::unique_ptr<Simulation> MakeSimulation(const std::string& scene_spec,
                                           const SimulationOptions& options = {});

// One line a scene: name, number, what it means.
std::string ListOfScenes();

}  // namespace docent::app
