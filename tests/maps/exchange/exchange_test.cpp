// SPDX-License-Identifier: Apache-2.0
#include "maps/exchange/exchange.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <opencv2/core.hpp>
#include <sstream>

#include "engine/base/error.h"
#include "maps/exchange/colmap_model.h"
#include "maps/exchange/view_from_above.h"
#include "tests/maps/map_samples.h"

namespace docent::maps {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST(Exchange, ExportAndImportCopyAMapCompletely) {
  const TemporaryFolder folder;
  Library museum = OpenToWrite(folder / "museum.docent");
  const auto desk = MakeSampleMap(1, {.keyframes = 6});
  const auto scene = MakeSampleScene(3, 2);
  museum.Save({museum.NewKey(), "Door", Policy::kOpen, MakeSampleMap(2), nullptr});
  const std::uint64_t key = museum.NewKey();
  museum.Save({key, "Desk", Policy::kBounded, desk, scene});
  ExportMap(museum, key, folder / "desk.docent");
  EXPECT_THAT(ErrorOf([&] { ExportMap(museum, key, folder / "desk.docent"); }), HasSubstr("exists already"));

  Library other = OpenToWrite(folder / "other.docent");
  const Library exported = OpenToRead(folder / "desk.docent");
  ASSERT_EQ(exported.List().size(), 1u);
  EXPECT_EQ(ImportMaps(exported, folder / "other.docent").maps.at(0).name, "Desk");
  EXPECT_EQ(ImportMaps(exported, folder / "other.docent").maps.at(0).name, "Desk (2)");
  EXPECT_EQ(ImportMaps(exported, folder / "other.docent").maps.at(0).name, "Desk (3)");
  for (const char* name : {"Desk", "Desk (2)", "Desk (3)"}) {
    const StoredMap stored = other.Load(other.FindByName(name).key);
    EXPECT_EQ(FirstDifference(*stored.snapshot, *desk), "");
    EXPECT_EQ(FirstDifference(stored.scene, *scene), "");
    EXPECT_EQ(stored.info.policy, Policy::kBounded);
    EXPECT_EQ(stored.info.bounds, museum.Find(key).bounds);
  }
  EXPECT_THAT(other.Verify(), IsEmpty());
}

TEST(Exchange, ALongNameIsCutBetweenCharactersToFitItsLimit) {
  const TemporaryFolder folder;
  Library museum = OpenToWrite(folder / "museum.docent");
  std::string name;
  while (name.size() + 2 <= kMaxMapNameBytes) name += "\xC3\xBC";
  museum.Save({museum.NewKey(), name, Policy::kOpen, nullptr, nullptr});
  ExportMap(museum, 1, folder / "one.docent");
  const std::string renamed =
      ImportMaps(OpenToRead(folder / "one.docent"), folder / "museum.docent").maps.at(0).name;
  EXPECT_EQ(renamed, name.substr(0, 196) + " (2)");
}

TEST(Exchange, NothingIsImportedFromADamagedLibrary) {
  const TemporaryFolder folder;
  {
    Library museum = OpenToWrite(folder / "museum.docent");
    for (const char* name : {"Desk", "Door"})
      museum.Save({museum.NewKey(), name, Policy::kOpen, MakeSampleMap(1), nullptr});
  }
  Bytes bytes = ReadWholeFile(folder / "museum.docent");
  for (std::size_t i = 2 * bytes.size() / 3; i < bytes.size(); i += 64) bytes[i] ^= 0x55;
  WriteWholeFile(folder / "museum.docent", bytes);
  EXPECT_THROW(ImportMaps(OpenToRead(folder / "museum.docent"), folder / "other.docent"), Error);
  EXPECT_EQ(FilesIn(folder.path()), "museum.docent");
}

TEST(Exchange, AFailedExportLeavesNoFile) {
  const TemporaryFolder folder;
  Library museum = OpenToWrite(folder / "museum.docent");
  EXPECT_THROW(ExportMap(museum, 77, folder / "desk.docent"), Error);
  EXPECT_THROW(ExportMap(museum, 77, folder / "nowhere/desk.docent"), Error);
  EXPECT_EQ(FilesIn(folder.path()).find("desk"), std::string::npos);
}

// The lines of a COLMAP file without comments.
std::vector<std::istringstream> LinesOf(const std::string& text) {
  std::vector<std::istringstream> lines;
  std::istringstream file(text);
  for (std::string line; std::getline(file, line);) {
    if (!line.starts_with('#')) lines.emplace_back(line);
  }
  return lines;
}

// An independent implementation of OpenCV's and COLMAP's formulas: the pixel of a point in the camera frame.
Eigen::Vector2d ProjectAsColmap(const std::string& model, const std::vector<double>& p,
                                const Eigen::Vector3d& point) {
  const double u = point.x() / point.z(), v = point.y() / point.z(), r2 = u * u + v * v, r = std::sqrt(r2);
  Eigen::Vector2d distorted;
  if (model == "FOV") {
    const double factor = std::atan(r * 2 * std::tan(p[4] / 2)) / (r * p[4]);
    distorted = {u * factor, v * factor};
  } else {
    const double k3 = model == "FULL_OPENCV" ? p[8] : 0;
    const double radial = 1 + p[4] * r2 + p[5] * r2 * r2 + k3 * r2 * r2 * r2;
    distorted = {u * radial + 2 * p[6] * u * v + p[7] * (r2 + 2 * u * u),
                 v * radial + 2 * p[7] * u * v + p[6] * (r2 + 2 * v * v)};
  }
  return {p[0] * distorted.x() + p[2], p[1] * distorted.y() + p[3]};
}

TEST(ColmapModel, MatchesTheMapInColmapsConventions) {
  const auto map = MakeSampleMap(5, {.keyframes = 6, .points = 60});
  const ColmapModel model = MakeColmapModel(*map);
  struct Camera {
    std::string model;
    std::vector<double> parameters;
  };
  std::map<int, Camera> cameras;
  for (auto& line : LinesOf(model.cameras)) {
    int id = 0, width = 0, height = 0;
    Camera camera;
    line >> id >> camera.model >> width >> height;
    EXPECT_EQ(width, 96);
    EXPECT_EQ(height, 80);
    for (double number = 0; line >> number;) camera.parameters.push_back(number);
    cameras[id] = camera;
  }
  ASSERT_EQ(cameras.size(), 2u);

  std::map<int, Eigen::Vector3d> points;
  std::map<std::pair<int, int>, int> track_of;  // From (image, index) to the point.
  for (auto& line : LinesOf(model.points3d)) {
    int id = 0, red = 0, green = 0, blue = 0;
    double error = 0;
    Eigen::Vector3d position;
    line >> id >> position.x() >> position.y() >> position.z() >> red >> green >> blue >> error;
    points[id] = position;
    EXPECT_EQ(position, map->FindPoint(static_cast<engine::MapPointId>(id - 1))->position());
    for (int image = 0, index = 0; line >> image >> index;) track_of[{image, index}] = id;
  }
  EXPECT_EQ(points.size(), 45u) << "three of four points are finite";

  auto lines = LinesOf(model.images);
  ASSERT_EQ(lines.size(), 2 * map->keyframes.size());
  std::size_t observations = 0, in_tracks = 0, projected = 0;
  for (std::size_t i = 0; i < map->keyframes.size(); ++i) {
    const engine::KeyFrame& keyframe = map->keyframes[i];
    int id = 0, camera_id = 0;
    Eigen::Quaterniond q;
    Eigen::Vector3d t;
    std::string name;
    lines[2 * i] >> id >> q.w() >> q.x() >> q.y() >> q.z() >> t.x() >> t.y() >> t.z() >> camera_id >> name;
    EXPECT_EQ(id, static_cast<int>(keyframe.id) + 1);
    EXPECT_EQ(name, model.image_of[i].first);
    EXPECT_EQ(keyframe.id, model.image_of[i].second);
    // COLMAP's pose and lens project a point to the same pixel as Docent's.
    for (const engine::MapPoint& point : map->points) {
      if (point.infinite()) continue;
      const Eigen::Vector3d in_camera = q * point.position() + t;
      const auto ours = keyframe.camera->Project(keyframe.camera_from_map * point.position());
      if (!ours || ours->norm() > 1e4) continue;  // Farther out, rounding errors exceed the tolerance.
      const Camera& camera = cameras.at(camera_id);
      const Eigen::Vector2d theirs = ProjectAsColmap(camera.model, camera.parameters, in_camera);
      EXPECT_LT((theirs - (*ours + Eigen::Vector2d(0.5, 0.5))).norm(), 1e-6);
      ++projected;
    }
    double u = 0, v = 0;
    int point_id = 0;
    for (int index = 0; lines[2 * i + 1] >> u >> v >> point_id; ++index) {
      const engine::Observation& observation = map->observations[observations++];
      EXPECT_EQ(observation.keyframe, keyframe.id);
      EXPECT_NEAR(u, observation.pixel.x() + 0.5, 1e-5);
      EXPECT_NEAR(v, observation.pixel.y() + 0.5, 1e-5);
      const bool finite = !map->FindPoint(observation.point)->infinite();
      EXPECT_EQ(point_id, finite ? static_cast<int>(observation.point) + 1 : -1);
      if (finite) {
        EXPECT_EQ((track_of[{id, index}]), point_id);
        ++in_tracks;
      }
    }
  }
  EXPECT_EQ(observations, map->observations.size());
  EXPECT_EQ(in_tracks, track_of.size());
  EXPECT_GT(projected, 20u);
}

TEST(Ply, HasEveryFinitePointOnce) {
  const auto map = MakeSampleMap(5, {.keyframes = 3, .points = 40});
  const std::string ply = MakePly(*map);
  ASSERT_THAT(ply, HasSubstr("element vertex 30\n"));
  constexpr std::size_t kVertexBytes = 6 * 4 + 3;
  const std::size_t begin = ply.find("end_header\n") + 11;
  ASSERT_EQ(ply.size() - begin, 30 * kVertexBytes);
  std::size_t at = begin;
  for (const engine::MapPoint& point : map->points) {
    if (point.infinite()) continue;
    Eigen::Vector3f position;
    std::memcpy(position.data(), ply.data() + at, sizeof(position));
    EXPECT_EQ(position, point.position().cast<float>());
    at += kVertexBytes;
  }
}

TEST(ViewFromAbove, DrawsAPointAtItsPlaceInThePlan) {
  // A keyframe at the origin that faces ahead, and points ahead and to its right.
  engine::MapSnapshot map;
  map.keyframes.emplace_back();
  const auto add = [&](double x, double y, double z) {
    engine::MapPoint point;
    point.point_in_map = {x, y, z, 1};
    map.points.push_back(point);
  };
  add(0, 0, 4);
  add(4, -1, 0);
  const cv::Mat sheet = DrawFromAbove(map, {.size_px = 500, .margin_px = 50});
  ASSERT_EQ(sheet.type(), CV_8UC3);
  const auto dark = [&](int x, int y) {
    cv::Rect around(x - 2, y - 2, 5, 5);
    double lowest = 255;
    cv::Mat patch = sheet(around).clone().reshape(1);
    cv::minMaxLoc(patch, &lowest);
    return lowest < 120;
  };
  EXPECT_TRUE(dark(50, 50)) << "ahead must be up in the plan";
  EXPECT_TRUE(dark(450, 450)) << "a point to the right must be on the right";
  EXPECT_FALSE(dark(450, 50));
  EXPECT_FALSE(DrawFromAbove({}).empty());
}

}  // namespace
}  // namespace docent::maps
