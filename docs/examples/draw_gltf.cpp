// SPDX-License-Identifier: Apache-2.0
// Tracks a recording, places a glTF model on the surface in the middle of the image once there is a map, and
// draws it over each image through the lens of the camera, without a display. Writes every fifth drawn image
// to the folder as SECONDS.png.
#include <docent/renderer.h>
#include <docent/video.h>

#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <memory>
#include <opencv2/imgcodecs.hpp>
#include <optional>
#include <vector>

using namespace docent;

namespace {

// The surface of the map that is seen at the pixel; empty where there are too few points.
std::optional<content::SurfaceHit> SurfaceAt(const engine::TrackedFrame& frame,
                                             const engine::CameraModel& camera,
                                             const Eigen::Vector2d& pixel) {
  std::vector<Eigen::Vector3d> points;
  for (const engine::MapPoint& point : frame.map->points) {
    if (point.infinite()) continue;
    const auto seen = camera.Project(frame.camera_from_map * point.position());
    if (seen && camera.IsInside(*seen)) points.push_back(point.position());
  }
  const auto ray = camera.Unproject(pixel);
  if (!ray) return std::nullopt;
  const engine::Rigid3 map_from_camera = frame.camera_from_map.inverse();
  return content::FindSurface(points, map_from_camera.translation, map_from_camera.rotation * *ray).hit;
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 4) {
    std::fprintf(stderr, "Usage: draw_gltf RECORDING MODEL.gltf FOLDER\n");
    return 2;
  }
  app::QuietDecoders();
  const auto source = app::OpenCamera(argv[1]);
  if (!source->info().calibration_path) throw Error("The recording has no calibration file.");
  const auto camera =
      std::make_shared<const engine::CameraModel>(app::ReadCalibration(*source->info().calibration_path));
  const auto asset = std::make_shared<const content::Asset>(content::ImportAsset(argv[2]));
  std::filesystem::create_directories(argv[3]);

  engine::SystemOptions options;
  options.threaded = false;
  engine::System system(options, {camera});
  system.StartMap(1, 0);

  ui::OffscreenContext context;  // before the renderer, which draws with it
  ui::Renderer renderer;
  content::Scene scene;
  std::uint64_t map = 0;  // the one that the model was placed in
  int drawn = 0;
  cv::Mat image;
  engine::Frame frame;
  while (source->Next(&frame)) {
    app::CheckImageSize(*camera, frame.image.cols, frame.image.rows, argv[1], "its calibration");
    const engine::TrackedFrame tracked = system.Process(frame);
    system.TakeEvents();
    if (!engine::HasPose(tracked.state) || system.IsProvisional(tracked.map_key)) continue;
    if (tracked.map_key != map) {
      const Eigen::Vector2d middle(0.5 * camera->width_px(), 0.5 * camera->height_px());
      const auto hit = SurfaceAt(tracked, *camera, middle);
      if (!hit) continue;
      map = tracked.map_key;
      const engine::Rigid3 map_from_camera = tracked.camera_from_map.inverse();
      const double distance = (hit->point - map_from_camera.translation).norm();
      const Eigen::Vector3d up = map_from_camera.rotation * -Eigen::Vector3d::UnitY();  // of the image
      content::Entity entity;
      entity.name = "model";
      entity.kind = content::Entity::Kind::kModel;
      entity.model.asset = asset;
      const double size = (asset->model->bounds_max.y - asset->model->bounds_min.y);  // metres
      entity.model.map_from_model =
          content::UprightPose(hit->point, hit->normal, up, /*yaw=*/0.5, /*scale=*/0.2 * distance / size);
      scene.entities = {entity};
    }
    if (drawn++ % 5 != 0) continue;
    ui::View view;
    view.tracked = &tracked;
    view.camera = camera.get();
    view.scene = &scene;
    view.animation_seconds = ToSeconds(frame.time);
    view.overlay.hud = false;
    renderer.Draw(view);
    renderer.ReadBack(&image);
    char name[64];
    std::snprintf(name, sizeof name, "%.9f.png", ToSeconds(frame.time));
    if (!cv::imwrite(std::filesystem::path(argv[3]) / name, image))
      throw Error("An image cannot be written.");
  }
  system.Finish();
  std::printf("drew over %d images\n", drawn);
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
