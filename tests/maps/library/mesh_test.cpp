// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "engine/base/random.h"
#include "maps/exchange/mesh_ply.h"
#include "maps/library/library.h"
#include "maps/maintenance/densify.h"
#include "maps/storage/mesh_rows.h"
#include "tests/maps/map_samples.h"

namespace docent::maps {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

// A wavy surface of squares, with keyframes of the sample map.
engine::MapMesh MakeMesh(int squares, const engine::MapSnapshot& map) {
  engine::MapMesh result;
  Random random(3);
  for (int y = 0; y <= squares; ++y) {
    for (int x = 0; x <= squares; ++x) {
      const auto height = static_cast<float>(random.Uniform(-0.05, 0.05));
      result.mesh.vertices.emplace_back(0.1F * static_cast<float>(x) - 2, 0.1F * static_cast<float>(y),
                                        height);
    }
  }
  for (int y = 0; y < squares; ++y) {
    for (int x = 0; x < squares; ++x) {
      const auto at = static_cast<std::uint32_t>(y * (squares + 1) + x);
      const auto below = at + static_cast<std::uint32_t>(squares) + 1;
      result.mesh.triangles.push_back({at, at + 1, below});
      result.mesh.triangles.push_back({at + 1, below + 1, below});
    }
  }
  for (const engine::KeyFrame& keyframe : map.keyframes) {
    if (keyframe.kind == engine::KeyFrameKind::kSixDof)
      result.keyframes.push_back({keyframe.id, keyframe.camera_from_map});
  }
  return result;
}

// The largest distance between the corners of the triangles of two meshes.
double LargestDifference(const engine::SurfaceMesh& a, const engine::SurfaceMesh& b) {
  EXPECT_EQ(a.triangles.size(), b.triangles.size());
  double largest = 0;
  for (std::size_t i = 0; i < std::min(a.triangles.size(), b.triangles.size()); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      const double difference = (a.vertices[a.triangles[i][k]] - b.vertices[b.triangles[i][k]]).norm();
      largest = std::max(largest, difference);
    }
  }
  return largest;
}

class StoredMesh : public ::testing::Test {
 protected:
  StoredMesh() {
    library_.NewKey();
    library_.Save({1, "Desk", Policy::kOpen, map_, MakeSampleScene(10, 1)});
  }

  const TemporaryFolder folder_;
  const std::filesystem::path file_ = folder_ / "a.docent";
  std::shared_ptr<engine::MapSnapshot> map_ = MakeSampleMap(1);
  Library library_ = OpenToWrite(file_);
  const engine::MapMesh mesh_ = MakeMesh(30, *map_);
};

TEST_F(StoredMesh, IsReadAsItWasStoredUpToRounding) {
  EXPECT_FALSE(library_.LoadMesh(1));
  ASSERT_TRUE(library_.SaveMesh(1, mesh_));
  const auto read = OpenToRead(file_).LoadMesh(1);
  ASSERT_TRUE(read);
  // Half a step of 1/65535 of three units along each axis.
  EXPECT_LT(LargestDifference(read->mesh, mesh_.mesh), std::sqrt(3.0) * 3 / 65535);
  ASSERT_EQ(read->keyframes.size(), mesh_.keyframes.size());
  EXPECT_EQ(engine::StateOf(read->keyframes, *map_), engine::MeshState::kCurrent);
  EXPECT_THAT(library_.Verify(), IsEmpty());
}

TEST_F(StoredMesh, TakesAboutTenBytesPerTriangle) {
  const engine::MapMesh large = MakeMesh(200, *map_);
  EXPECT_LT(MeshBytes(large), 10 * large.mesh.triangles.size());
}

TEST_F(StoredMesh, DoesNotMakeTheMapCountAsChanged) {
  const WallTime before = library_.Find(1).modified;
  library_.SetPolicy(1, Policy::kReadOnly);
  ASSERT_TRUE(library_.SaveMesh(1, mesh_)) << "no policy forbids what is computed";
  EXPECT_EQ(library_.Find(1).modified, before);
}

TEST_F(StoredMesh, StaysWhenTheMapIsExtended) {
  ASSERT_TRUE(library_.SaveMesh(1, mesh_));
  AddSampleKeyFrame(9, {3, 0, 0}, map_.get());
  AddSampleKeyFrame(10, {4, 0, 0}, map_.get());  // One of the two is localized.
  library_.Save({1, "", Policy::kOpen, map_, nullptr});
  const auto read = library_.LoadMesh(1);
  ASSERT_TRUE(read);
  EXPECT_EQ(engine::StateOf(read->keyframes, *map_), engine::MeshState::kExtended);
}

TEST_F(StoredMesh, IsRemovedWhenAKeyFrameMoves) {
  ASSERT_TRUE(library_.SaveMesh(1, mesh_));
  map_->keyframes[1].camera_from_map.translation.x() += 1;
  library_.Save({1, "", Policy::kOpen, map_, nullptr});
  EXPECT_FALSE(library_.LoadMesh(1));
  EXPECT_FALSE(library_.SaveMesh(1, mesh_)) << "it was made of another state of the map";
}

TEST_F(StoredMesh, IsRemovedWithItsMap) {
  ASSERT_TRUE(library_.SaveMesh(1, mesh_));
  library_.Remove(1);
  EXPECT_FALSE(library_.SaveMesh(1, mesh_));
  EXPECT_THAT(library_.Verify(), IsEmpty());
}

TEST_F(StoredMesh, DoesNotKeepADamagedOneFromBeingReplaced) {
  ASSERT_TRUE(library_.SaveMesh(1, mesh_));
  RunSql(file_, "UPDATE parts SET data = x'00' WHERE part = 'mesh'");
  EXPECT_THROW(library_.LoadMesh(1), Error);
  ASSERT_EQ(library_.Verify().size(), 1U);
  EXPECT_THAT(library_.Verify()[0], HasSubstr("the mesh is cut off"));
  EXPECT_NO_THROW(library_.Load(1));
  ASSERT_TRUE(library_.SaveMesh(1, mesh_));
  EXPECT_THAT(library_.Verify(), IsEmpty());
}

TEST_F(StoredMesh, IsRefusedWhenItIsNotValid) {
  engine::MapMesh wrong = mesh_;
  wrong.mesh.triangles[5][1] = static_cast<std::uint32_t>(wrong.mesh.vertices.size());
  EXPECT_THROW(library_.SaveMesh(1, wrong), Error);
  wrong = mesh_;
  wrong.mesh.vertices[3].y() = std::numeric_limits<float>::infinity();
  EXPECT_THROW(library_.SaveMesh(1, wrong), Error);
  wrong = mesh_;
  wrong.mesh.vertices[3].y() = 1e30F;
  EXPECT_THROW(library_.SaveMesh(1, wrong), Error);
  EXPECT_FALSE(library_.LoadMesh(1));
}

TEST_F(StoredMesh, IsRefusedWhenABitIsWrong) {
  const Bytes bytes = EncodeMesh(1, MakeMesh(2, *map_));
  ASSERT_EQ(DecodeMesh(1, bytes).mesh.triangles.size(), 8U);
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    Bytes damaged = bytes;
    damaged[i] ^= 0x10;
    EXPECT_THROW(DecodeMesh(1, damaged), Error) << "byte " << i;
    EXPECT_THROW(DecodeMesh(1, {bytes.data(), i}), Error) << "cut at byte " << i;
  }
}

TEST_F(StoredMesh, IsSimplifiedUntilItFits) {
  const engine::MapMesh large = MakeMesh(450, *map_);
  ASSERT_GT(MeshBytes(large), kMaxMeshBytes);
  EXPECT_THROW(library_.SaveMesh(1, large), Error);
  const engine::MapMesh fitting = MeshThatFits(large);
  EXPECT_GT(MeshBytes(fitting), kMaxMeshBytes / 2);
  EXPECT_TRUE(library_.SaveMesh(1, fitting));
}

TEST_F(StoredMesh, IsWrittenAsPly) {
  engine::SurfaceMesh triangle;
  triangle.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  triangle.triangles = {{0, 1, 2}};
  const std::string ply = MakeMeshPly(triangle);
  EXPECT_THAT(ply, HasSubstr("element vertex 3\n"));
  EXPECT_THAT(ply, HasSubstr("element face 1\n"));
  EXPECT_EQ(ply.size() - ply.find("end_header\n") - 11, 3 * 12U + 13U);
}

// Maps without two keyframes that see the same points have no mesh.
TEST_F(StoredMesh, IsNotComputedWithoutDepth) {
  engine::MapSnapshot without = *map_;
  without.observations.clear();
  without.points.clear();
  library_.Save({1, "", Policy::kOpen, std::make_shared<engine::MapSnapshot>(without), nullptr});
  EXPECT_EQ(DensifyStoredMap(&library_, 1).outcome, DensifyResult::Outcome::kNoDepth);
  EXPECT_FALSE(library_.LoadMesh(1));
}

TEST_F(StoredMesh, IsNotComputedAgain) {
  ASSERT_TRUE(library_.SaveMesh(1, mesh_));
  EXPECT_EQ(DensifyStoredMap(&library_, 1).outcome, DensifyResult::Outcome::kUpToDate);
}

}  // namespace
}  // namespace docent::maps
