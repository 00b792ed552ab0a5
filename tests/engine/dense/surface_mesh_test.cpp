// SPDX-License-Identifier: Apache-2.0
#include "engine/dense/surface_mesh.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <memory>
#include <vector>

#include "engine/base/error.h"
#include "engine/dense/densification.h"
#include "engine/dense/distance_field.h"
#include "engine/dense/mesh_simplification.h"
#include "tests/engine/rendered_world.h"

namespace docent::engine {
namespace {

using testing_world::CameraAt;
using testing_world::World;

constexpr std::size_t kManyBlocks = 100'000;

// The exact depth map of a plane z = distance in the map.
DepthMap DepthOfPlane(const Rigid3& camera_from_map, double distance) {
  DepthMap depth;
  depth.camera_from_map = camera_from_map;
  depth.rays = std::make_shared<LevelRays>(*testing_world::PinholeCamera(160, 120), 0);
  depth.inverse_distance = cv::Mat::zeros(120, 160, CV_32FC1);
  const Rigid3 map_from_camera = camera_from_map.inverse();
  for (int y = 0; y < 120; ++y) {
    for (int x = 0; x < 160; ++x) {
      const Eigen::Vector3d ray = map_from_camera.rotation * depth.rays->At(x, y).cast<double>();
      depth.inverse_distance.at<float>(y, x) =
          static_cast<float>(ray.z() / (distance - map_from_camera.translation.z()));
    }
  }
  return depth;
}

Eigen::Vector3f NormalOf(const SurfaceMesh& mesh, const std::array<std::uint32_t, 3>& t) {
  return (mesh.vertices[t[1]] - mesh.vertices[t[0]]).cross(mesh.vertices[t[2]] - mesh.vertices[t[0]]);
}

double AreaOf(const SurfaceMesh& mesh) {
  double area = 0;
  for (const auto& triangle : mesh.triangles) area += 0.5 * NormalOf(mesh, triangle).norm();
  return area;
}

// A square of 2 x 2 units in squares of this many along each side, with heights.
template <typename Height>
SurfaceMesh Grid(int squares, const Height& height) {
  SurfaceMesh mesh;
  for (int y = 0; y <= squares; ++y) {
    for (int x = 0; x <= squares; ++x) {
      const double u = 2.0 * x / squares - 1, v = 2.0 * y / squares - 1;
      mesh.vertices.emplace_back(u, v, height(u, v));
    }
  }
  for (int y = 0; y < squares; ++y) {
    for (int x = 0; x < squares; ++x) {
      const auto at = static_cast<std::uint32_t>(y * (squares + 1) + x);
      const auto below = at + static_cast<std::uint32_t>(squares) + 1;
      mesh.triangles.push_back({at, at + 1, below});
      mesh.triangles.push_back({at + 1, below + 1, below});
    }
  }
  return mesh;
}

TEST(DistanceField, HasItsSurfaceWhereTheDepthMapsHaveIt) {
  constexpr double kVoxel = 0.05, kDistance = 2.03;
  DistanceField field(kVoxel, 4 * kVoxel);
  for (const double x : {-0.2, 0.0, 0.2}) {
    ASSERT_TRUE(field.Add(DepthOfPlane(CameraAt({x, 0, 0}, {0, 10 * x, 0}), kDistance), kManyBlocks));
  }
  const SurfaceMesh mesh = field.ExtractSurface(3);
  ASSERT_GT(mesh.triangles.size(), 500U);
  for (const Eigen::Vector3f& vertex : mesh.vertices) EXPECT_NEAR(vertex.z(), kDistance, 0.1 * kVoxel);
  // The cameras see the plane from the side of smaller z.
  for (const auto& triangle : mesh.triangles) EXPECT_LT(NormalOf(mesh, triangle).z(), 0);
  EXPECT_TRUE(field.ExtractSurface(4).empty()) << "no voxel was measured four times";
}

TEST(DistanceField, TakesTheMeanOfTheDepthMaps) {
  constexpr double kVoxel = 0.05;
  DistanceField field(kVoxel, 4 * kVoxel);
  for (const double distance : {1.98, 2.02, 2.02, 1.98})
    ASSERT_TRUE(field.Add(DepthOfPlane(CameraAt({0, 0, 0}), distance), kManyBlocks));
  for (const Eigen::Vector3f& vertex : field.ExtractSurface(4).vertices)
    EXPECT_NEAR(vertex.z(), 2.0, 0.1 * kVoxel);
}

TEST(DistanceField, ReachesToTheBorderOfWhatWasMeasured) {
  constexpr double kVoxel = 0.05, kDistance = 2.03;
  DistanceField field(kVoxel, 4 * kVoxel);
  const DepthMap depth = DepthOfPlane(CameraAt({0, 0, 0}), kDistance);
  ASSERT_TRUE(field.Add(depth, kManyBlocks));
  const SurfaceMesh mesh = field.ExtractSurface(1);
  // The rays of the pixels in the corners, on the plane.
  const auto on_plane = [&](int x, int y) {
    const Eigen::Vector3f ray = depth.rays->At(x, y);
    return Eigen::Vector2d((ray.head<2>() / ray.z()).cast<double>() * kDistance);
  };
  const Eigen::Vector2d size = on_plane(159, 119) - on_plane(0, 0);
  // Voxels are on a grid, so that one row of them may be missing at each side, half of it on average.
  EXPECT_GT(AreaOf(mesh), (size.x() - 2 * kVoxel) * (size.y() - 2 * kVoxel));
  EXPECT_LT(AreaOf(mesh), (size.x() + kVoxel) * (size.y() + kVoxel));
}

TEST(DistanceField, RefusesMoreBlocksThanAllowed) {
  DistanceField field(0.02, 0.08);
  EXPECT_FALSE(field.Add(DepthOfPlane(CameraAt({0, 0, 0}), 2), 10));
}

TEST(MeshSimplification, LeavesFewTrianglesOfAPlaneAndItsWholeArea) {
  const SurfaceMesh plane = Grid(40, [](double u, double v) { return 0.3 * u - 0.2 * v; });
  const SurfaceMesh simple = SimplifyMesh(plane, 1e-4, plane.triangles.size());
  EXPECT_LT(simple.triangles.size(), plane.triangles.size() / 20);
  EXPECT_NEAR(AreaOf(simple), AreaOf(plane), 1e-3);
}

TEST(MeshSimplification, MovesTheSurfaceLessThanAllowed) {
  constexpr double kMostMotion = 0.01;
  const auto height = [](double u, double v) { return 0.5 * std::cos(2 * u) * std::cos(1.5 * v); };
  const SurfaceMesh curved = Grid(60, height);
  const SurfaceMesh simple = SimplifyMesh(curved, kMostMotion, curved.triangles.size());
  EXPECT_LT(simple.triangles.size(), curved.triangles.size() / 5);
  EXPECT_GT(simple.triangles.size(), 20U);
  for (const auto& t : simple.triangles) {
    const Eigen::Vector3f middle =
        (simple.vertices[t[0]] + simple.vertices[t[1]] + simple.vertices[t[2]]) / 3;
    EXPECT_NEAR(middle.z(), height(middle.x(), middle.y()), 3 * kMostMotion);
  }
}

TEST(MeshSimplification, ReachesTheNumberOfTriangles) {
  const SurfaceMesh curved =
      Grid(60, [](double u, double v) { return 0.5 * std::cos(2 * u) * std::cos(1.5 * v); });
  const SurfaceMesh simple = SimplifyMesh(curved, 0, 500);
  EXPECT_LE(simple.triangles.size(), 500U);
  EXPECT_GT(simple.triangles.size(), 450U);
}

// Two squares of 2 x 2 units that cross along the y axis.
SurfaceMesh Crossing(int squares) {
  SurfaceMesh mesh = Grid(squares, [](double, double) { return 0.0; });
  const SurfaceMesh flat = mesh;
  std::vector<std::uint32_t> index;
  for (const Eigen::Vector3f& vertex : flat.vertices) {
    index.push_back(static_cast<std::uint32_t>(mesh.vertices.size()));
    if (vertex.x() == 0) {
      index.back() = static_cast<std::uint32_t>(index.size() - 1);
    } else {
      mesh.vertices.emplace_back(0, vertex.y(), vertex.x());
    }
  }
  for (const auto& [a, b, c] : flat.triangles) mesh.triangles.push_back({index[a], index[b], index[c]});
  return mesh;
}

TEST(MeshSimplification, IsNotHeldUpBySheetsThatShareAnEdgeOnceTheyAreCut) {
  const SurfaceMesh crossing = Crossing(20);
  const SurfaceMesh cut = CutSharedEdges(crossing);
  EXPECT_EQ(cut.triangles.size(), crossing.triangles.size());
  EXPECT_NEAR(AreaOf(cut), AreaOf(crossing), 1e-6);
  // The 21 vertices on the line are those of four halves now.
  EXPECT_EQ(cut.vertices.size(), crossing.vertices.size() + 3 * 21);
  constexpr std::size_t kFew = 16;  // Four halves, each of which two triangles can show.
  EXPECT_LE(SimplifyMesh(cut, 1e-4, 1).triangles.size(), kFew);
  EXPECT_GT(SimplifyMesh(crossing, 1e-4, 1).triangles.size(), 2 * kFew) << "so that cutting is needed";
}

TEST(MeshSimplification, CutsNothingOfASurfaceWithoutSharedEdges) {
  const SurfaceMesh curved =
      Grid(20, [](double u, double v) { return 0.5 * std::cos(2 * u) * std::cos(1.5 * v); });
  const SurfaceMesh cut = CutSharedEdges(curved);
  EXPECT_EQ(cut.vertices.size(), curved.vertices.size());
  EXPECT_EQ(cut.triangles.size(), curved.triangles.size());
}

TEST(MeshSimplification, RemovesSmallPiecesOnly) {
  SurfaceMesh mesh = Grid(10, [](double, double) { return 0.0; });
  const std::size_t large = mesh.triangles.size();
  const auto next = static_cast<std::uint32_t>(mesh.vertices.size());
  for (const double x : {5.0, 6.0, 5.5}) mesh.vertices.emplace_back(x, x * x, 0);
  mesh.triangles.push_back({next, next + 1, next + 2});
  const SurfaceMesh kept = RemoveSmallPieces(mesh, 2);
  EXPECT_EQ(kept.triangles.size(), large);
  EXPECT_EQ(kept.vertices.size(), next);
}

class Densification : public ::testing::Test {
 protected:
  static std::shared_ptr<const MapSnapshot> MakeMap() {
    return testing_world::TrueMap(
               World(), testing_world::PinholeCamera(160, 120),
               {CameraAt({0, 0, 0}), CameraAt({0.4, 0, 0}, {0, -5, 0}), CameraAt({-0.4, 0.05, 0}, {0, 5, 2})})
        .Snapshot();
  }
  const std::shared_ptr<const MapSnapshot> map_ = MakeMap();
};

TEST_F(Densification, MakesAMeshOfTheSurfaces) {
  std::vector<std::size_t> done;
  DensificationOptions options;
  options.voxel_size = 0.015;
  const auto result =
      DensifyMap(map_, options, [&](std::size_t count, std::size_t) { done.push_back(count); });
  ASSERT_TRUE(result);
  EXPECT_EQ(done, (std::vector<std::size_t>{1, 2, 3}));
  ASSERT_FALSE(result->mesh.empty());
  // Of the area, because the vertices that simplification leaves are at edges, where images of 160 pixels are
  // the least exact. The voxels are nearly as large as what counts as near, and surfaces may end one too
  // late.
  double near = 0;
  for (const auto& t : result->mesh.triangles) {
    const auto& vertices = result->mesh.vertices;
    const Eigen::Vector3f middle = (vertices[t[0]] + vertices[t[1]] + vertices[t[2]]) / 3;
    if (World().DistanceToSurface(middle.cast<double>()) < 0.05)
      near += 0.5 * static_cast<double>(NormalOf(result->mesh, t).norm());
  }
  EXPECT_GT(near, 11) << "measured: 11.7";
  EXPECT_GT(near, 0.84 * AreaOf(result->mesh)) << "measured: 0.868";
}

TEST_F(Densification, StopsWhenAsked) {
  std::atomic<bool> interrupt = false;
  EXPECT_FALSE(DensifyMap(
      map_, {}, [&](std::size_t, std::size_t) { interrupt = true; }, &interrupt));
}

TEST_F(Densification, KnowsWhetherAMeshStillFitsItsMap) {
  std::vector<MeshKeyFrame> used;
  for (const KeyFrame& keyframe : map_->keyframes) used.push_back({keyframe.id, keyframe.camera_from_map});
  EXPECT_EQ(StateOf(used, *map_), MeshState::kCurrent);
  MapSnapshot changed = *map_;
  changed.keyframes[1].camera_from_map.translation.x() += 0.001;
  EXPECT_EQ(StateOf(used, changed), MeshState::kCurrent) << "bundle adjustment moves keyframes a little";
  changed.keyframes[1].camera_from_map.translation.x() += 0.2;
  EXPECT_EQ(StateOf(used, changed), MeshState::kOutOfDate);
  used.pop_back();
  EXPECT_EQ(StateOf(used, *map_), MeshState::kExtended);
  MapSnapshot culled = *map_;
  culled.keyframes.erase(culled.keyframes.begin());
  EXPECT_EQ(StateOf(used, culled), MeshState::kOutOfDate);
}

TEST_F(Densification, HasNoMeshOfAMapWithoutDepth) {
  const auto result = DensifyMap(std::make_shared<MapSnapshot>());
  ASSERT_TRUE(result);
  EXPECT_TRUE(result->mesh.empty());
}

TEST_F(Densification, RefusesOptionsOutOfRange) {
  DensificationOptions options;
  options.voxel_size = 0;
  EXPECT_THROW(DensifyMap(map_, options), Error);
}

}  // namespace
}  // namespace docent::engine
