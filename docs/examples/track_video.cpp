// SPDX-License-Identifier: Apache-2.0
// Tracks a video, a folder with a recording, a device, or the simulator (sim:museum), and prints the pose of
// each image in TUM format: seconds, position and quaternion, map from camera.
#include <docent/system.h>
#include <docent/video.h>

#include <cstdio>
#include <exception>
#include <memory>

using namespace docent;

int main(int argc, char** argv) try {
  if (argc != 2 && argc != 3) {
    std::fprintf(stderr, "Usage: track_video CAMERA [CALIBRATION]\n");
    return 2;
  }
  app::QuietDecoders();
  const std::unique_ptr<app::FrameSource> source = app::OpenCamera(argv[1]);
  const app::SourceInfo& info = source->info();
  auto path = info.calibration_path;  // found beside the images
  if (argc == 3) path = argv[2];
  if (!path && !info.known_camera) throw Error("There is no calibration: give a file.");
  const auto camera =
      std::make_shared<const engine::CameraModel>(path ? app::ReadCalibration(*path) : *info.known_camera);

  engine::SystemOptions options;
  options.threaded = info.live;   // of a recording, every image is tracked and mapped in turn
  options.tracker.hybrid = true;  // rotations about the camera are tracked too, in panorama maps
  engine::System system(options, {camera});
  system.StartMap(/*key=*/1, /*camera=*/0);

  std::uint64_t map = 0;
  engine::Frame frame;
  while (source->Next(&frame)) {
    app::CheckImageSize(*camera, frame.image.cols, frame.image.rows, argv[1], "the calibration");
    const engine::TrackedFrame tracked = system.Process(frame);
    system.TakeEvents();  // what happened in the system; this program does not show it
    if (!engine::HasPose(tracked.state)) continue;
    if (tracked.map_key != map) {  // each map has coordinates of its own
      map = tracked.map_key;
      std::printf("# map %llu\n", static_cast<unsigned long long>(map));
    }
    const engine::Rigid3 map_from_camera = tracked.camera_from_map.inverse();
    const Eigen::Vector3d& t = map_from_camera.translation;
    const Eigen::Quaterniond& q = map_from_camera.rotation.quaternion();
    std::printf("%.9f %.9g %.9g %.9g %.9g %.9g %.9g %.9g\n", ToSeconds(frame.time), t.x(), t.y(), t.z(),
                q.x(), q.y(), q.z(), q.w());
  }
  system.Finish();
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
