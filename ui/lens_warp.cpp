// SPDX-License-Identifier: Apache-2.0
#include "ui/lens_warp.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace docent::ui {
namespace {

constexpr int kBorderPx = 2;  // Added beyond the outermost ray for bilinear sampling.
constexpr int kFacesPerRow = 3;

// The rays of all pixels of an image, row by row; zero where the lens has no ray.
std::vector<Eigen::Vector3d> RaysOf(const engine::CameraModel& camera) {
  std::vector<Eigen::Vector3d> rays;
  rays.reserve(static_cast<std::size_t>(camera.width_px()) * camera.height_px());
  for (int y = 0; y < camera.height_px(); ++y) {
    for (int x = 0; x < camera.width_px(); ++x)
      rays.push_back(camera.Unproject(Eigen::Vector2d(x, y)).value_or(Eigen::Vector3d::Zero()));
  }
  return rays;
}

std::array<engine::Rotation3, 6> CubeFaces() {
  const double quarter = std::numbers::pi / 2;
  using engine::Rotation3;
  return {Rotation3(),
          Rotation3::Exp(Eigen::Vector3d(0, -quarter, 0)),      // right
          Rotation3::Exp(Eigen::Vector3d(0, quarter, 0)),       // left
          Rotation3::Exp(Eigen::Vector3d(quarter, 0, 0)),       // below
          Rotation3::Exp(Eigen::Vector3d(-quarter, 0, 0)),      // above
          Rotation3::Exp(Eigen::Vector3d(0, 2 * quarter, 0))};  // behind
}

// The index in CubeFaces of the face that a ray intersects.
int CubeFaceOf(const Eigen::Vector3d& ray) {
  int axis = 0;
  ray.cwiseAbs().maxCoeff(&axis);
  if (axis == 0) return ray.x() > 0 ? 1 : 2;
  if (axis == 1) return ray.y() > 0 ? 3 : 4;
  return ray.z() > 0 ? 0 : 5;
}

bool FitsOneFace(const std::vector<Eigen::Vector3d>& rays) {
  return std::all_of(rays.begin(), rays.end(), [](const Eigen::Vector3d& ray) {
    const double reach = LensWarp::kMaxTangent * ray.z();
    return ray.isZero() || (ray.z() > 0 && std::abs(ray.x()) <= reach && std::abs(ray.y()) <= reach);
  });
}

// The number of pixels per unit of tangent at the centre of the image.
double MiddleFocalLength(const engine::CameraModel& camera) {
  Eigen::Vector2d pixel;
  Eigen::Matrix<double, 2, 3> jacobian;
  if (!camera.Project(Eigen::Vector3d::UnitZ(), &pixel, &jacobian)) return 1.0 / camera.PixelAngle();
  return std::max(jacobian.col(0).norm(), jacobian.col(1).norm());
}

struct FaceRange {
  TangentBounds bounds{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity(),
                       std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  bool used = false;
};

void Include(const Eigen::Vector2d& tangent, FaceRange* range) {
  range->used = true;
  range->bounds.left = std::min(range->bounds.left, tangent.x());
  range->bounds.right = std::max(range->bounds.right, tangent.x());
  range->bounds.top = std::min(range->bounds.top, tangent.y());
  range->bounds.bottom = std::max(range->bounds.bottom, tangent.y());
}

// Makes a face of whole pixels with this focal length (pixels) and a border around its range.
LensFace MakeFace(const engine::Rotation3& face_from_camera, const TangentBounds& range, double focal_px) {
  LensFace face;
  face.face_from_camera = face_from_camera;
  face.width_px = static_cast<int>(std::ceil((range.right - range.left) * focal_px)) + 2 * kBorderPx;
  face.height_px = static_cast<int>(std::ceil((range.bottom - range.top) * focal_px)) + 2 * kBorderPx;
  const double border = kBorderPx / focal_px;
  face.bounds.left = range.left - border;
  face.bounds.top = range.top - border;
  face.bounds.right = face.bounds.left + face.width_px / focal_px;
  face.bounds.bottom = face.bounds.top + face.height_px / focal_px;
  return face;
}

// Packs the faces into the atlas, three per row.
void PlaceFaces(LensWarp* warp) {
  int x = 0, y = 0, row_height = 0;
  warp->atlas_width_px = warp->atlas_height_px = 0;
  for (std::size_t i = 0; i < warp->faces.size(); ++i) {
    LensFace& face = warp->faces[i];
    if (i > 0 && i % kFacesPerRow == 0) {
      x = 0;
      y += row_height;
      row_height = 0;
    }
    face.x_px = x;
    face.y_px = y;
    x += face.width_px;
    row_height = std::max(row_height, face.height_px);
    warp->atlas_width_px = std::max(warp->atlas_width_px, x);
    warp->atlas_height_px = std::max(warp->atlas_height_px, y + row_height);
  }
}

// Computes warp->tiles from warp->lookup.
void MeasureTiles(int width_px, int height_px, LensWarp* warp) {
  constexpr int kTile = LensWarp::kTilePx;
  warp->tiles_per_row = (width_px + kTile - 1) / kTile;
  warp->tiles.assign(static_cast<std::size_t>(warp->tiles_per_row) * ((height_px + kTile - 1) / kTile), {});
  for (int y = 0; y < height_px; ++y) {
    for (int x = 0; x < width_px; ++x) {
      const glm::vec2& place = warp->lookup[static_cast<std::size_t>(y) * width_px + x];
      if (place.x < 0) continue;
      // Bilinear sampling reads up to one texel to either side.
      const int column = static_cast<int>(place.x * static_cast<float>(warp->atlas_width_px)) - 1;
      const int row = static_cast<int>(place.y * static_cast<float>(warp->atlas_height_px)) - 1;
      warp->tiles[static_cast<std::size_t>(y / kTile) * warp->tiles_per_row + x / kTile].Include(
          {column, row, 3, 3});
    }
  }
}

}  // namespace

void PixelRectangle::Include(const PixelRectangle& other) {
  if (other.empty()) return;
  if (empty()) {
    *this = other;
    return;
  }
  const int right = std::max(x + width, other.x + other.width);
  const int bottom = std::max(y + height, other.y + other.height);
  x = std::min(x, other.x);
  y = std::min(y, other.y);
  width = right - x;
  height = bottom - y;
}

PixelRectangle ImageFromAtlas(const LensWarp& warp, const engine::CameraModel& camera,
                              const std::vector<PixelRectangle>& atlas_rectangles) {
  PixelRectangle result;
  for (int i = 0; i < static_cast<int>(warp.tiles.size()); ++i) {
    const PixelRectangle& tile = warp.tiles[i];
    if (tile.empty() || std::none_of(atlas_rectangles.begin(), atlas_rectangles.end(),
                                     [&](const PixelRectangle& other) { return tile.Overlaps(other); }))
      continue;
    const int x = i % warp.tiles_per_row * LensWarp::kTilePx, y = i / warp.tiles_per_row * LensWarp::kTilePx;
    result.Include({x, y, std::min(LensWarp::kTilePx, camera.width_px() - x),
                    std::min(LensWarp::kTilePx, camera.height_px() - y)});
  }
  return result;
}

LensWarp MakeLensWarp(const engine::CameraModel& camera, int max_side_px) {
  const std::vector<Eigen::Vector3d> rays = RaysOf(camera);
  const bool one_face = FitsOneFace(rays);
  const std::array<engine::Rotation3, 6> cube = CubeFaces();
  const auto face_of = [&](const Eigen::Vector3d& ray) { return one_face ? 0 : CubeFaceOf(ray); };

  std::array<FaceRange, 6> ranges;
  for (const Eigen::Vector3d& ray : rays) {
    if (ray.isZero()) continue;
    const int face = face_of(ray);
    Include((cube[face] * ray).hnormalized(), &ranges[face]);
  }
  if (std::none_of(ranges.begin(), ranges.end(), [](const FaceRange& range) { return range.used; }))
    Include(Eigen::Vector2d::Zero(), &ranges[0]);

  LensWarp warp;
  std::array<int, 6> index{};
  for (double focal_px = MiddleFocalLength(camera);; focal_px *= 0.9) {
    warp.faces.clear();
    for (int i = 0; i < 6; ++i) {
      if (!ranges[i].used) continue;
      index[i] = static_cast<int>(warp.faces.size());
      warp.faces.push_back(MakeFace(cube[i], ranges[i].bounds, focal_px));
    }
    PlaceFaces(&warp);
    if (std::max(warp.atlas_width_px, warp.atlas_height_px) <= max_side_px) break;
  }

  const glm::vec2 atlas_size(warp.atlas_width_px, warp.atlas_height_px);
  warp.lookup.reserve(rays.size());
  for (const Eigen::Vector3d& ray : rays) {
    if (ray.isZero()) {
      warp.lookup.emplace_back(-1.0f);
      continue;
    }
    const LensFace& face = warp.faces[index[face_of(ray)]];
    const Eigen::Vector2d tangent = (face.face_from_camera * ray).hnormalized();
    const glm::vec2 in_face = GlTextureFromTangent(face.bounds, tangent.x(), tangent.y());
    warp.lookup.push_back(
        (glm::vec2(face.x_px, face.y_px) + in_face * glm::vec2(face.width_px, face.height_px)) / atlas_size);
  }
  MeasureTiles(camera.width_px(), camera.height_px(), &warp);
  return warp;
}

}  // namespace docent::ui
