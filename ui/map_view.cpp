// SPDX-License-Identifier: Apache-2.0
#include "ui/map_view.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <vector>

#include "engine/geometry/camera_model.h"
#include "ui/canvas.h"
#include "ui/content_layer.h"
#include "ui/heads_up.h"
#include "ui/image_target.h"

namespace docent::ui {
namespace {

constexpr double kHalfViewHeight = 0.42;  // Tangent of half the vertical field of view.

engine::CameraModel Pinhole(int width_px, int height_px) {
  const double focal_px = 0.5 * height_px / kHalfViewHeight;
  return {engine::LensModel::kRadialTangential,
          {width_px, height_px, focal_px, focal_px, 0.5 * (width_px - 1), 0.5 * (height_px - 1)},
          {}};
}

// The quantile at this share of the values; 0 if there are none.
double Quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  const auto index = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + index, values.end());
  return values[index];
}

// The largest of 1, 2 or 5 times a power of ten that does not exceed `length`.
double RoundLength(double length) {
  const double power = std::pow(10.0, std::floor(std::log10(length)));
  for (const double step : {5.0, 2.0}) {
    if (step * power <= length) return step * power;
  }
  return power;
}

class Drawing {
 public:
  Drawing(const engine::CameraModel& camera, const engine::Rigid3& camera_from_map, Canvas* canvas)
      : camera_(camera), camera_from_map_(camera_from_map), canvas_(canvas) {}

  // Draws a horizontal grid through the target with a spacing of `step` map units.
  void Grid(const Orbit& orbit, double step) {
    constexpr int kLines = 10;
    const engine::UprightAxes& axes = orbit.axes;
    const double right = std::round(axes.right.dot(orbit.target) / step) * step;
    const double ahead = std::round(axes.ahead.dot(orbit.target) / step) * step;
    const Eigen::Vector3d middle =
        right * axes.right + ahead * axes.ahead + axes.up.dot(orbit.target) * axes.up;
    const double reach = kLines * step;
    for (int i = -kLines; i <= kLines; ++i) {
      const Color color{0.5f, 0.6f, 0.7f, i == 0 ? 0.4f : 0.18f};
      const Eigen::Vector3d aside = middle + i * step * axes.right, along = middle + i * step * axes.ahead;
      Line(aside - reach * axes.ahead, aside + reach * axes.ahead, color);
      Line(along - reach * axes.right, along + reach * axes.right, color);
    }
  }

  void Wedge(const Orbit& orbit, const PredictedRecall& found) {
    // The octant is filled with lines from the centre outwards that lie close together.
    constexpr int kStrokes = 9;
    constexpr double kHalfEighth = std::numbers::pi / 8 * 0.9;
    Color color = RecallColor(found.share);
    color.alpha = 0.75f;
    const Eigen::Vector3d side = orbit.axes.up.cross(found.direction);
    const double depth = std::max(1e-9, (camera_from_map_ * found.place).z());
    const double width_px = 0.45 * found.side * kHalfEighth / kStrokes / (camera_.PixelAngle() * depth);
    for (int i = 0; i < kStrokes; ++i) {
      const double turn = kHalfEighth * (2.0 * i / (kStrokes - 1) - 1);
      const Eigen::Vector3d outwards = std::cos(turn) * found.direction + std::sin(turn) * side;
      Line(found.place + 0.06 * found.side * outwards, found.place + 0.45 * found.side * outwards, color,
           std::max(1.0, 1.2 * width_px));
    }
  }

  // The edges of a box along the map's axes.
  void Box(const Eigen::AlignedBox3d& box) {
    constexpr Color kEdge{1.0f, 0.796f, 0.420f, 0.9f};
    using Corner = Eigen::AlignedBox3d::CornerType;
    for (int corner = 0; corner < 8; ++corner) {
      for (const int bit : {1, 2, 4}) {
        if ((corner & bit) == 0)
          Line(box.corner(static_cast<Corner>(corner)), box.corner(static_cast<Corner>(corner | bit)), kEdge,
               1.5);
      }
    }
  }

  // A camera as a disk with a wedge in its viewing direction, of the same size wherever it is.
  void Camera(const Orbit& orbit, const engine::Rigid3& camera_from_map) {
    const Color color{1.0f, 1.0f, 1.0f, 1.0f}, edge{0.0f, 0.0f, 0.0f, 1.0f};
    const Eigen::Vector3d place = camera_from_map.OriginInSource();
    const auto pixel = camera_.Project(camera_from_map_ * place);
    if (!pixel) return;
    const double size = 0.06 * camera_.height_px();
    Eigen::Vector3d forward = camera_from_map.rotation.inverse() * Eigen::Vector3d::UnitZ();
    forward -= orbit.axes.up.dot(forward) * orbit.axes.up;
    const auto ahead =
        camera_.Project(camera_from_map_ * Eigen::Vector3d(place + 1e-3 * orbit.distance * forward));
    const Eigen::Vector2d way = ahead ? Eigen::Vector2d(*ahead - *pixel) : Eigen::Vector2d(0, 0);
    if (way.norm() > 1e-9) {
      const Eigen::Vector2d along = size * way.normalized(), aside(-along.y(), along.x());
      for (const double share : {-0.6, 0.6}) {
        canvas_->Line(*pixel, *pixel + along + share * aside, 4, edge);
        canvas_->Line(*pixel, *pixel + along + share * aside, 2, color);
      }
    }
    canvas_->Disk(*pixel, 0.35 * size + 1, edge);
    canvas_->Disk(*pixel, 0.35 * size, color);
  }

  // Points are drawn from far to near, so that near ones cover far ones.
  void Points(const engine::MapSnapshot& map, bool grey) {
    constexpr Color kGrey{0.62f, 0.66f, 0.7f, 0.8f};
    struct Dot {
      double depth;
      Eigen::Vector2d pixel;
      Color color;
    };
    std::vector<Dot> dots;
    for (const engine::MapPoint& point : map.points) {
      if (point.infinite()) continue;
      const Eigen::Vector3d in_camera = camera_from_map_ * point.position();
      const std::optional<Eigen::Vector2d> pixel = camera_.Project(in_camera);
      if (pixel && camera_.IsInside(*pixel, -4))
        dots.push_back({in_camera.z(), *pixel, grey ? kGrey : LevelColor(point.source_level)});
    }
    std::sort(dots.begin(), dots.end(), [](const Dot& a, const Dot& b) { return a.depth > b.depth; });
    for (const Dot& dot : dots) canvas_->Disk(dot.pixel, 1.6, dot.color);
  }

 private:
  // The line is divided into pieces, so that a line that passes behind the camera still shows its visible
  // part.
  void Line(const Eigen::Vector3d& from, const Eigen::Vector3d& to, const Color& color,
            double width_px = 1.0) {
    constexpr int kPieces = 20;
    std::optional<Eigen::Vector2d> previous;
    for (int i = 0; i <= kPieces; ++i) {
      const double t = static_cast<double>(i) / kPieces;
      const std::optional<Eigen::Vector2d> pixel =
          camera_.Project(camera_from_map_ * Eigen::Vector3d((1 - t) * from + t * to));
      if (pixel && previous && (camera_.IsInside(*pixel, -200) || camera_.IsInside(*previous, -200)))
        canvas_->Line(*previous, *pixel, width_px, color);
      previous = pixel;
    }
  }

  const engine::CameraModel& camera_;
  engine::Rigid3 camera_from_map_;
  Canvas* canvas_;
};

void DrawCaption(const std::string& title, const std::string& counts, Canvas* canvas) {
  TextStyle title_style;
  title_style.size_px = 20;
  title_style.bold = true;
  title_style.max_width_px = std::max(40, canvas->width_px() - 40);
  title_style.max_height_px = 60;
  TextStyle count_style = title_style;
  count_style.size_px = 14;
  count_style.bold = false;
  count_style.color = {0.75f, 0.8f, 0.85f, 1.0f};
  const double title_height = canvas->Text(title, title_style, {16, 12}).y();
  canvas->Text(counts, count_style, {16, 14 + title_height});
}

}  // namespace

engine::Rigid3 CameraFromMap(const Orbit& orbit) {
  const double half_pi = std::numbers::pi / 2;
  const double elevation = std::clamp(orbit.elevation, -half_pi, half_pi);
  const engine::UprightAxes& axes = orbit.axes;
  const Eigen::Vector3d ahead = std::sin(orbit.azimuth) * axes.right + std::cos(orbit.azimuth) * axes.ahead;
  const Eigen::Vector3d right = std::cos(orbit.azimuth) * axes.right - std::sin(orbit.azimuth) * axes.ahead;
  const Eigen::Vector3d forward = std::cos(elevation) * ahead - std::sin(elevation) * axes.up;
  const Eigen::Vector3d down = forward.cross(right);
  Eigen::Matrix3d rotation;
  rotation.row(0) = right;
  rotation.row(1) = down;
  rotation.row(2) = forward;
  const Eigen::Vector3d eye = orbit.target - orbit.distance * forward;
  return {engine::Rotation3(rotation), -(rotation * eye)};
}

std::string MapViewCounts(const engine::MapSnapshot& map, double grid) {
  char counts[160];
  std::snprintf(counts, sizeof counts, "%zu points, %zu keyframes, grid spacing %g map units",
                map.points.size(), map.keyframes.size(), grid);
  return counts;
}

Color RecallColor(double share) {
  // The colour goes from red through yellow to green, so that medium values differ from both ends.
  const auto t = static_cast<float>(std::clamp(share, 0.0, 1.0));
  return {std::min(1.0f, 2 - 2 * t) * 0.9f, std::min(1.0f, 2 * t) * 0.8f, 0.15f, 1.0f};
}

Orbit OrbitAbove(const engine::MapSnapshot& map, double width_over_height) {
  Orbit orbit;
  orbit.axes = engine::UprightAxesOf(map);
  Eigen::Matrix3d axes_from_map;
  axes_from_map << orbit.axes.right.transpose(), orbit.axes.ahead.transpose(), orbit.axes.up.transpose();
  std::vector<Eigen::Vector3d> places;
  for (const engine::MapPoint& point : map.points) {
    if (!point.infinite()) places.emplace_back(axes_from_map * point.position());
  }
  Eigen::Vector3d low = Eigen::Vector3d::Zero(), high = Eigen::Vector3d::Zero();
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const Eigen::Vector3d& place : places) values.push_back(place[axis]);
    low[axis] = Quantile(values, 0.05);
    high[axis] = Quantile(values, 0.95);
  }
  Eigen::AlignedBox3d box;
  if (!places.empty()) box.extend(low).extend(high);
  for (const engine::KeyFrame& keyframe : map.keyframes)
    box.extend(axes_from_map * keyframe.camera_from_map.OriginInSource());
  if (box.isEmpty()) box.extend(Eigen::Vector3d::Zero().eval());
  orbit.target = axes_from_map.transpose() * box.center();
  const double radius = 0.5 * box.diagonal().norm();
  const double tangent = kHalfViewHeight * std::min(1.0, width_over_height);
  orbit.distance = radius > 0 ? 1.1 * radius * std::hypot(1.0, 1.0 / tangent) : 1.0;
  return orbit;
}

struct MapView::Impl {
  explicit Impl(const MapViewOptions& options_in)
      : options(options_in),
        camera(Pinhole(options_in.width_px, options_in.height_px)),
        content(options_in.samples, options_in.max_texture_px, "") {}

  MapViewOptions options;
  engine::CameraModel camera;
  ImageTarget image;
  ContentLayer content;
  Canvas below, above;
};

MapView::MapView(const MapViewOptions& options) : impl_(std::make_unique<Impl>(options)) {}

MapView::~MapView() = default;

void MapView::Draw(const engine::MapSnapshot& map, const Orbit& orbit, const MapViewContents& contents) {
  const int width_px = impl_->options.width_px, height_px = impl_->options.height_px;
  const RenderTarget& target = impl_->image.Bind(width_px, height_px);
  impl_->image.DrawVideo(cv::Mat());
  const engine::Rigid3 camera_from_map = CameraFromMap(orbit);
  const double grid = RoundLength(std::max(1e-6, 0.25 * orbit.distance * kHalfViewHeight));

  impl_->below.Begin(width_px, height_px);
  Drawing drawing(impl_->camera, camera_from_map, &impl_->below);
  drawing.Grid(orbit, grid);
  for (const PredictedRecall& found : contents.predicted_recall) drawing.Wedge(orbit, found);
  drawing.Points(map, contents.grey_points);
  DrawKeyFrames(map, impl_->camera, camera_from_map, &impl_->below);
  if (contents.boundary) drawing.Box(*contents.boundary);
  impl_->below.End();
  if (contents.scene != nullptr)
    impl_->content.Draw(impl_->camera, camera_from_map, *contents.scene,
                        {.markers = true, .occluders = false, .shadows = false}, target);
  impl_->above.Begin(width_px, height_px);
  if (contents.camera_from_map)
    Drawing(impl_->camera, camera_from_map, &impl_->above).Camera(orbit, *contents.camera_from_map);
  if (!contents.title.empty()) DrawCaption(contents.title, MapViewCounts(map, grid), &impl_->above);
  target.BindForDrawing();
  impl_->above.End();
}

void MapView::Present(const WindowPart& part) {
  impl_->image.Present(part.x, part.y, part.width_px, part.height_px, part.window_height_px);
}

void MapView::ReadBack(cv::Mat* image) {
  impl_->image.ReadBack(image);
}

}  // namespace docent::ui
