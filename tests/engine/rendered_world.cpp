// SPDX-License-Identifier: Apache-2.0
#include "tests/engine/rendered_world.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "engine/base/random.h"
#include "engine/vision/features.h"
#include "tests/engine/geometry/test_math.h"

namespace docent::engine::testing_world {

namespace {

float SamplePaint(const cv::Mat& paint, float x, float y) {
  const int x0 = std::clamp(static_cast<int>(x), 0, paint.cols - 2);
  const int y0 = std::clamp(static_cast<int>(y), 0, paint.rows - 2);
  const float fx = x - static_cast<float>(x0), fy = y - static_cast<float>(y0);
  const float* top = paint.ptr<float>(y0) + x0;
  const float* bottom = paint.ptr<float>(y0 + 1) + x0;
  return (1 - fy) * (top[0] + fx * (top[1] - top[0])) + fy * (bottom[0] + fx * (bottom[1] - bottom[0]));
}

// A wall in the frame of one camera: three dot products give the wall coordinates that a ray d meets.
struct WallInCamera {
  Eigen::Vector3f normal, right, down;
  float distance;  // along the normal
  float right_offset, down_offset, half_width, half_height;
  const cv::Mat* paint;
};

std::vector<WallInCamera> WallsInCamera(const std::vector<Wall>& walls, const Rigid3& camera_from_world) {
  std::vector<WallInCamera> seen;
  for (const Wall& wall : walls) {
    const Eigen::Vector3d center = camera_from_world * wall.center;
    const Eigen::Vector3d right = camera_from_world.rotation * wall.right;
    const Eigen::Vector3d down = camera_from_world.rotation * wall.down;
    const Eigen::Vector3d normal = right.cross(down);
    seen.push_back({normal.cast<float>(), right.cast<float>(), down.cast<float>(),
                    static_cast<float>(normal.dot(center)), static_cast<float>(right.dot(center)),
                    static_cast<float>(down.dot(center)), static_cast<float>(wall.half_width),
                    static_cast<float>(wall.half_height), &wall.paint});
  }
  return seen;
}

float Grey(const std::vector<WallInCamera>& walls, const Eigen::Vector3f& ray) {
  float nearest = std::numeric_limits<float>::max(), best_x = 0, best_y = 0;
  const WallInCamera* best = nullptr;
  for (const WallInCamera& wall : walls) {
    const float along = wall.normal.dot(ray);
    if (std::abs(along) < 1e-6f) continue;
    const float distance = wall.distance / along;
    if (distance <= 1e-3f || distance >= nearest) continue;
    const float x = distance * wall.right.dot(ray) - wall.right_offset;
    const float y = distance * wall.down.dot(ray) - wall.down_offset;
    if (std::abs(x) > wall.half_width || std::abs(y) > wall.half_height) continue;
    nearest = distance;
    best = &wall;
    best_x = x;
    best_y = y;
  }
  if (!best) return 128;
  constexpr float kScale = static_cast<float>(1 / kTexelSize);
  return SamplePaint(*best->paint, (best_x + best->half_width) * kScale,
                     (best_y + best->half_height) * kScale);
}

constexpr int kRaysPerPixel = 4;

// The rays of every pixel, row by row. Those of the last camera are cached, because a test renders many
// images with one camera.
const std::vector<Eigen::Vector3f>& RaysOf(const CameraModel& camera) {
  static thread_local CameraModel last;
  static thread_local std::vector<Eigen::Vector3f> rays;
  if (!rays.empty() && last == camera) return rays;
  last = camera;
  rays.clear();
  for (int y = 0; y < camera.height_px(); ++y) {
    for (int x = 0; x < camera.width_px(); ++x) {
      for (int part = 0; part < kRaysPerPixel; ++part) {
        const auto ray = camera.Unproject({x - 0.25 + 0.5 * (part & 1), y - 0.25 + 0.5 * (part >> 1)});
        // The zero ray meets no wall, so that a pixel without a ray shows the background.
        rays.push_back(ray.value_or(Eigen::Vector3d::Zero()).cast<float>());
      }
    }
  }
  return rays;
}

// Whether one wall fills the neighbourhood of the pixel, so that a keypoint there lies on its texture and not
// at its edge.
bool IsAwayFromWallEdges(const RenderedWorld& world, const CameraModel& camera,
                         const Rigid3& camera_from_world, const Eigen::Vector2d& pixel, double radius_px,
                         std::size_t wall) {
  for (int i = 0; i < 8; ++i) {
    const double angle = i * kPi / 4;
    const auto hit = world.AtPixel(camera, camera_from_world,
                                   pixel + radius_px * Eigen::Vector2d(std::cos(angle), std::sin(angle)));
    if (!hit || hit->wall != wall) return false;
  }
  return true;
}

void Observe(const RenderedWorld& world, const CameraModel& camera, MapPointId id, Map* map) {
  const Map::PointRecord* record = map->FindPoint(id);
  const Eigen::Vector3d position = record->point.position();
  const std::uint8_t level = record->point.source_level;
  for (const auto& [keyframe, seen] : map->keyframes()) {
    const Rigid3& pose = seen.keyframe.camera_from_map;
    if (!world.Sees(camera, pose, position)) continue;
    map->AddObservation({keyframe, id, camera.Project(pose * position)->cast<float>(), level});
  }
}

}  // namespace

Wall PaintedWall(const Eigen::Vector3d& center, const Eigen::Vector3d& right, const Eigen::Vector3d& down,
                 double half_width, double half_height, std::uint64_t seed) {
  Random random(seed);
  Wall wall{center, right.normalized(), down.normalized(), half_width, half_height, {}};
  const int columns = static_cast<int>(2 * half_width / kTexelSize) + 2;
  const int rows = static_cast<int>(2 * half_height / kTexelSize) + 2;
  cv::Mat paint(rows, columns, CV_8UC1, cv::Scalar(random.Uniform(90, 160)));
  const int figures = static_cast<int>(160 * 4 * half_width * half_height);
  for (int i = 0; i < figures; ++i) {
    // One after the other, because compilers evaluate arguments in different orders, and the wall must be the
    // same.
    const auto y = static_cast<float>(random.Uniform(0, rows));
    const auto x = static_cast<float>(random.Uniform(0, columns));
    const cv::Point2f middle(x, y);
    const double size = 0.03 * std::pow(6.0, random.Uniform() * random.Uniform()) / kTexelSize;
    const cv::Size2f extent(static_cast<float>(size), static_cast<float>(size * random.Uniform(0.4, 1)));
    const cv::RotatedRect box(middle, extent, static_cast<float>(random.Uniform(0, 180)));
    const cv::Scalar grey(random.Uniform(20, 235));
    if (random.Uniform() < 0.25) {
      cv::ellipse(paint, box, grey, cv::FILLED);
    } else {
      cv::Point2f corners[4];
      box.points(corners);
      const std::vector<cv::Point> polygon(corners, corners + (random.Uniform() < 0.4 ? 3 : 4));
      cv::fillConvexPoly(paint, polygon, grey);
    }
  }
  paint.convertTo(paint, CV_32F);
  cv::GaussianBlur(paint, wall.paint, {}, 1.0);
  return wall;
}

RenderedWorld RenderedWorld::Room(std::uint64_t seed) {
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), y = Eigen::Vector3d::UnitY();
  const Eigen::Vector3d slanted_right(std::cos(0.6), 0, -std::sin(0.6));
  const Eigen::Vector3d slanted_down(0, std::cos(0.7), -std::sin(0.7));
  return RenderedWorld({PaintedWall({0, 0, 3}, x, y, 4, 3, seed),
                        PaintedWall({-0.8, 0.1, 2}, x, y, 0.4, 0.5, seed + 1),
                        PaintedWall({0.8, -0.2, 1.9}, slanted_right, y, 0.5, 0.45, seed + 2),
                        PaintedWall({0, 1.0, 2}, x, slanted_down, 0.9, 0.5, seed + 3)});
}

RenderedWorld RenderedWorld::SingleWall(double distance, std::uint64_t seed) {
  return RenderedWorld({PaintedWall({0, 0, distance}, Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY(),
                                    2 * distance, 1.5 * distance, seed)});
}

std::optional<RenderedWorld::Hit> RenderedWorld::Cast(const Eigen::Vector3d& origin,
                                                      const Eigen::Vector3d& direction) const {
  std::optional<Hit> hit;
  double nearest = std::numeric_limits<double>::max();
  for (std::size_t i = 0; i < walls_.size(); ++i) {
    const Wall& wall = walls_[i];
    const double along = wall.Normal().dot(direction);
    if (std::abs(along) < 1e-12) continue;
    const double distance = wall.Normal().dot(wall.center - origin) / along;
    if (distance <= 1e-6 || distance >= nearest) continue;
    const Eigen::Vector3d point = origin + distance * direction;
    if (std::abs(wall.right.dot(point - wall.center)) > wall.half_width ||
        std::abs(wall.down.dot(point - wall.center)) > wall.half_height) {
      continue;
    }
    nearest = distance;
    hit = Hit{i, point};
  }
  return hit;
}

std::optional<RenderedWorld::Hit> RenderedWorld::AtPixel(const CameraModel& camera,
                                                         const Rigid3& camera_from_world,
                                                         const Eigen::Vector2d& pixel) const {
  const auto ray = camera.Unproject(pixel);
  if (!ray) return std::nullopt;
  return Cast(camera_from_world.OriginInSource(), camera_from_world.rotation.inverse() * *ray);
}

bool RenderedWorld::Sees(const CameraModel& camera, const Rigid3& camera_from_world,
                         const Eigen::Vector3d& point, double margin_px) const {
  const auto pixel = camera.Project(camera_from_world * point);
  if (!pixel || !camera.IsInside(*pixel, margin_px)) return false;
  const Eigen::Vector3d origin = camera_from_world.OriginInSource();
  const auto hit = Cast(origin, point - origin);
  return hit && (hit->point - point).norm() < 1e-3;
}

double RenderedWorld::DistanceToSurface(const Eigen::Vector3d& point) const {
  double nearest = std::numeric_limits<double>::max();
  for (const Wall& wall : walls_) {
    const Eigen::Vector3d offset = point - wall.center;
    const double x = std::clamp(wall.right.dot(offset), -wall.half_width, wall.half_width);
    const double y = std::clamp(wall.down.dot(offset), -wall.half_height, wall.half_height);
    nearest = std::min(nearest, (offset - x * wall.right - y * wall.down).norm());
  }
  return nearest;
}

cv::Mat RenderedWorld::Render(const CameraModel& camera, const Rigid3& camera_from_world, double noise_sigma,
                              std::uint64_t noise_seed) const {
  const std::vector<WallInCamera> walls = WallsInCamera(walls_, camera_from_world);
  const std::vector<Eigen::Vector3f>& rays = RaysOf(camera);
  cv::Mat image(camera.height_px(), camera.width_px(), CV_8UC1);
  Random random(noise_seed);
  std::size_t next = 0;
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      float sum = 0;
      for (int part = 0; part < kRaysPerPixel; ++part) sum += Grey(walls, rays[next++]);
      const double noise = noise_sigma > 0 ? noise_sigma * RandomNormal(&random) : 0;
      image.at<std::uint8_t>(y, x) =
          cv::saturate_cast<std::uint8_t>(static_cast<double>(sum) / kRaysPerPixel + noise);
    }
  }
  return image;
}

std::shared_ptr<const CameraModel> PinholeCamera(int width_px, int height_px) {
  const double focal = 0.63 * width_px;
  return std::make_shared<CameraModel>(
      LensModel::kRadialTangential,
      CameraModel::Intrinsics{width_px, height_px, focal, focal, (width_px - 1) / 2.0, (height_px - 1) / 2.0},
      std::array<double, 5>{});
}

const std::shared_ptr<const CameraModel>& Camera() {
  static const auto camera = PinholeCamera(320, 240);
  return camera;
}

const RenderedWorld& World() {
  static const RenderedWorld world = RenderedWorld::Room(71);
  return world;
}

Rigid3 CameraAt(const Eigen::Vector3d& center, const Eigen::Vector3d& rotation_deg) {
  return Rigid3(Rotation3::Exp(rotation_deg * kPi / 180), center).inverse();
}

Frame MakeFrame(int index, const cv::Mat& image) {
  Frame frame;
  frame.time = FromSeconds(index / 30.0);
  frame.index = static_cast<std::uint64_t>(index);
  frame.image = image;
  return frame;
}

Frame MakeFrame(int index, const RenderedWorld& world, const Rigid3& camera_from_world) {
  const std::uint64_t noise_seed = static_cast<std::uint64_t>(index) + 1;
  return MakeFrame(index, world.Render(*Camera(), camera_from_world, 1.5, noise_seed));
}

KeyFrame MakeKeyFrame(const RenderedWorld& world, const std::shared_ptr<const CameraModel>& camera,
                      const Rigid3& camera_from_world) {
  KeyFrame keyframe;
  keyframe.camera = camera;
  keyframe.camera_from_map = camera_from_world;
  keyframe.features = MakeFeatures(world.Render(*camera, camera_from_world));
  return keyframe;
}

Map TrueMap(const RenderedWorld& world, const std::shared_ptr<const CameraModel>& camera,
            const std::vector<Rigid3>& poses, std::size_t max_points_per_keyframe) {
  Map map;
  for (const Rigid3& pose : poses) {
    KeyFrame keyframe = MakeKeyFrame(world, camera, pose);
    keyframe.fixed = map.empty();
    keyframe.time = FromSeconds(static_cast<double>(map.keyframes().size()));
    map.AddKeyFrame(std::move(keyframe));
  }
  const double min_distance = 6 * camera->PixelAngle();
  for (const auto& [id, record] : map.keyframes()) {
    const Rigid3& pose = record.keyframe.camera_from_map;
    std::size_t count = 0;
    for (int level = kPyramidLevels - 1; level >= 0; --level) {
      for (const Corner& corner : record.keyframe.features->corners[static_cast<std::size_t>(level)]) {
        if (count >= max_points_per_keyframe) break;
        const Eigen::Vector2d pixel = LevelZeroFromLevel(Eigen::Vector2d(corner.x, corner.y), level);
        const auto hit = world.AtPixel(*camera, pose, pixel);
        if (!hit || !world.Sees(*camera, pose, hit->point) ||
            !IsAwayFromWallEdges(world, *camera, pose, pixel, 7 << level, hit->wall)) {
          continue;
        }
        const bool known = std::any_of(map.points().begin(), map.points().end(), [&](const auto& other) {
          return (other.point.position() - hit->point).norm() < min_distance * hit->point.z();
        });
        if (known) continue;
        MapPoint point;
        point.point_in_map << hit->point, 1;
        point.source_keyframe = id;
        point.source_level = static_cast<std::uint8_t>(level);
        point.source_pixel = Eigen::Vector2f(corner.x, corner.y);
        Eigen::Vector3d normal = world.walls()[hit->wall].Normal();
        if (normal.dot(hit->point - pose.OriginInSource()) > 0) normal = -normal;
        point.normal = normal.cast<float>();
        Observe(world, *camera, map.AddPoint(point), &map);
        ++count;
      }
    }
  }
  for (auto& [id, record] : map.keyframes()) map.UpdateDepth(&record);
  return map;
}

std::shared_ptr<const MapSnapshot> MapWithDisplacedPoints(const RenderedWorld& world,
                                                          const std::shared_ptr<const CameraModel>& camera,
                                                          const std::vector<Rigid3>& views,
                                                          const std::function<bool(std::size_t)>& displaced) {
  Map map = TrueMap(world, camera, views);
  Random random(1);
  for (std::size_t i = 0; i < map.points().size(); ++i) {
    const double offset_y = random.Uniform(-0.5, 0.5);
    const double offset_x = random.Uniform(-0.5, 0.5);
    const Eigen::Vector3d offset_in_map(offset_x, offset_y, 0);
    if (displaced(i)) map.points()[i].point.point_in_map.head<3>() += offset_in_map;
  }
  for (auto& [id, record] : map.keyframes()) map.UpdateDepth(&record);
  return map.Snapshot();
}

}  // namespace docent::engine::testing_world
