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

// The built-in simulator: textured worlds seen by a hand-held camera with a distorting lens, with exact
// ground truth and optional camera faults. World frame: x right, y down, z forward, metres. Camera frame: x
// right, y down, z forward.
namespace docent::app {

struct SimulationOptions {
  std::optional<engine::CameraModel> camera;  // Empty: that of the scene, or SimulatedCamera().
  // Horizontal field of view of a lens without distortion that replaces the scene's lens; 0: the scene's
  // lens.
  double field_of_view_deg = 0;
  double frame_rate_hz = 30;
  double duration_s = 0;  // Maximum duration; 0: the whole trajectory of the scene.
  // At most the time between two frames; not used without motion blur. The timestamp of an image is the
  // middle of its exposure.
  double exposure_s = 1.0 / 60;
  int blur_samples = 1;          // Renderings averaged over the exposure; 1: no motion blur.
  double noise_sigma = 1.5;      // Of each channel, grey levels of 255; typical for a webcam indoors.
  double exposure_drift = 0.04;  // Amplitude of the slow drift of the logarithm of the gain.
  double vignetting = 0.1;       // Ratio of the light lost in the corners, in [0, 1).
  bool identical_places =
      false;  // All places of `museum` and `desks` have the same content, so they cannot be distinguished.
  // Seed of the walk through the places of `museum` and `desks` after they were built, which leaves the
  // places as they are; 0: the usual walk.
  std::uint64_t walk = 0;
  // Time at each place of `museum` and `desks` while it is built, at least the usual six seconds; and how
  // often all places are visited then.
  double build_s = 0;
  int rounds = 1;
  // At this time of the sequence the person rests for this long: the camera stays where it is, and its lens
  // is covered.
  double rest_at_s = 0, rest_s = 0;
  CameraFaults faults;
  std::uint64_t seed = 1;

  // Describes the first invalid option in one sentence, or empty.
  std::optional<std::string> Validate() const;
  // Options without noise, drift, vignetting and faults: images show the incident light.
  static SimulationOptions Clean();
};

// A wide-angle camera of 640 x 480 pixels (horizontal field of view 77 degrees) with radial and tangential
// distortion; width_px scales it to other sizes with the same aspect ratio.
engine::CameraModel SimulatedCamera(int width_px = 640);

// One simulated sequence. Immutable; all members may be called from any thread.
class Simulation {
 public:
  // The options must be valid (MakeSimulation checks them).
  Simulation(const std::string& name, Scene scene, const SimulationOptions& options);
  Simulation(const Simulation&) = delete;
  Simulation& operator=(const Simulation&) = delete;

  const std::string& name() const { return name_; }
  // The name without number and options, for instance "museum".
  std::string_view scene_name() const { return std::string_view(name_).substr(0, name_.find_first_of(":,")); }
  // The true lens.
  const engine::CameraModel& camera() const { return camera_; }
  // The calibration delivered with the sequence: the true lens with the errors of CameraFaults.
  const engine::CameraModel& calibration() const { return calibration_; }
  const SimulationOptions& options() const { return options_; }
  std::span<const SimulatedPlace> places() const { return scene_.places; }

  // Frames are numbered from 0; arguments must be in [0, frame_count). Lost frames
  // (CameraFaults::dropped_share) are not numbered and show as gaps in the timestamps.
  int frame_count() const { return static_cast<int>(exposures_.size()); }
  Timestamp time(int frame) const;
  engine::Rigid3 world_from_camera(int frame) const;
  const std::string& label(int frame) const;
  // Renders the image, CV_8UC3 in BGR; byte-identical for equal scene, options and number.
  void Render(int frame, cv::Mat* bgr) const { RenderRotated(frame, std::nullopt, bgr); }
  // Renders the image with the camera rotated on its mount, for pan-tilt heads; empty: not rotated.
  void RenderRotated(int frame, const std::optional<engine::Rigid3>& camera_from_rotated, cv::Mat* bgr) const;

  // Renders the view of a static camera from any pose: without motion blur and rolling shutter.
  void RenderFrom(const engine::Rigid3& world_from_camera, int frame, cv::Mat* bgr) const;

  // World point seen by a frame at a pixel, from the camera's pose when the pixel's row was exposed. Empty
  // when the lens has no ray for the pixel or the ray hits nothing.
  std::optional<Eigen::Vector3d> SurfaceAt(int frame, const Eigen::Vector2d& pixel) const;
  // World point seen at a pixel from any pose.
  std::optional<Eigen::Vector3d> SurfaceAlong(const engine::Rigid3& world_from_camera,
                                              const Eigen::Vector2d& pixel) const;
  // Whether a point on a surface is in the image of a frame and not occluded (within 1 cm).
  bool IsVisible(int frame, const Eigen::Vector3d& point_in_world) const;

 private:
  engine::Rigid3 PoseAt(double time_s) const;
  // The time of the trajectory, which stands still during the rest.
  double WalkedFor_s(double time_s) const;
  bool IsCovered(double time_s) const;
  // Time from a frame's timestamp to the exposure of a row; rows may be fractional.
  double RowOffset_s(double row) const;
  bool rows_differ() const { return options_.faults.readout_s > 0 || options_.faults.interlaced; }
  // Renders the incident light at a time, or row by row around it.
  void RenderLight(double time_s, const std::optional<engine::Rigid3>& camera_from_rotated,
                   cv::Mat* bgr) const;

  std::string name_;
  SimulationOptions options_;
  Scene scene_;
  engine::CameraModel camera_, calibration_;
  SurfaceRenderer renderer_;  // Refers to scene_.surfaces.
  double duration_s_;
  Sensor sensor_;
  Tremor tremor_;
  std::vector<int> exposures_;  // By frame: index among all exposures, including lost ones.
};

// Creates a simulation from a scene's name with an optional number after a colon and options after commas
// (named_options.h), which override those passed: "room", "museum:6", "room,rolling-shutter=20". Throws
// docent::Error with the list of scenes for an unknown one, or with the invalid number or option.
std::unique_ptr<Simulation> MakeSimulation(const std::string& scene_spec,
                                           const SimulationOptions& options = {});

// One line for each scene: name, number and meaning of the number.
std::string ListOfScenes();

}  // namespace docent::app
