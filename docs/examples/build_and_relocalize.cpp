// SPDX-License-Identifier: Apache-2.0
// Builds a map from the even images of a recording, saves it to a library file, and then relocalizes each
// tenth odd image in it, alone and from nothing. Prints these poses in TUM format (map from camera), then
// their number.
#include <docent/library.h>
#include <docent/video.h>

#include <cstdint>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <memory>
#include <string>

using namespace docent;
using Camera = std::shared_ptr<const engine::CameraModel>;

namespace {

// Saves the newest snapshot of the map that the camera is in at the end.
void BuildMap(const std::string& recording, const Camera& camera, maps::Library* library) {
  engine::SystemOptions options;
  options.threaded = false;
  // A map whose depth turns out to be false is discarded, and another one is started under a new key.
  options.new_map_key = [library] { return library->NewKey(); };
  engine::System system(options, {camera});
  system.StartMap(library->NewKey(), 0);

  maps::MapRecord record;
  record.name = "Recording";
  const auto source = app::OpenCamera(recording);
  engine::Frame frame;
  while (source->Next(&frame)) {
    app::CheckImageSize(*camera, frame.image.cols, frame.image.rows, recording, "its calibration");
    if (frame.index % 2 != 0) continue;
    system.Process(frame);
    for (const engine::SystemEvent& event : system.TakeEvents()) {
      if (const auto* updated = std::get_if<engine::MapUpdated>(&event.what)) {
        record.key = event.map;
        record.snapshot = updated->snapshot;
      }
    }
  }
  system.Finish();
  if (!record.snapshot || !record.snapshot->HasFinitePoints()) throw Error("No map could be built.");
  library->Save(record);
  std::fprintf(stderr, "saved %zu keyframes, %zu points\n", record.snapshot->keyframes.size(),
               record.snapshot->points.size());
}

void Relocalize(const std::string& recording, const Camera& camera, const maps::Library& library) {
  engine::SystemOptions options;
  options.extend_maps = false;  // the maps are only read
  engine::System system(options, {camera});
  std::uint64_t key = 0;
  for (const maps::MapInfo& info : library.List()) {
    const maps::StoredMap map = library.Load(info.key);
    system.AddMap(info.key, map.snapshot, engine::MapPermissions());
    system.place_index().SetMap(info.key, map.snapshot);
    key = info.key;
  }

  int tried = 0, found = 0;
  const auto source = app::OpenCamera(recording);
  engine::Frame frame;
  while (source->Next(&frame)) {
    if (frame.index % 10 != 1) continue;
    system.EnterMap(key, 0);  // the camera forgets where it was, and searches this map
    const engine::TrackedFrame tracked = system.Process(frame);
    ++tried;
    if (!engine::HasPose(tracked.state)) continue;
    ++found;
    const engine::Rigid3 pose = tracked.camera_from_map.inverse();
    const Eigen::Quaterniond& q = pose.rotation.quaternion();
    std::printf("%.9f %.9g %.9g %.9g %.9g %.9g %.9g %.9g\n", ToSeconds(frame.time), pose.translation.x(),
                pose.translation.y(), pose.translation.z(), q.x(), q.y(), q.z(), q.w());
  }
  std::printf("# relocalized %d of %d\n", found, tried);
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 3) {
    std::fprintf(stderr, "Usage: build_and_relocalize RECORDING LIBRARY.docent\n");
    return 2;
  }
  app::QuietDecoders();
  const auto calibration = app::FindCalibration(argv[1]);
  if (!calibration) throw Error("The recording has no calibration file.");
  const auto camera = std::make_shared<const engine::CameraModel>(app::ReadCalibration(*calibration));
  {
    auto library = maps::Library::Open(argv[2], maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
    BuildMap(argv[1], camera, &library);
  }
  Relocalize(argv[1], camera, maps::Library::Open(argv[2], maps::Access::kReadOnly));
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
