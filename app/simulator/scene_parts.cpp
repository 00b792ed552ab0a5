// SPDX-License-Identifier: Apache-2.0
#include "app/simulator/scene_parts.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "app/simulator/paint.h"
#include "app/simulator/paint_basics.h"

namespace docent::app {
namespace {

constexpr double kWalkingSpeed = 1.5;   // m/s.
constexpr double kRotationSpeed = 1.9;  // rad/s.
constexpr std::uint64_t kRoundSeed =
    0x9E3779B97F4A7C15;  // Between the seeds of two rounds; 2^64 / golden ratio.

// Waypoints in a stand's frame: x, height above the floor and z of the camera (metres), x of the target
// (metres), and seconds since the previous waypoint.
struct Step {
  double x, height, z, target_x, seconds;
};

void Walk(const Stand& stand, const Viewing& viewing, const std::vector<Step>& steps, Scene* scene) {
  for (const Step& step : steps) {
    scene->trajectory.LookFrom(stand.Point({step.x, -step.height, step.z}),
                               stand.Point({step.target_x, -viewing.target_height, viewing.target_ahead}),
                               step.seconds);
  }
}

// Moves the camera to the start of the next walk at the speed of a person.
void Travel(const Stand& stand, const Viewing& viewing, const Step& start, Scene* scene) {
  Trajectory& trajectory = scene->trajectory;
  trajectory.BeginSegment("travel");
  const Eigen::Vector3d goal = stand.Point({start.x, -start.height, start.z});
  const Eigen::Vector3d gaze =
      stand.Point({start.target_x, -viewing.target_height, viewing.target_ahead}) - goal;
  const double rotation =
      std::remainder(std::atan2(gaze.x(), gaze.z()) - trajectory.last_yaw_rad(), 2 * std::numbers::pi);
  // A cubic that starts and ends at rest reaches 1.5 times its mean speed.
  const double seconds = std::max({1.5, 1.5 * (goal - trajectory.last_position()).norm() / kWalkingSpeed,
                                   1.5 * std::abs(rotation) / kRotationSpeed});
  Walk(stand, viewing, {{start.x, start.height, start.z, start.target_x, seconds}}, scene);
}

// Moves the camera from one random viewpoint of a place to the next until the trajectory lasts to `end_s`.
void Linger(const Stand& stand, const Viewing& viewing, double end_s, std::uint64_t seed, Scene* scene) {
  Random random(seed);
  const auto jitter = [&](double reach) { return random.Uniform(-reach, reach); };
  while (scene->trajectory.duration_s() < end_s) {
    const double height = viewing.eye_height + jitter(0.12);
    const double z = random.Uniform(std::min(viewing.nearest, viewing.farthest),
                                    std::max(viewing.nearest, viewing.farthest));
    Walk(stand, viewing, {{jitter(viewing.swing), height, z, jitter(0.15), random.Uniform(1.2, 4)}}, scene);
  }
}

}  // namespace

Eigen::Vector3d Stand::Direction(const Eigen::Vector3d& direction) const {
  return Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitY()) * direction;
}

void HangPainting(const Stand& stand, const Eigen::Vector3d& center, double width, double height, int texture,
                  Scene* scene) {
  scene->surfaces.AddRectangle(stand.Point(center - Eigen::Vector3d(width / 2, height / 2, 0)),
                               stand.Direction({width, 0, 0}), stand.Direction({0, height, 0}), texture);
}

void AddClutter(const Stand& stand, const Eigen::Vector3d& center, double width, double depth, int count,
                double tallest, Random* random, Scene* scene) {
  struct Footprint {
    Eigen::Vector2d middle;
    double radius;
  };
  std::vector<Footprint> taken;
  for (int i = 0; i < count; ++i) {
    const std::uint32_t kind = random->Below(5);
    const double height = tallest * random->Uniform(0.3, 1.0), side = tallest * random->Uniform(0.3, 0.6);
    const double thickness = kind == 0 ? side * 0.3 : side * random->Uniform(0.6, 1.2);
    const double radius = kind == 4 ? side * 0.4 : 0.5 * std::hypot(side, thickness);
    const double yaw = random->Uniform(-0.6, 0.6);
    const std::uint64_t texture_seed = random->Next();
    std::optional<Eigen::Vector2d> spot;
    for (int attempt = 0; attempt < 80 && !spot; ++attempt) {
      const Eigen::Vector2d middle(random->Uniform(-0.5, 0.5) * std::max(0.0, width - 2 * radius),
                                   random->Uniform(-0.5, 0.5) * std::max(0.0, depth - 2 * radius));
      const bool is_free = std::none_of(taken.begin(), taken.end(), [&](const Footprint& other) {
        return (other.middle - middle).norm() < other.radius + radius;
      });
      if (is_free) spot = middle;
    }
    if (!spot) continue;
    taken.push_back({*spot, radius});
    const Eigen::Vector3d base = stand.Point(center + Eigen::Vector3d(spot->x(), 0, spot->y()));
    Surfaces& surfaces = scene->surfaces;
    if (kind == 4) {
      surfaces.AddColumn(base, side * 0.4, height, 10,
                         surfaces.AddTexture(PaintCollage({256, 128}, texture_seed)));
    } else {
      const cv::Mat wrapping =
          kind == 3 ? PaintPainting({512, 256}, texture_seed) : PaintPackage({512, 256}, texture_seed);
      surfaces.AddBox(base, side, height, thickness, stand.yaw_rad + yaw, surfaces.AddTexture(wrapping));
    }
  }
}

void AddHall(const Hall& hall, Scene* scene) {
  Surfaces& surfaces = scene->surfaces;
  const Eigen::Vector3d size = hall.high - hall.low;
  const double width = size.x(), depth = size.z(), height = std::abs(size.y());
  const double top = -height, left = hall.low.x(), right = hall.high.x(), near = hall.low.z(),
               far = hall.high.z();
  const TextureWindow floor{0, 0, width / hall.floor_pitch, depth / hall.floor_pitch};
  surfaces.AddRectangle({left, 0, far}, {width, 0, 0}, {0, 0, -depth}, hall.floor, floor).light_v = 0.05f;
  surfaces.AddRectangle({left, top, near}, {width, 0, 0}, {0, 0, depth}, hall.ceiling, floor).light = 0.8f;
  const auto wall = [&](const Eigen::Vector3d& corner, const Eigen::Vector3d& along, float light) {
    Rectangle& added =
        surfaces.AddRectangle(corner, along, {0, height, 0}, hall.walls,
                              {0, 0, along.norm() / hall.wall_pitch, height / hall.wall_pitch});
    added.light = light;
    added.light_v = -0.08f;
  };
  wall({left, top, far}, {width, 0, 0}, 1.0f);
  wall({right, top, far}, {0, 0, -depth}, 0.9f);
  wall({right, top, near}, {-width, 0, 0}, 0.95f);
  wall({left, top, near}, {0, 0, depth}, 0.85f);
}

void TourPlaces(const std::vector<Stand>& stands, const Viewing& viewing, const SceneRequest& request,
                Random* random, Scene* scene) {
  Trajectory& trajectory = scene->trajectory;
  const int count = static_cast<int>(stands.size());
  const auto jitter = [&](double reach) { return random->Uniform(-reach, reach); };
  const double swing = viewing.swing, eye = viewing.eye_height, near = viewing.nearest,
               far = viewing.farthest;
  for (int k = 0; k < count; ++k) {
    const double middle = 0.5 * (near + far);
    const std::vector<Step> steps = {
        {-swing + jitter(0.04), eye + jitter(0.04), middle, -0.05, 0},
        {0.0, eye + jitter(0.04), middle + jitter(0.05), 0.0, 2.0},
        {swing + jitter(0.08), eye + jitter(0.08), far + jitter(0.08), 0.1 + jitter(0.1), 1.4},
        {0.4 * swing + jitter(0.1), eye - 0.12 + jitter(0.06), near + jitter(0.06), jitter(0.15), 1.2},
        {-0.8 * swing + jitter(0.1), eye + 0.05 + jitter(0.06), middle + jitter(0.1), -0.1 + jitter(0.1),
         1.4},
    };
    if (k == 0) {
      trajectory.BeginSegment("build0");
      Walk(stands[k], viewing, {steps[0]}, scene);
    } else {
      Travel(stands[k], viewing, steps[0], scene);
      trajectory.BeginSegment("build" + std::to_string(k));
    }
    const double end_s = trajectory.duration_s() + request.build_s;
    Walk(stands[k], viewing, {steps.begin() + 1, steps.end()}, scene);
    Linger(stands[k], viewing, end_s, request.seed + static_cast<std::uint64_t>(k), scene);
  }
  // The visits alternate between places of the second and the first half.
  std::vector<int> order;
  for (int k = 0; k < count / 2; ++k) {
    order.push_back(count / 2 + k);
    order.push_back(k);
  }
  if (count % 2 == 1) order.push_back(count - 1);
  for (int round = 0; round < request.rounds; ++round) {
    const bool usual = request.walk == 0 && round == 0;
    Random own(request.walk + kRoundSeed * static_cast<std::uint64_t>(round));
    if (!usual) {
      random = &own;
      for (std::size_t i = order.size(); i > 1; --i)
        std::swap(order[i - 1], order[own.Below(static_cast<std::uint32_t>(i))]);
    }
    for (const int k : order) {
      // A visitor hurries or lingers.
      const double pace = usual ? 1 : own.Uniform(0.8, 3);
      const double middle = 0.5 * (near + far) + jitter(0.1);
      const std::vector<Step> steps = {
          {0.7 * swing + jitter(0.1), eye + jitter(0.06), middle, jitter(0.1), 0},
          {0.1 * swing + jitter(0.1), eye + jitter(0.08), middle + jitter(0.1), jitter(0.1), 1.3 * pace},
          {-0.5 * swing + jitter(0.1), eye + jitter(0.08), middle + jitter(0.1), jitter(0.1), 1.3 * pace}};
      Travel(stands[k], viewing, steps[0], scene);
      trajectory.BeginSegment("visit" + std::to_string(k));
      Walk(stands[k], viewing, {steps.begin() + 1, steps.end()}, scene);
    }
  }
}

}  // namespace docent::app
