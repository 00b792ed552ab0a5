// SPDX-License-Identifier: Apache-2.0
#include "app/simulator/surface_renderer.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace docent::app {
namespace {

// Rectangles are enlarged by this factor to close the seams between rectangles that share an edge.
constexpr float kSeam = 1.00001f;
constexpr int kNothing = -1;
// Real lenses blur slightly, so textures are sampled at a coarser level (units of 1/256 mip level).
constexpr int kSoftnessQ8 = 90;

// Base-2 logarithm in units of 1/256, interpolated linearly between powers of two (error at most 0.09 of a
// level).
int Log2Q8(float x) {
  return (std::bit_cast<int>(x) - (127 << 23)) >> 15;
}

}  // namespace

SurfaceRenderer::SurfaceRenderer(const Surfaces* surfaces, const engine::CameraModel& camera)
    : surfaces_(surfaces),
      width_px_(camera.width_px()),
      height_px_(camera.height_px()),
      tiles_x_((width_px_ + kTile - 1) / kTile),
      tiles_y_((height_px_ + kTile - 1) / kTile),
      groups_x_((tiles_x_ + kGroup - 1) / kGroup) {
  for (int tile_y = 0; tile_y < tiles_y_; ++tile_y) {
    for (int tile_x = 0; tile_x < tiles_x_; ++tile_x) {
      Rays& rays = rays_.emplace_back();
      for (int i = 0; i < kTilePixels; ++i) {
        const Eigen::Vector2d pixel(tile_x * kTile + i % kTile, tile_y * kTile + i / kTile);
        const Eigen::Vector3d ray = camera.Unproject(pixel).value_or(Eigen::Vector3d::Zero());
        rays.x[i] = static_cast<float>(ray.x());
        rays.y[i] = static_cast<float>(ray.y());
        rays.z[i] = static_cast<float>(ray.z());
      }
      const int middle = kTilePixels / 2 + kTile / 2;
      const Eigen::Vector3f a(rays.x[middle], rays.y[middle], rays.z[middle]);
      const Eigen::Vector3f right(rays.x[middle + 1], rays.y[middle + 1], rays.z[middle + 1]);
      const Eigen::Vector3f below(rays.x[middle + kTile], rays.y[middle + kTile], rays.z[middle + kTile]);
      const float angle = std::sqrt((right - a).cross(below - a).norm());
      pixel_angle_.push_back(angle > 0 && angle < 1 ? angle : static_cast<float>(camera.PixelAngle()));
      tile_cones_.push_back(ConeOver(camera, tile_x * kTile, tile_y * kTile, kTile));
    }
  }
  for (int y = 0; y < tiles_y_; y += kGroup) {
    for (int x = 0; x < tiles_x_; x += kGroup) {
      group_cones_.push_back(ConeOver(camera, x * kTile, y * kTile, kGroup * kTile));
    }
  }
}

SurfaceRenderer::Cone SurfaceRenderer::ConeOver(const engine::CameraModel& camera, int left, int top,
                                                int size) const {
  // The lens bends lines between pixels, but by much less than this margin over the side of a group.
  const double margin = 1.0 + 0.04 * size;
  const double low_x = left - margin, high_x = left + size - 1 + margin;
  const double low_y = top - margin, high_y = top + size - 1 + margin;
  const Eigen::Vector2d corners[4] = {{low_x, low_y}, {high_x, low_y}, {high_x, high_y}, {low_x, high_y}};
  Cone cone;
  cone.is_known = true;
  for (int i = 0; i < 4; ++i) {
    const auto ray = camera.Unproject(corners[i]);
    if (!ray) return Cone{};
    cone.corners.row(i) = ray->transpose().cast<float>();
  }
  return cone;
}

std::vector<SurfaceRenderer::Facet> SurfaceRenderer::FacetsFrom(
    const engine::Rigid3& camera_from_world) const {
  const Eigen::Matrix3d rotation = camera_from_world.rotation.matrix();
  std::vector<Facet> facets;
  facets.reserve(surfaces_->rectangles().size());
  for (std::size_t i = 0; i < surfaces_->rectangles().size(); ++i) {
    const Rectangle& rectangle = surfaces_->rectangles()[i];
    const Eigen::Vector3d center = camera_from_world * rectangle.center;
    const Eigen::Vector3d half_u = rotation * rectangle.half_u, half_v = rotation * rectangle.half_v;
    const Eigen::Vector3d normal = half_u.cross(half_v).normalized();
    const double plane_distance = normal.dot(center);
    if (std::abs(plane_distance) < 1e-6) {  // Seen exactly edge-on: a line without area.
      facets.push_back({Eigen::Vector3f::Zero(), Eigen::Vector3f::Zero(), Eigen::Vector3f::Zero()});
      facets.back().rectangle = static_cast<int>(i);
      continue;
    }
    const Eigen::Vector3d u_axis = half_u / half_u.squaredNorm(), v_axis = half_v / half_v.squaredNorm();
    const Eigen::Vector3d w = normal / plane_distance;
    const Texture& texture = surfaces_->textures()[rectangle.texture];
    const TextureWindow& window = rectangle.window;
    Facet facet;
    facet.w = w.cast<float>();
    facet.u = (u_axis - u_axis.dot(center) * w).cast<float>();
    facet.v = (v_axis - v_axis.dot(center) * w).cast<float>();
    facet.plane_distance = static_cast<float>(std::abs(plane_distance));
    facet.middle_x = static_cast<float>(0.5 * (window.left + window.right) * texture.width());
    facet.middle_y = static_cast<float>(0.5 * (window.top + window.bottom) * texture.height());
    facet.half_x = static_cast<float>(0.5 * (window.right - window.left) * texture.width());
    facet.half_y = static_cast<float>(0.5 * (window.bottom - window.top) * texture.height());
    facet.texels_per_metre =
        std::sqrt(std::abs(facet.half_x * facet.half_y) / static_cast<float>(half_u.norm() * half_v.norm()));
    facet.rectangle = static_cast<int>(i);
    facets.push_back(facet);
  }
  return facets;
}

bool SurfaceRenderer::MayShow(const Facet& facet, const Cone& cone) {
  if (!cone.is_known) return true;
  const Eigen::Vector4f u = cone.corners * facet.u, v = cone.corners * facet.v, w = cone.corners * facet.w;
  // A linear function that is negative at all corners is negative in the whole cone.
  return w.maxCoeff() > 0 && (w - u).maxCoeff() >= 0 && (w + u).maxCoeff() >= 0 && (w - v).maxCoeff() >= 0 &&
         (w + v).maxCoeff() >= 0;
}

void SurfaceRenderer::CandidatesOf(const std::vector<Facet>& facets, const std::vector<int>& group,
                                   const Cone& cone, std::vector<Candidate>* candidates) const {
  candidates->clear();
  float covered_from = 0;  // Surfaces with a smaller inverse distance are hidden.
  for (const int index : group) {
    const Facet& facet = facets[index];
    if (!cone.is_known) {
      candidates->push_back({index, std::numeric_limits<float>::max()});
      continue;
    }
    const Eigen::Vector4f u = cone.corners * facet.u, v = cone.corners * facet.v, w = cone.corners * facet.w;
    if (!(w.maxCoeff() > 0 && (w - u).maxCoeff() >= 0 && (w + u).maxCoeff() >= 0 && (w - v).maxCoeff() >= 0 &&
          (w + v).maxCoeff() >= 0)) {
      continue;
    }
    // A unit ray inside of the cone is a positive combination of the corner rays with weights that sum to
    // slightly more than one, hence the margin of two percent.
    candidates->push_back({index, 1.02f * w.maxCoeff()});
    if (w.minCoeff() > 0 && (w - u.cwiseAbs()).minCoeff() > 0 && (w - v.cwiseAbs()).minCoeff() > 0) {
      covered_from = std::max(covered_from, w.minCoeff());
    }
  }
  std::erase_if(*candidates, [&](const Candidate& candidate) { return candidate.nearest < covered_from; });
}

template <int kCount>
void SurfaceRenderer::Trace(const std::vector<Facet>& facets, const std::vector<Candidate>& candidates,
                            const Rays& rays, int first_pixel, int* nearest) {
  // Local arrays of fixed size without branches, so that the compiler vectorizes the loop.
  float best[kCount];
  int best_index[kCount];
  for (int i = 0; i < kCount; ++i) {
    best[i] = 0;
    best_index[i] = kNothing;
  }
  const float* x = rays.x.data() + first_pixel;
  const float* y = rays.y.data() + first_pixel;
  const float* z = rays.z.data() + first_pixel;
  for (const Candidate& candidate : candidates) {
    const Facet& facet = facets[candidate.facet];
    const float ux = facet.u.x(), uy = facet.u.y(), uz = facet.u.z();
    const float vx = facet.v.x(), vy = facet.v.y(), vz = facet.v.z();
    const float wx = facet.w.x(), wy = facet.w.y(), wz = facet.w.z();
    const int index = candidate.facet;
    for (int i = 0; i < kCount; ++i) {
      const float u = ux * x[i] + uy * y[i] + uz * z[i];
      const float v = vx * x[i] + vy * y[i] + vz * z[i];
      const float w = wx * x[i] + wy * y[i] + wz * z[i];
      const float reach = w * kSeam;
      const bool hit = (std::abs(u) <= reach) & (std::abs(v) <= reach) & (w > best[i]);
      best[i] = hit ? w : best[i];
      best_index[i] = hit ? index : best_index[i];
    }
  }
  std::copy(best_index, best_index + kCount, nearest);
}

int SurfaceRenderer::TraceOne(const std::vector<Facet>& facets, const std::vector<Candidate>& candidates,
                              const Eigen::Vector3f& ray) const {
  float best = 0;
  int best_index = kNothing;
  for (const Candidate& candidate : candidates) {
    const Facet& facet = facets[candidate.facet];
    const float w = facet.w.dot(ray);
    if (w > best && std::abs(facet.u.dot(ray)) <= w * kSeam && std::abs(facet.v.dot(ray)) <= w * kSeam) {
      best = w;
      best_index = candidate.facet;
    }
  }
  return best_index;
}

cv::Vec3b SurfaceRenderer::Shade(const Facet& facet, const Eigen::Vector3f& ray, float pixel_angle) const {
  const Rectangle& rectangle = surfaces_->rectangles()[facet.rectangle];
  const float inverse_distance = facet.w.dot(ray);
  const float u = facet.u.dot(ray) / inverse_distance, v = facet.v.dot(ray) / inverse_distance;
  // A pixel covers distance * angle in one direction, and that divided by the cosine of the slant in the
  // other; the level follows the geometric mean. The cosine is plane_distance / distance.
  const float slant = inverse_distance * facet.plane_distance;
  const float footprint =
      facet.texels_per_metre * pixel_angle / (inverse_distance * std::sqrt(std::max(slant, 0.02f)));
  const std::uint64_t color = surfaces_->textures()[rectangle.texture].Sample(
      facet.middle_x + facet.half_x * u, facet.middle_y + facet.half_y * v, Log2Q8(footprint) + kSoftnessQ8);
  const float light = rectangle.light + rectangle.light_u * u + rectangle.light_v * v;
  const int light_q8 = std::clamp(static_cast<int>(light * 256), 0, 1024);
  return {static_cast<uchar>(std::min(255, (Texture::Blue(color) * light_q8 + 128) >> 8)),
          static_cast<uchar>(std::min(255, (Texture::Green(color) * light_q8 + 128) >> 8)),
          static_cast<uchar>(std::min(255, (Texture::Red(color) * light_q8 + 128) >> 8))};
}

bool SurfaceRenderer::IsEdge(const cv::Mat& nearest, int x, int y) const {
  const int* row = nearest.ptr<int>(y);
  const int* above = nearest.ptr<int>(std::max(0, y - 1));
  const int* below = nearest.ptr<int>(std::min(nearest.rows - 1, y + 1));
  const int index = row[x];
  return row[std::max(0, x - 1)] != index || row[std::min(nearest.cols - 1, x + 1)] != index ||
         above[x] != index || below[x] != index;
}

void SurfaceRenderer::ShadeTile(const FacetsOfRow& facets_of_row, const std::vector<Candidate>& candidates,
                                const cv::Mat& nearest, int tile_x, int tile_y, cv::Mat* bgr) const {
  static constexpr float kOffsets[4][2] = {
      {-0.125f, -0.375f}, {0.375f, -0.125f}, {0.125f, 0.375f}, {-0.375f, 0.125f}};
  const int tile = tile_y * tiles_x_ + tile_x;
  const Rays& rays = rays_[tile];
  const float pixel_angle = pixel_angle_[tile];
  const auto ray_at = [&](int i) { return Eigen::Vector3f(rays.x[i], rays.y[i], rays.z[i]); };
  const int rows = std::min(kTile, height_px_ - tile_y * kTile),
            columns = std::min(kTile, width_px_ - tile_x * kTile);
  for (int row = 0; row < rows; ++row) {
    const int y = tile_y * kTile + row;
    const std::vector<Facet>& facets = *facets_of_row[row];
    cv::Vec3b* out = bgr->ptr<cv::Vec3b>(y) + tile_x * kTile;
    for (int column = 0; column < columns; ++column) {
      const int i = row * kTile + column, x = tile_x * kTile + column;
      const Eigen::Vector3f ray = ray_at(i);
      const int index = nearest.at<int>(y, x);
      if (ray.isZero(0) || !IsEdge(nearest, x, y)) {
        out[column] = index == kNothing ? cv::Vec3b() : Shade(facets[index], ray, pixel_angle);
        continue;
      }
      // The lens is smooth, so linear interpolation between neighbouring rays is accurate enough for
      // sub-rays.
      const int left = column > 0 ? i - 1 : i, top = row > 0 ? i - kTile : i;
      const Eigen::Vector3f right_step = ray_at(left + 1) - ray_at(left);
      const Eigen::Vector3f down_step =
          row > 0 ? Eigen::Vector3f(ray_at(i) - ray_at(top)) : Eigen::Vector3f(ray_at(i + kTile) - ray_at(i));
      cv::Vec3i sum(2, 2, 2);
      for (const auto& offset : kOffsets) {
        const Eigen::Vector3f sub_ray = ray + offset[0] * right_step + offset[1] * down_step;
        const int sub_index = TraceOne(facets, candidates, sub_ray);
        if (sub_index != kNothing) sum += cv::Vec3i(Shade(facets[sub_index], sub_ray, pixel_angle));
      }
      out[column] = cv::Vec3b(static_cast<uchar>(sum[0] / 4), static_cast<uchar>(sum[1] / 4),
                              static_cast<uchar>(sum[2] / 4));
    }
  }
}

void SurfaceRenderer::StoreTile(const std::array<int, kTilePixels>& tile_nearest, int tile_x, int tile_y,
                                cv::Mat* nearest) const {
  const int rows = std::min(kTile, height_px_ - tile_y * kTile);
  const int columns = std::min(kTile, width_px_ - tile_x * kTile);
  for (int row = 0; row < rows; ++row) {
    std::copy_n(tile_nearest.begin() + row * kTile, columns,
                nearest->ptr<int>(tile_y * kTile + row) + tile_x * kTile);
  }
}

void SurfaceRenderer::Render(const engine::Rigid3& camera_from_world, cv::Mat* bgr) const {
  const std::vector<Facet> facets = FacetsFrom(camera_from_world);
  std::vector<std::vector<int>> groups(group_cones_.size());
  for (std::size_t g = 0; g < groups.size(); ++g) {
    for (int i = 0; i < static_cast<int>(facets.size()); ++i) {
      if (MayShow(facets[i], group_cones_[g])) groups[g].push_back(i);
    }
  }
  cv::Mat nearest(height_px_, width_px_, CV_32SC1);
  std::vector<std::vector<Candidate>> candidates(rays_.size());
  std::array<int, kTilePixels> tile_nearest;
  for (int tile_y = 0; tile_y < tiles_y_; ++tile_y) {
    for (int tile_x = 0; tile_x < tiles_x_; ++tile_x) {
      const int tile = tile_y * tiles_x_ + tile_x;
      const std::vector<int>& group = groups[(tile_y / kGroup) * groups_x_ + tile_x / kGroup];
      CandidatesOf(facets, group, tile_cones_[tile], &candidates[tile]);
      Trace<kTilePixels>(facets, candidates[tile], rays_[tile], 0, tile_nearest.data());
      StoreTile(tile_nearest, tile_x, tile_y, &nearest);
    }
  }
  bgr->create(height_px_, width_px_, CV_8UC3);
  FacetsOfRow facets_of_row;
  facets_of_row.fill(&facets);
  for (int tile_y = 0; tile_y < tiles_y_; ++tile_y) {
    for (int tile_x = 0; tile_x < tiles_x_; ++tile_x) {
      ShadeTile(facets_of_row, candidates[tile_y * tiles_x_ + tile_x], nearest, tile_x, tile_y, bgr);
    }
  }
}

void SurfaceRenderer::CandidatesOfRows(std::span<const std::vector<Facet>> row_facets, int tile_x, int tile_y,
                                       std::vector<Candidate>* candidates) const {
  const int last = std::min(kTile, height_px_ - tile_y * kTile) - 1;
  const int tile = tile_y * tiles_x_ + tile_x;
  const Cone& group_cone = group_cones_[(tile_y / kGroup) * groups_x_ + tile_x / kGroup];
  std::vector<int> group;
  std::vector<Candidate> of_row;
  candidates->clear();
  // A facet moves monotonically between the first and the last row; with interlacing, this holds for each
  // parity separately.
  for (const int row : {0, std::min(1, last), std::max(0, last - 1), last}) {
    const std::vector<Facet>& facets = row_facets[row];
    group.clear();
    for (int i = 0; i < static_cast<int>(facets.size()); ++i) {
      if (MayShow(facets[i], group_cone)) group.push_back(i);
    }
    CandidatesOf(facets, group, tile_cones_[tile], &of_row);
    candidates->insert(candidates->end(), of_row.begin(), of_row.end());
  }
  // The order decides between coincident surfaces, so it must be the same as in Render.
  std::sort(candidates->begin(), candidates->end(),
            [](const Candidate& a, const Candidate& b) { return a.facet < b.facet; });
  candidates->erase(std::unique(candidates->begin(), candidates->end(),
                                [](const Candidate& a, const Candidate& b) { return a.facet == b.facet; }),
                    candidates->end());
}

void SurfaceRenderer::RenderRows(std::span<const engine::Rigid3> camera_from_world, cv::Mat* bgr) const {
  std::vector<std::vector<Facet>> facets;
  for (const engine::Rigid3& pose : camera_from_world) facets.push_back(FacetsFrom(pose));
  cv::Mat nearest(height_px_, width_px_, CV_32SC1);
  std::vector<std::vector<Candidate>> candidates(rays_.size());
  std::array<int, kTilePixels> tile_nearest;
  for (int tile_y = 0; tile_y < tiles_y_; ++tile_y) {
    const int rows = std::min(kTile, height_px_ - tile_y * kTile);
    const std::span row_facets(facets.data() + tile_y * kTile, static_cast<std::size_t>(rows));
    for (int tile_x = 0; tile_x < tiles_x_; ++tile_x) {
      const int tile = tile_y * tiles_x_ + tile_x;
      CandidatesOfRows(row_facets, tile_x, tile_y, &candidates[tile]);
      for (int row = 0; row < rows; ++row) {
        Trace<kTile>(row_facets[row], candidates[tile], rays_[tile], row * kTile,
                     tile_nearest.data() + row * kTile);
      }
      StoreTile(tile_nearest, tile_x, tile_y, &nearest);
    }
  }
  bgr->create(height_px_, width_px_, CV_8UC3);
  for (int tile_y = 0; tile_y < tiles_y_; ++tile_y) {
    FacetsOfRow facets_of_row{};
    for (int row = 0; row < std::min(kTile, height_px_ - tile_y * kTile); ++row)
      facets_of_row[row] = &facets[tile_y * kTile + row];
    for (int tile_x = 0; tile_x < tiles_x_; ++tile_x) {
      ShadeTile(facets_of_row, candidates[tile_y * tiles_x_ + tile_x], nearest, tile_x, tile_y, bgr);
    }
  }
}

}  // namespace docent::app
