// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <numbers>

#include "app/simulator/scene.h"
#include "app/simulator/scene_parts.h"

// A person with two cameras at the table of the furnished room: one in the hand, one on the shoulder (ptamm
// §4, Fig. 4 and 5). Both scenes show the same walk, so that a pair of sources simulates a wearable.
namespace docent::app {
namespace {

constexpr double kStep_s = 0.25, kBeginning_s = 5, kDuration_s = 24;

// Position of the person on an arc around the table, in radians from its middle.
double StandAt(double time_s) {
  return 0.42 * std::sin(kTau * time_s / 9);
}

// Horizontal target of a camera, in metres to the right at the table. At first both cameras see the same
// area. Then the hand camera looks to one side and the shoulder camera to the other, then the other way
// round, so that each camera comes to areas that only the other one has seen.
double LookRight(double time_s) {
  if (time_s < kBeginning_s) return 0;
  return 1.15 * std::sin(kTau * (time_s - kBeginning_s) / (kDuration_s - kBeginning_s));
}

Eigen::Vector3d OnArc(double angle, double radius, double height) {
  return {radius * std::sin(angle), -height, -radius * std::cos(angle)};
}

Trajectory HandTrajectory(std::uint64_t seed) {
  Trajectory trajectory(seed);
  trajectory.BeginSegment("general");
  for (int i = 0; i * kStep_s <= kDuration_s; ++i) {
    const double time_s = i * kStep_s;
    const Eigen::Vector3d eye =
        OnArc(StandAt(time_s) + 0.1 * std::sin(kTau * time_s / 3.7), 1.5 + 0.1 * std::sin(kTau * time_s / 5),
              1.3 + 0.08 * std::sin(kTau * time_s / 4.3));
    trajectory.LookFrom(eye, {LookRight(time_s), -0.85, 0.15}, i == 0 ? 0 : kStep_s);
  }
  return trajectory;
}

Trajectory ShoulderTrajectory(std::uint64_t seed) {
  Trajectory trajectory(seed);
  trajectory.BeginSegment("general");
  for (int i = 0; i * kStep_s <= kDuration_s; ++i) {
    const double time_s = i * kStep_s;
    trajectory.LookFrom(OnArc(StandAt(time_s) - 0.13, 1.75, 1.5), {-LookRight(time_s), -0.9, 0.3},
                        i == 0 ? 0 : kStep_s);
  }
  return trajectory;
}

// Both cameras have a horizontal field of view of 94 degrees, with different lens models.
engine::CameraModel HandCamera() {
  return {
      engine::LensModel::kRadialTangential, {640, 480, 358.0, 358.4, 318.7, 240.6}, {-0.18, 0.03, 0, 0, 0}};
}
engine::CameraModel ShoulderCamera() {
  return {engine::LensModel::kFov, {640, 480, 364.3, 364.3, 321.2, 238.3}, {0.95, 0, 0, 0, 0}};
}

enum class Place { kHand, kShoulder };

Scene BuildWearable(const SceneRequest& request, Place place) {
  Random random(request.seed);
  Scene scene;
  const std::uint64_t hand_seed = random.Next(), shoulder_seed = random.Next();
  FurnishRoom(&random, &scene);
  const bool is_hand = place == Place::kHand, is_rigid = request.parameter == 1;
  scene.trajectory = is_hand || is_rigid ? HandTrajectory(hand_seed) : ShoulderTrajectory(shoulder_seed);
  scene.camera = is_hand ? HandCamera() : ShoulderCamera();
  if (!is_hand) {
    if (is_rigid) scene.carrier_from_camera = WearableRig();
    // A different camera model with less light sensitivity.
    scene.sensor_gain = 0.8;
    scene.sensor_number = 1;
  }
  return scene;
}

}  // namespace

engine::Rigid3 WearableRig() {
  return {engine::Rotation3::Exp({0.06, -0.14, 0.02}), {-0.25, -0.12, -0.05}};
}

Scene BuildHand(const SceneRequest& request) {
  return BuildWearable(request, Place::kHand);
}
Scene BuildShoulder(const SceneRequest& request) {
  return BuildWearable(request, Place::kShoulder);
}
Scene BuildHead(const SceneRequest& request) {
  return BuildWearable({0, request.seed, request.identical_places}, Place::kShoulder);
}

}  // namespace docent::app
