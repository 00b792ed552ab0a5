// SPDX-License-Identifier: Apache-2.0
#include "tests/app/support/surface_accuracy.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <utility>

#include "content/picking.h"
#include "content/scene.h"
#include "engine/dense/depth_estimation.h"
#include "engine/vision/image_pyramid.h"

namespace docent::app {
namespace {

int CountSeeing(const Simulation& simulation, const std::vector<int>& frames, const Eigen::Vector3d& surface,
                int enough) {
  int seeing = 0;
  for (const int frame : frames) {
    if (seeing < enough && simulation.IsVisible(frame, surface)) ++seeing;
  }
  return seeing;
}

// inverse_distance: of the surfaces that the keyframe sees in the pixels of a pyramid level, 1 / map units; 0
// where it is not known.
void AddDepths(const Simulation& simulation, const cv::Mat& inverse_distance, int level, int frame,
               const std::vector<int>& others, double metres_per_unit, DepthFigures* figures) {
  const engine::Rigid3 world_from_camera = simulation.world_from_camera(frame);
  for (int y = 0; y < inverse_distance.rows; ++y) {
    for (int x = 0; x < inverse_distance.cols; ++x) {
      const auto surface =
          simulation.SurfaceAlong(world_from_camera, engine::LevelZeroFromLevel({x, y}, level));
      if (!surface || CountSeeing(simulation, others, *surface, 1) == 0) continue;
      ++figures->seen;
      const double inverse = inverse_distance.at<float>(y, x);
      if (inverse <= 0) continue;
      ++figures->known;
      const double truth_m = (*surface - world_from_camera.translation).norm();
      const double error = std::abs(metres_per_unit / inverse / truth_m - 1);
      for (std::size_t i = 0; i < kDepthTolerances.size(); ++i)
        figures->correct[i] += error < kDepthTolerances[i];
    }
  }
}

using Triangle = std::array<Eigen::Vector3d, 3>;

// The largest angle from the optical axis at which the pixels of a level see anything.
double LargestAngle(const engine::LevelRays& rays) {
  double least_z = 1;
  for (int y = 0; y < rays.height_px(); ++y) {
    for (int x = 0; x < rays.width_px(); ++x) {
      if (!rays.At(x, y).isZero()) least_z = std::min<double>(least_z, rays.At(x, y).z());
    }
  }
  return std::acos(least_z);
}

// False if the ball around a triangle lies outside the cone of this angle.
bool MayBeSeen(const Triangle& triangle, double largest_angle) {
  const Eigen::Vector3d center = (triangle[0] + triangle[1] + triangle[2]) / 3;
  double radius = 0;
  for (const Eigen::Vector3d& corner : triangle) radius = std::max(radius, (corner - center).norm());
  const double distance = center.norm();
  return distance <= radius ||
         std::acos(center.z() / distance) <= largest_angle + std::asin(radius / distance);
}

// Enters the distances of the pixels of a level that see a triangle, which is in the camera frame, if nothing
// nearer was entered. A triangle that reaches out of the view of the lens or covers many pixels is divided.
void EnterTriangle(const engine::CameraModel& camera, const engine::LevelRays& rays, const Triangle& triangle,
                   double largest_angle, int divisions_left, cv::Mat* inverse_distance) {
  if (!MayBeSeen(triangle, largest_angle)) return;
  constexpr double kLargest_px = 32, kMargin_px = 2;  // The image of an edge may be curved.
  Eigen::AlignedBox2d box;
  bool inside = true;
  for (const Eigen::Vector3d& corner : triangle) {
    const auto pixel = camera.Project(corner);
    if (pixel) box.extend(engine::LevelFromLevelZero(*pixel, rays.level()));
    inside = inside && pixel;
  }
  if (divisions_left > 0 && (!inside || box.sizes().maxCoeff() > kLargest_px)) {
    const auto& [a, b, c] = triangle;
    const Eigen::Vector3d ab = 0.5 * (a + b), bc = 0.5 * (b + c), ca = 0.5 * (c + a);
    for (const Triangle& part :
         {Triangle{a, ab, ca}, Triangle{ab, b, bc}, Triangle{ca, bc, c}, Triangle{ab, bc, ca}})
      EnterTriangle(camera, rays, part, largest_angle, divisions_left - 1, inverse_distance);
    return;
  }
  if (box.isEmpty()) return;
  const auto begin_of = [](double least) {
    return static_cast<int>(std::ceil(std::max(0.0, least - kMargin_px)));
  };
  const auto end_of = [](double most, int size) {
    return static_cast<int>(std::floor(std::min<double>(size - 1, most + kMargin_px)));
  };
  for (int y = begin_of(box.min().y()); y <= end_of(box.max().y(), rays.height_px()); ++y) {
    for (int x = begin_of(box.min().x()); x <= end_of(box.max().x(), rays.width_px()); ++x) {
      const Eigen::Vector3d ray = rays.At(x, y).cast<double>();
      if (ray.isZero()) continue;
      const auto distance =
          content::IntersectTriangle({Eigen::Vector3d::Zero(), ray}, triangle[0], triangle[1], triangle[2]);
      float& entered = inverse_distance->at<float>(y, x);
      if (distance) entered = std::max(entered, static_cast<float>(1 / *distance));
    }
  }
}

cv::Mat MeshInverseDistances(const engine::SurfaceMesh& mesh, const engine::CameraModel& camera,
                             const engine::LevelRays& rays, const engine::Rigid3& camera_from_map) {
  constexpr int kDivisions = 6;
  const double largest_angle = LargestAngle(rays);
  cv::Mat inverse_distance = cv::Mat::zeros(rays.height_px(), rays.width_px(), CV_32FC1);
  std::vector<Eigen::Vector3d> vertices;
  for (const Eigen::Vector3f& vertex : mesh.vertices)
    vertices.push_back(camera_from_map * Eigen::Vector3d(vertex.cast<double>()));
  for (const auto& [a, b, c] : mesh.triangles)
    EnterTriangle(camera, rays, {vertices[a], vertices[b], vertices[c]}, largest_angle, kDivisions,
                  &inverse_distance);
  return inverse_distance;
}

// A square of one unlit colour in the plane z = depth of the camera, far larger than the image.
content::Scene PlaneBefore(const engine::Rigid3& camera_from_map, double depth) {
  auto model = std::make_shared<content::Model>();
  content::Material material;
  material.base_color = glm::vec4(0, 1, 0, 1);
  material.unlit = true;
  material.double_sided = true;
  model->materials.push_back(material);
  content::Primitive primitive;
  for (const glm::vec2& corner : {glm::vec2(-1, -1), glm::vec2(1, -1), glm::vec2(1, 1), glm::vec2(-1, 1)}) {
    content::Vertex vertex;
    vertex.position = glm::vec3(corner * static_cast<float>(5 * depth), 0);
    primitive.vertices.push_back(vertex);
  }
  primitive.indices = {0, 1, 2, 0, 2, 3};
  primitive.material = 0;
  model->meshes.push_back({"plane", {primitive}});
  content::Node node;
  node.mesh = 0;
  model->nodes.push_back(node);
  model->roots.push_back(0);
  auto asset = std::make_shared<content::Asset>();
  asset->model = std::move(model);
  content::Entity entity;
  entity.kind = content::Entity::Kind::kModel;
  entity.model.asset = asset;
  const engine::Rigid3 map_from_camera = camera_from_map.inverse();
  entity.model.map_from_model.rotation = map_from_camera.rotation;
  entity.model.map_from_model.translation = map_from_camera * Eigen::Vector3d(0, 0, depth);
  content::Scene scene;
  scene.entities.push_back(std::move(entity));
  return scene;
}

// True depths along the optical axis, metres; 0 where there is no surface.
cv::Mat TrueDepthImage(const Simulation& simulation, int frame) {
  const engine::Rigid3 camera_from_world = simulation.world_from_camera(frame).inverse();
  cv::Mat depths = cv::Mat::zeros(simulation.camera().height_px(), simulation.camera().width_px(), CV_64FC1);
  for (int y = 0; y < depths.rows; ++y) {
    for (int x = 0; x < depths.cols; ++x) {
      const auto surface = simulation.SurfaceAt(frame, Eigen::Vector2d(x, y));
      if (surface) depths.at<double>(y, x) = (camera_from_world * *surface).z();
    }
  }
  return depths;
}

double MedianOf(const cv::Mat& depths) {
  std::vector<double> sorted;
  for (auto depth = depths.begin<double>(); depth != depths.end<double>(); ++depth) {
    if (*depth > 0) sorted.push_back(*depth);
  }
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2),
                   sorted.end());
  return sorted[sorted.size() / 2];
}

// Pixels of a mask (0 or 255) that have a neighbour to the right or below of another value.
cv::Mat BorderOf(const cv::Mat& mask) {
  cv::Mat border;
  cv::morphologyEx(mask, border, cv::MORPH_GRADIENT, cv::getStructuringElement(cv::MORPH_CROSS, {3, 3}));
  return border;
}

void AddEdgeErrors(const cv::Mat& depths, double plane_m, const cv::Mat& visible, OcclusionFigures* figures) {
  constexpr double kJump = 1.1;        // Depth on both sides of an edge of an object.
  constexpr double kFarthest_px = 50;  // An edge that was not drawn at all.
  constexpr int kBorder_px = 4;        // Edges at the border of the image leave it.
  cv::Mat distance, inverted = 255 - BorderOf(visible);
  cv::distanceTransform(inverted, distance, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  for (int y = kBorder_px; y + kBorder_px < depths.rows; ++y) {
    for (int x = kBorder_px; x + kBorder_px < depths.cols; ++x) {
      for (const auto& [dx, dy] : {std::pair(1, 0), std::pair(0, 1)}) {
        const auto [near, far] = std::minmax({depths.at<double>(y, x), depths.at<double>(y + dy, x + dx)});
        if (!(near > 0 && near < 0.97 * plane_m && far > 1.03 * plane_m && far > kJump * near)) continue;
        figures->edge_errors_px.push_back(std::min<double>(kFarthest_px, distance.at<float>(y, x)));
      }
    }
  }
}

// Which pixels (0 or 255) of a frame show the scene's content, whose colour is pure green.
cv::Mat VisibleContent(const Simulation& simulation, int frame, const engine::Rigid3& camera_from_map,
                       const content::Scene& scene,
                       const std::shared_ptr<const engine::SurfaceMesh>& surfaces, ui::Renderer* renderer,
                       cv::Mat* image) {
  engine::TrackedFrame tracked;
  tracked.state = engine::TrackingState::kSixDof;
  tracked.camera_from_map = camera_from_map;
  simulation.Render(frame, &tracked.frame.image);
  ui::View view;
  view.tracked = &tracked;
  view.camera = &simulation.camera();
  view.scene = &scene;
  view.surfaces = surfaces;
  view.shadows = false;  // They would darken the video, by which the share of the content is told.
  view.overlay.hud = false;
  renderer->Draw(view);
  cv::Mat drawn;
  renderer->ReadBack(&drawn);
  if (image != nullptr) *image = drawn;
  const cv::Mat& video = tracked.frame.image;
  cv::Mat visible(drawn.size(), CV_8UC1);
  for (int y = 0; y < drawn.rows; ++y) {
    for (int x = 0; x < drawn.cols; ++x) {
      const cv::Vec3d from(video.at<cv::Vec3b>(y, x)), all = cv::Vec3d(0, 255, 0) - from,
                                                       part = cv::Vec3d(drawn.at<cv::Vec3b>(y, x)) - from;
      visible.at<std::uint8_t>(y, x) = part.dot(all) > 0.5 * all.dot(all) ? 255 : 0;
    }
  }
  return visible;
}

// On which side of a plane (a unit normal and its distance from the world's origin) the surface at a pixel
// lies: -1 before it, 1 behind it, 0 near it or not known. `content` receives the point of the plane there.
int SideOf(const Simulation& simulation, int frame, const Eigen::Vector2d& pixel,
           const Eigen::Vector3d& normal, double offset, Eigen::Vector3d* content) {
  const auto surface = simulation.SurfaceAt(frame, pixel);
  if (!surface) return 0;
  const Eigen::Vector3d eye = simulation.world_from_camera(frame).translation, ray = *surface - eye;
  const double share = (offset - normal.dot(eye)) / normal.dot(ray);  // Of the way to the surface.
  if (!(share > 0)) return 0;
  *content = eye + share * ray;
  return share > 1.03 ? -1 : share < 0.97 ? 1 : 0;
}

int FrameOf(const engine::MapSnapshot& map, const std::vector<int>& frames, engine::KeyFrameId id) {
  return frames[static_cast<std::size_t>(map.FindKeyFrame(id) - map.keyframes.data())];
}

std::vector<int> FramesOf(const engine::MapSnapshot& map, const std::vector<int>& frames,
                          const std::vector<engine::KeyFrameId>& ids) {
  std::vector<int> result;
  for (const engine::KeyFrameId id : ids) result.push_back(FrameOf(map, frames, id));
  return result;
}

}  // namespace

DepthFigures MeasureDepthMaps(const Simulation& simulation,
                              const std::shared_ptr<const engine::MapSnapshot>& map,
                              const std::vector<int>& frames, const engine::Sim3& world_from_map) {
  engine::DepthEstimator estimator(map);
  std::map<engine::KeyFrameId, engine::DepthMap> depths;
  for (const engine::DepthViews& views : estimator.views())
    depths.emplace(views.keyframe, *estimator.Estimate(views));
  DepthFigures figures;
  for (const engine::DepthViews& views : estimator.views()) {
    std::vector<const engine::DepthMap*> others;
    for (const engine::KeyFrameId id : views.neighbours) {
      if (const auto found = depths.find(id); found != depths.end()) others.push_back(&found->second);
    }
    const engine::DepthMap depth = estimator.KeepConsistent(depths.at(views.keyframe), others);
    AddDepths(simulation, depth.inverse_distance, depth.rays->level(), FrameOf(*map, frames, views.keyframe),
              FramesOf(*map, frames, views.neighbours), world_from_map.scale, &figures);
  }
  return figures;
}

DepthFigures MeasureMesh(const Simulation& simulation, const std::shared_ptr<const engine::MapSnapshot>& map,
                         const engine::SurfaceMesh& mesh, int level, const std::vector<int>& frames,
                         const engine::Sim3& world_from_map) {
  DepthFigures figures;
  const engine::LevelRays rays(simulation.camera(), level);
  for (const engine::DepthViews& views : engine::ChooseDepthViews(*map, {})) {
    const cv::Mat distances = MeshInverseDistances(mesh, simulation.camera(), rays,
                                                   map->FindKeyFrame(views.keyframe)->camera_from_map);
    AddDepths(simulation, distances, level, FrameOf(*map, frames, views.keyframe),
              FramesOf(*map, frames, views.neighbours), world_from_map.scale, &figures);
  }
  return figures;
}

double OcclusionFigures::MedianEdgeError_px() const {
  if (edge_errors_px.empty()) return std::numeric_limits<double>::quiet_NaN();
  std::vector<double> sorted = edge_errors_px;
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2),
                   sorted.end());
  return sorted[sorted.size() / 2];
}

void AddOcclusion(const Simulation& simulation, int frame, const engine::Rigid3& camera_from_map,
                  double map_units_per_metre, const std::vector<int>& keyframes,
                  const std::shared_ptr<const engine::SurfaceMesh>& surfaces, ui::Renderer* renderer,
                  OcclusionFigures* figures, cv::Mat* image) {
  const cv::Mat depths = TrueDepthImage(simulation, frame);
  const double plane_m = MedianOf(depths);
  const content::Scene scene = PlaneBefore(camera_from_map, plane_m * map_units_per_metre);
  const cv::Mat visible =
      VisibleContent(simulation, frame, camera_from_map, scene, surfaces, renderer, image);
  for (int y = 0; y < depths.rows; ++y) {
    for (int x = 0; x < depths.cols; ++x) {
      const double depth_m = depths.at<double>(y, x);
      if (depth_m <= 0 || std::abs(depth_m / plane_m - 1) < 0.03) continue;
      const auto surface = simulation.SurfaceAt(frame, Eigen::Vector2d(x, y));
      if (!surface || CountSeeing(simulation, keyframes, *surface, 2) < 2) continue;
      const bool is_drawn = visible.at<std::uint8_t>(y, x) != 0;
      if (depth_m < plane_m) {
        ++figures->behind;
        figures->hidden += !is_drawn;
      } else {
        ++figures->before;
        figures->wrongly_hidden += !is_drawn;
      }
    }
  }
  AddEdgeErrors(depths, plane_m, visible, figures);
}

void AddFlicker(const Simulation& simulation, int frame, const std::array<engine::Rigid3, 2>& camera_from_map,
                double map_units_per_metre, const std::shared_ptr<const engine::SurfaceMesh>& surfaces,
                ui::Renderer* renderer, OcclusionFigures* figures) {
  const double plane_m = MedianOf(TrueDepthImage(simulation, frame));
  const content::Scene scene = PlaneBefore(camera_from_map[0], plane_m * map_units_per_metre);
  std::array<cv::Mat, 2> visible;
  for (int i = 0; i < 2; ++i)
    visible[i] =
        VisibleContent(simulation, frame + i, camera_from_map[i], scene, surfaces, renderer, nullptr);
  const engine::Rigid3 world_from_camera = simulation.world_from_camera(frame);
  const Eigen::Vector3d normal = world_from_camera.rotation * Eigen::Vector3d::UnitZ();
  const double offset = normal.dot(world_from_camera.translation) + plane_m;
  const cv::Rect image(1, 1, visible[0].cols - 2, visible[0].rows - 2);
  for (int y = 0; y < visible[1].rows; ++y) {
    for (int x = 0; x < visible[1].cols; ++x) {
      Eigen::Vector3d content, before;
      const int side = SideOf(simulation, frame + 1, {x, y}, normal, offset, &content);
      if (side == 0) continue;
      const auto seen = simulation.camera().Project(world_from_camera.inverse() * content);
      if (!seen) continue;
      const cv::Point was(static_cast<int>(std::lround(seen->x())), static_cast<int>(std::lround(seen->y())));
      if (!image.contains(was) || SideOf(simulation, frame, *seen, normal, offset, &before) != side) continue;
      ++figures->compared;
      const cv::Mat around = visible[0](cv::Rect(was.x - 1, was.y - 1, 3, 3));
      const int shown = cv::countNonZero(around);
      figures->changed += visible[1].at<std::uint8_t>(y, x) != 0 ? shown == 0 : shown == 9;
    }
  }
}

}  // namespace docent::app
