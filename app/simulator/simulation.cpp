// SPDX-License-Identifier: Apache-2.0
#include "app/simulator/simulation.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>
#include <sstream>
#include <utility>

#include "app/simulator/calibration_error.h"
#include "app/simulator/frame_drops.h"
#include "app/simulator/named_options.h"
#include "engine/base/error.h"

namespace docent::app {
namespace {

constexpr int kLargestSide_px = 8192;
constexpr double kLongestDuration_s = 86400;

// Parts of a camera that have independent random numbers.
enum class SeedOf : std::uint64_t { kSensor, kExposureJumps, kFrameDrops, kTremor };

std::uint64_t MixedSeed(const SimulationOptions& options, const Scene& scene, SeedOf part) {
  return options.seed + 0x9E3779B97F4A7C15ull * scene.sensor_number +
         0xBF58476D1CE4E5B9ull * static_cast<std::uint64_t>(part);
}

double DurationOf(const Scene& scene, const SimulationOptions& options) {
  const double walk_s = scene.trajectory.duration_s();
  const double whole_s = walk_s + (options.rest_at_s < walk_s ? options.rest_s : 0);
  return options.duration_s > 0 ? std::min(whole_s, options.duration_s) : whole_s;
}

Sensor::Options SensorOf(const Scene& scene, const SimulationOptions& options, cv::Size size) {
  Sensor::Options sensor;
  sensor.size = size;
  sensor.vignetting = options.vignetting;
  sensor.exposure_drift = options.exposure_drift;
  sensor.noise_sigma = options.noise_sigma;
  sensor.seed = MixedSeed(options, scene, SeedOf::kSensor);
  sensor.gain = scene.sensor_gain * options.faults.gain;
  sensor.gain_noise_sigma = options.faults.gain_noise_sigma;
  sensor.exposure_jumps = ExposureJumps(options.faults.exposure_jump_stops, DurationOf(scene, options),
                                        MixedSeed(options, scene, SeedOf::kExposureJumps));
  return sensor;
}

engine::CameraModel CameraOf(const Scene& scene, const SimulationOptions& options) {
  if (options.camera) return *options.camera;
  const engine::CameraModel own = scene.camera ? *scene.camera : SimulatedCamera();
  if (options.field_of_view_deg <= 0) return own;
  engine::CameraModel::Intrinsics intrinsics = own.intrinsics();
  const double half = 0.5 * options.field_of_view_deg * std::numbers::pi / 180;
  intrinsics.fx = intrinsics.fy = 0.5 * intrinsics.width_px / std::tan(half);
  return {engine::LensModel::kRadialTangential, intrinsics, {}};
}

const SceneRecipe& RecipeOf(const std::string& name) {
  for (const SceneRecipe& recipe : SceneRecipes()) {
    if (recipe.name == name) return recipe;
  }
  throw Error("There is no simulated scene \"" + name + "\"; the available scenes are:\n" + ListOfScenes());
}

int ParameterOf(const SceneRecipe& recipe, const std::string& spec, const std::string& text) {
  int value = 0;
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc() || stop != end || value < recipe.lowest_parameter ||
      value > recipe.highest_parameter) {
    std::ostringstream message;
    message << "The simulated scene \"" << spec << "\" needs a whole number from " << recipe.lowest_parameter
            << " to " << recipe.highest_parameter << " after the colon: " << recipe.parameter_meaning << ".";
    throw Error(message.str());
  }
  return value;
}

}  // namespace

std::optional<std::string> SimulationOptions::Validate() const {
  // The conditions are negated, so that NaN is rejected too.
  if (!(frame_rate_hz > 0 && frame_rate_hz <= 1000))
    return "The frame rate must be above 0 and at most 1000 Hz.";
  if (!(duration_s >= 0 && duration_s <= kLongestDuration_s))
    return "The duration must be from 0 s to one day.";
  // Without motion blur, the exposure time is not used.
  if (!(exposure_s >= 0 && (blur_samples == 1 || exposure_s * frame_rate_hz <= 1))) {
    return "The exposure time must be from 0 s to the time between two frames.";
  }
  if (blur_samples < 1 || blur_samples > 64) return "The number of motion blur samples must be from 1 to 64.";
  if (!(noise_sigma >= 0 && noise_sigma <= 100)) return "The noise must be from 0 to 100 grey levels.";
  if (!(exposure_drift >= 0 && exposure_drift <= 1)) return "The exposure drift must be from 0 to 1.";
  if (!(vignetting >= 0 && vignetting < 1)) return "The vignetting must be at least 0 and below 1.";
  if (camera && (camera->width_px() > kLargestSide_px || camera->height_px() > kLargestSide_px)) {
    return "The image must have at most 8192 pixels along each side.";
  }
  if (!(rest_at_s >= 0 && rest_at_s <= kLongestDuration_s && rest_s >= 0 && rest_s <= kLongestDuration_s))
    return "The rest and the time until it must be from 0 s to one day.";
  if (!(build_s >= 0 && build_s <= 3600))
    return "The time at a place while it is built must be from 0 s to an hour.";
  if (rounds < 1 || rounds > 1000) return "The number of rounds must be from 1 to 1000.";
  return faults.Validate(frame_rate_hz);
}

SimulationOptions SimulationOptions::Clean() {
  SimulationOptions options;
  options.noise_sigma = options.exposure_drift = options.vignetting = 0;
  return options;
}

engine::CameraModel SimulatedCamera(int width_px) {
  const double scale = width_px / 640.0;
  engine::CameraModel::Intrinsics intrinsics;
  intrinsics.width_px = width_px;
  intrinsics.height_px = static_cast<int>(std::lround(480 * scale));
  intrinsics.fx = 402.0 * scale;
  intrinsics.fy = 403.2 * scale;
  // The centre of the top-left pixel is (0, 0), so scaling is about that pixel's outer corner.
  intrinsics.cx = (317.6 + 0.5) * scale - 0.5;
  intrinsics.cy = (241.3 + 0.5) * scale - 0.5;
  return {engine::LensModel::kRadialTangential, intrinsics, {-0.105, 0.012, 0.0005, -0.0004, 0}};
}

Simulation::Simulation(const std::string& name, Scene scene, const SimulationOptions& options)
    : name_(name),
      options_(options),
      scene_(std::move(scene)),
      camera_(CameraOf(scene_, options)),
      calibration_(WrongCalibration(camera_, options.faults.focal_error, options.faults.distortion_error_px)),
      renderer_(&scene_.surfaces, camera_),
      duration_s_(DurationOf(scene_, options)),
      sensor_(SensorOf(scene_, options, {camera_.width_px(), camera_.height_px()})),
      tremor_(options.faults.tremor_deg, MixedSeed(options, scene_, SeedOf::kTremor)) {
  // The tolerance keeps the last frame despite rounding of the product.
  const int count = static_cast<int>(std::floor(duration_s_ * options.frame_rate_hz + 1e-6)) + 1;
  exposures_ =
      KeptFrames(count, options.faults.dropped_share, MixedSeed(options, scene_, SeedOf::kFrameDrops));
}

Timestamp Simulation::time(int frame) const {
  return FromSeconds(exposures_[static_cast<std::size_t>(frame)] / options_.frame_rate_hz);
}

engine::Rigid3 Simulation::PoseAt(double time_s) const {
  const engine::Rigid3 steady =
      scene_.trajectory.WorldFromCamera(WalkedFor_s(time_s)) * scene_.carrier_from_camera;
  return tremor_.is_still() ? steady : steady * tremor_.SteadyFromTrembling(time_s);
}

double Simulation::WalkedFor_s(double time_s) const {
  return time_s - std::clamp(time_s - options_.rest_at_s, 0.0, options_.rest_s);
}

bool Simulation::IsCovered(double time_s) const {
  return time_s >= options_.rest_at_s && time_s < options_.rest_at_s + options_.rest_s;
}

double Simulation::RowOffset_s(double row) const {
  const CameraFaults& faults = options_.faults;
  const double height = camera_.height_px();
  const bool is_odd = std::lround(row) % 2 != 0;
  const double field_s = faults.interlaced && is_odd ? 0.5 / options_.frame_rate_hz : 0;
  return faults.readout_s * ((row + 0.5) / height - 0.5) + field_s;
}

void Simulation::RenderLight(double time_s, const std::optional<engine::Rigid3>& camera_from_rotated,
                             cv::Mat* bgr) const {
  const auto pose_at = [&](double row_time_s) {
    const engine::Rigid3 pose = PoseAt(row_time_s);
    return (camera_from_rotated ? pose * *camera_from_rotated : pose).inverse();
  };
  if (!rows_differ()) {
    renderer_.Render(pose_at(time_s), bgr);
    return;
  }
  std::vector<engine::Rigid3> camera_from_world;
  for (int row = 0; row < camera_.height_px(); ++row) {
    camera_from_world.push_back(pose_at(time_s + RowOffset_s(row)));
  }
  renderer_.RenderRows(camera_from_world, bgr);
}

engine::Rigid3 Simulation::world_from_camera(int frame) const {
  return PoseAt(ToSeconds(time(frame)));
}

const std::string& Simulation::label(int frame) const {
  return scene_.trajectory.LabelAt(WalkedFor_s(ToSeconds(time(frame))));
}

void Simulation::RenderRotated(int frame, const std::optional<engine::Rigid3>& camera_from_rotated,
                               cv::Mat* bgr) const {
  const double time_s = ToSeconds(time(frame));
  if (IsCovered(time_s)) {
    *bgr = cv::Mat::zeros(camera_.height_px(), camera_.width_px(), CV_8UC3);
  } else if (options_.blur_samples == 1) {
    RenderLight(time_s, camera_from_rotated, bgr);
  } else {
    const int samples = options_.blur_samples;
    cv::Mat sum, sample, wide;
    for (int i = 0; i < samples; ++i) {
      const double offset_s = options_.exposure_s * ((i + 0.5) / samples - 0.5);
      RenderLight(time_s + offset_s, camera_from_rotated, &sample);
      sample.convertTo(wide, CV_16UC3);
      if (i == 0) {
        sum = wide.clone();
      } else {
        sum += wide;
      }
    }
    sum.convertTo(*bgr, CV_8UC3, 1.0 / samples);
  }
  sensor_.Apply(exposures_[static_cast<std::size_t>(frame)], time_s, bgr);
}

void Simulation::RenderFrom(const engine::Rigid3& world_from_camera, int frame, cv::Mat* bgr) const {
  renderer_.Render(world_from_camera.inverse(), bgr);
  sensor_.Apply(exposures_[static_cast<std::size_t>(frame)], ToSeconds(time(frame)), bgr);
}

std::optional<Eigen::Vector3d> Simulation::SurfaceAt(int frame, const Eigen::Vector2d& pixel) const {
  if (IsCovered(ToSeconds(time(frame)))) return std::nullopt;
  if (!rows_differ()) return SurfaceAlong(world_from_camera(frame), pixel);
  return SurfaceAlong(PoseAt(ToSeconds(time(frame)) + RowOffset_s(pixel.y())), pixel);
}

std::optional<Eigen::Vector3d> Simulation::SurfaceAlong(const engine::Rigid3& world_from_camera,
                                                        const Eigen::Vector2d& pixel) const {
  const std::optional<Eigen::Vector3d> ray = camera_.Unproject(pixel);
  if (!ray) return std::nullopt;
  const auto hit =
      scene_.surfaces.Intersect(world_from_camera.translation, world_from_camera.rotation * *ray);
  if (!hit) return std::nullopt;
  return hit->point;
}

bool Simulation::IsVisible(int frame, const Eigen::Vector3d& point_in_world) const {
  if (IsCovered(ToSeconds(time(frame)))) return false;
  const engine::Rigid3 pose = world_from_camera(frame);
  const std::optional<Eigen::Vector2d> pixel = camera_.Project(pose.inverse() * point_in_world);
  if (!pixel || !camera_.IsInside(*pixel)) return false;
  const Eigen::Vector3d offset = point_in_world - pose.translation;
  const auto hit = scene_.surfaces.Intersect(pose.translation, offset.normalized());
  return !hit || hit->distance > offset.norm() - 0.01;
}

std::unique_ptr<Simulation> MakeSimulation(const std::string& scene_spec, const SimulationOptions& defaults) {
  SimulationOptions options = defaults;
  const std::size_t comma = std::min(scene_spec.find(','), scene_spec.size());
  const std::string scene = scene_spec.substr(0, comma);
  const std::size_t colon = scene.find(':');
  const SceneRecipe& recipe = RecipeOf(scene.substr(0, colon));
  SceneRequest request;
  request.parameter = colon == std::string::npos ? recipe.default_parameter
                                                 : ParameterOf(recipe, scene, scene.substr(colon + 1));
  if (comma < scene_spec.size()) SetNamedOptions(std::string_view(scene_spec).substr(comma + 1), &options);
  if (const auto fault = options.Validate()) throw Error(*fault);
  request.seed = options.seed;
  request.identical_places = options.identical_places;
  request.walk = options.walk;
  request.build_s = options.build_s;
  request.rounds = options.rounds;
  return std::make_unique<Simulation>(scene_spec, recipe.build(request), options);
}

std::string ListOfScenes() {
  std::ostringstream list;
  for (const SceneRecipe& recipe : SceneRecipes()) {
    list << "  " << recipe.name;
    if (recipe.highest_parameter > recipe.lowest_parameter) {
      list << "[:N]  N from " << recipe.lowest_parameter << " to " << recipe.highest_parameter << " ("
           << recipe.default_parameter << " if not given): " << recipe.parameter_meaning;
    } else {
      list << "  " << recipe.parameter_meaning;
    }
    list << "\n";
  }
  return list.str();
}

}  // namespace docent::app
