// SPDX-License-Identifier: Apache-2.0
#include "content/assimp_loader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "content/asset.h"
#include "content/gltf/resources.h"
#include "engine/base/error.h"
#include "tests/app/support/temporary_folder.h"

namespace docent::content {
namespace {

class OtherFormats : public ::testing::Test {
 protected:
  std::filesystem::path Write(const std::string& name, const std::string& bytes) {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
    return folder_ / name;
  }
  const app::TemporaryFolder folder_;
};

constexpr const char* kSquare =
    "mtllib square.mtl\nv 0 0 0\nv 2 0 0\nv 2 3 0\nv 0 3 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
    "usemtl red\nf 1/1 2/2 3/3 4/4\n";

// A PNG of one texel.
std::string OneTexel() {
  const auto bytes = DecodeDataUri(
      "data:image/"
      "png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5Er"
      "kJggg==");
  return {bytes->begin(), bytes->end()};
}

TEST_F(OtherFormats, AnObjBecomesTrianglesWithItsMaterialAndTexture) {
  Write("square.mtl", "newmtl red\nKd 0.5 0.25 0\nd 0.5\nmap_Kd red paint.png\n");
  Write("red paint.png", OneTexel());
  const Asset asset = ImportAsset(Write("square.obj", kSquare));
  ASSERT_EQ(asset.model->meshes.size(), 1u);
  const Primitive& primitive = asset.model->meshes[0].primitives[0];
  EXPECT_EQ(primitive.indices.size(), 6u);
  EXPECT_EQ(asset.model->bounds_max, glm::vec3(2, 3, 0));
  ASSERT_GE(primitive.material, 0);
  const Material& material = asset.model->materials[static_cast<std::size_t>(primitive.material)];
  EXPECT_EQ(material.name, "red");
  EXPECT_FLOAT_EQ(material.base_color.r, 0.5f);
  EXPECT_FLOAT_EQ(material.base_color.a, 0.5f);
  EXPECT_EQ(material.alpha, Material::Alpha::kBlend);
  EXPECT_EQ(material.base_color_texture.texture, 0);
  ASSERT_EQ(asset.model->images.size(), 1u);
  for (const Vertex& vertex : primitive.vertices) {
    // In OBJ v starts at the bottom, in glTF at the top.
    EXPECT_FLOAT_EQ(vertex.uv0.y, 1 - vertex.position.y / 3);
  }
  // The asset is self-contained.
  std::filesystem::remove_all(folder_.path());
  EXPECT_EQ(AssetFromBytes(asset.name, asset.bytes).model->images.size(), 1u);
}

TEST_F(OtherFormats, AnUnusableTextureGivesAWarning) {
  Write("square.mtl", "newmtl red\nKd 1 1 1\nmap_Kd ../../../etc/passwd\n");
  const Asset asset = ImportAsset(Write("square.obj", kSquare));
  EXPECT_TRUE(asset.model->images.empty());
  ASSERT_EQ(asset.model->warnings.size(), 1u);
  EXPECT_THAT(asset.model->warnings[0], ::testing::HasSubstr("passwd"));
}

TEST_F(OtherFormats, APlyKeepsItsVertexColours) {
  const Asset asset =
      ImportAsset(Write("tri.PLY",
                        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                        "property float z\nproperty uchar red\nproperty uchar green\n"
                        "property uchar blue\nelement face 1\nproperty list uchar int vertex_indices\n"
                        "end_header\n0 0 0 255 0 0\n1 0 0 255 0 0\n0 1 0 255 0 0\n3 0 1 2\n"));
  ASSERT_EQ(asset.model->meshes.size(), 1u);
  EXPECT_EQ(asset.model->meshes[0].primitives[0].vertices[0].color, glm::vec4(1, 0, 0, 1));
}

TEST_F(OtherFormats, VertexColoursOfScansAreConvertedFromSrgbToLinear) {
  const Asset ply =
      ImportAsset(Write("gray.ply",
                        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                        "property float z\nproperty uchar red\nproperty uchar green\n"
                        "property uchar blue\nproperty uchar alpha\nelement face 1\n"
                        "property list uchar int vertex_indices\nend_header\n"
                        "0 0 0 128 128 5 128\n1 0 0 128 128 5 128\n0 1 0 128 128 5 128\n3 0 1 2\n"));
  const glm::vec4 color = ply.model->meshes[0].primitives[0].vertices[0].color;
  EXPECT_NEAR(color.r, 0.2159f, 1e-4);
  EXPECT_NEAR(color.g, 0.2159f, 1e-4);
  EXPECT_NEAR(color.b, 5 / 255.0f / 12.92f, 1e-5);
  EXPECT_NEAR(color.a, 128 / 255.0f, 1e-5);
  const Asset obj = ImportAsset(
      Write("gray.obj", "v 0 0 0 0.5 0.5 0.5\nv 1 0 0 0.5 0.5 0.5\nv 0 1 0 0.5 0.5 0.5\nf 1 2 3\n"));
  EXPECT_NEAR(obj.model->meshes[0].primitives[0].vertices[0].color.r, 0.2140f, 1e-4);
}

// A triangle with sides of 100 units of this many centimetres.
std::string FbxTriangle(const std::string& unit_cm) {
  return "; FBX 7.4.0 project file\n"
         "FBXHeaderExtension:  {\n\tFBXHeaderVersion: 1003\n\tFBXVersion: 7400\n}\n"
         "GlobalSettings:  {\n\tVersion: 1000\n\tProperties70:  {\n"
         "\t\tP: \"UpAxis\", \"int\", \"Integer\", \"\",1\n"
         "\t\tP: \"UpAxisSign\", \"int\", \"Integer\", \"\",1\n"
         "\t\tP: \"FrontAxis\", \"int\", \"Integer\", \"\",2\n"
         "\t\tP: \"FrontAxisSign\", \"int\", \"Integer\", \"\",1\n"
         "\t\tP: \"CoordAxis\", \"int\", \"Integer\", \"\",0\n"
         "\t\tP: \"CoordAxisSign\", \"int\", \"Integer\", \"\",1\n"
         "\t\tP: \"UnitScaleFactor\", \"double\", \"Number\", \"\"," +
         unit_cm +
         "\n\t}\n}\n"
         "Objects:  {\n"
         "\tGeometry: 1001, \"Geometry::\", \"Mesh\" {\n"
         "\t\tVertices: *9 {\n\t\t\ta: 0,0,0,100,0,0,0,100,0\n\t\t}\n"
         "\t\tPolygonVertexIndex: *3 {\n\t\t\ta: 0,1,-3\n\t\t}\n"
         "\t\tGeometryVersion: 124\n\t}\n"
         "\tModel: 1002, \"Model::triangle\", \"Mesh\" {\n"
         "\t\tVersion: 232\n\t\tProperties70:  {\n"
         "\t\t\tP: \"Lcl Translation\", \"Lcl Translation\", \"\", \"A\",100,0,0\n\t\t}\n\t}\n"
         "}\n"
         "Connections:  {\n\tC: \"OO\",1002,0\n\tC: \"OO\",1001,1002\n}\n";
}

TEST_F(OtherFormats, AnFbxIsConvertedToMetres) {
  const Asset in_centimetres = ImportAsset(Write("centimetres.fbx", FbxTriangle("1")));
  EXPECT_NEAR(in_centimetres.model->bounds_min.x, 1, 1e-5);
  EXPECT_NEAR(in_centimetres.model->bounds_max.x, 2, 1e-5);
  EXPECT_NEAR(in_centimetres.model->bounds_max.y, 1, 1e-5);
  const Asset in_metres = ImportAsset(Write("metres.fbx", FbxTriangle("100")));
  EXPECT_NEAR(in_metres.model->bounds_max.x, 200, 1e-3);
}

TEST_F(OtherFormats, DamagedFilesAreRefusedInOneSentence) {
  for (const char* name : {"a.obj", "a.ply", "a.stl", "a.fbx", "a.dae", "a.3ds", "a.off"}) {
    const std::filesystem::path path = Write(name, "this is no model\n");
    try {
      const Asset asset = ImportAsset(path);
      EXPECT_TRUE(asset.model->meshes.empty()) << name;
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), ::testing::HasSubstr(name));
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    }
  }
  EXPECT_THROW(ImportAsset(folder_ / "missing.obj"), Error);
}

TEST_F(OtherFormats, LimitsApplyToOtherFormats) {
  LoadLimits limits;
  limits.max_vertices = 3;
  const std::filesystem::path path = Write("square.obj", kSquare);
  EXPECT_THROW(ImportAsset(path, limits), Error);
  limits = {};
  limits.max_file_bytes = 20;
  EXPECT_THROW(ImportAsset(path, limits), Error);
}

TEST(AssimpFormats, GltfIsNotLoadedWithAssimp) {
  EXPECT_FALSE(IsAssimpFormat("a.gltf"));
  EXPECT_FALSE(IsAssimpFormat("a.GLB"));
  EXPECT_TRUE(IsAssimpFormat("a.OBJ"));
}

}  // namespace
}  // namespace docent::content
