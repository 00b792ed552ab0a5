// SPDX-License-Identifier: Apache-2.0
// Prints sizes, alignments and offsets of public types, which must not depend on the machine flags of a
// program, and exchanges Eigen objects with the library.
#include <docent/library.h>
#include <docent/renderer.h>
#include <docent/version.h>
#include <docent/video.h>

#include <cstddef>
#include <cstdio>
#include <vector>

using namespace docent;

#define PRINT(type) std::printf("%s: %zu, aligned %zu\n", #type, sizeof(type), alignof(type))
#define PRINT_OFFSET(type, field)                                                                       \
  do {                                                                                                  \
    static const type object{};                                                                         \
    std::printf("%s.%s: at %td\n", #type, #field,                                                       \
                reinterpret_cast<const char*>(&object.field) - reinterpret_cast<const char*>(&object)); \
  } while (false)

int main() {
  std::printf("version %s\n", kVersion);
  PRINT(Eigen::Vector4d);
  PRINT(Eigen::Matrix4d);
  PRINT(Eigen::Quaterniond);
  PRINT(engine::Rotation3);
  PRINT(engine::Rigid3);
  PRINT(engine::Sim3);
  PRINT(engine::CameraModel);
  PRINT(engine::Frame);
  PRINT(engine::TrackedFrame);
  PRINT(engine::KeyFrame);
  PRINT(engine::MapPoint);
  PRINT(engine::MapSnapshot);
  PRINT(engine::SystemOptions);
  PRINT(engine::SystemEvent);
  PRINT(engine::System);
  PRINT(maps::MapRecord);
  PRINT(maps::StoredMap);
  PRINT(content::Entity);
  PRINT(content::SurfaceResult);
  PRINT(ui::View);
  PRINT(app::SourceInfo);
  PRINT_OFFSET(engine::TrackedFrame, camera_from_map);
  PRINT_OFFSET(engine::TrackedFrame, covariance);
  PRINT_OFFSET(engine::TrackedFrame, matches);
  PRINT_OFFSET(engine::MapPoint, normal);
  PRINT_OFFSET(engine::KeyFrame, features);
  PRINT_OFFSET(content::Entity, signpost);

  // Values that cross the border in both directions.
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 40; ++i) points.emplace_back(0.1 * (i % 8), 0.1 * (i / 8), 2.0);
  const content::SurfaceResult surface =
      content::FindSurface(points, Eigen::Vector3d::Zero(), Eigen::Vector3d(0.15, 0.1, 1.0));
  if (!surface.hit) return 1;
  std::printf("surface %.6f %.6f %.6f\n", surface.hit->point.x(), surface.hit->point.y(),
              surface.hit->point.z());
  std::vector<Eigen::Vector3d> moved;
  for (const Eigen::Vector3d& point : points)
    moved.push_back(2.0 * point + Eigen::Vector3d(1, 2, 3) + 0.1 * point.cwiseAbs2());
  const auto similarity = engine::AlignSim3(moved, points);
  if (!similarity) return 1;
  std::printf("scale %.6f\n", similarity->scale);
}
