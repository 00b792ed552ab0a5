// SPDX-License-Identifier: Apache-2.0
// Hand-made hostile files: each must be rejected with the right message.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "content/asset.h"
#include "content/gltf/check.h"
#include "content/gltf/images.h"
#include "content/gltf/material.h"
#include "content/gltf/resources.h"
#include "tests/app/support/temporary_folder.h"
#include "tests/content/make_gltf.h"
#include "tests/support/processor_time.h"

namespace docent::content {
namespace {

using ::testing::HasSubstr;

class HostileFiles : public ::testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::create_directories(folder_ / "model" / "textures");
    Write("secret.bin", std::string(64, 's'));
  }

  void Write(const std::string& name, const std::string& bytes) {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
  }

  // Returns the error message for a glTF with one buffer of this URI, or an empty text when it loads.
  std::string RefusalOfBuffer(const std::string& uri) {
    nlohmann::json json = {{"asset", {{"version", "2.0"}}}};
    json["buffers"] = {{{"uri", uri}, {"byteLength", 36}}};
    json["bufferViews"] = {{{"buffer", 0}, {"byteLength", 36}}};
    Write("model/test.gltf", json.dump());
    return ErrorOf([&] { ImportAsset(folder_ / "model" / "test.gltf"); });
  }

  const app::TemporaryFolder folder_;
};

TEST_F(HostileFiles, UrisOutsideTheModelsFolderAreRejected) {
  Write("model/inside.bin", std::string(64, 'i'));
  Write("model/textures/deep er.bin", std::string(64, 'i'));
  EXPECT_EQ(RefusalOfBuffer("inside.bin"), "");
  EXPECT_EQ(RefusalOfBuffer("textures/deep%20er.bin"), "");
  EXPECT_EQ(RefusalOfBuffer("./textures/deep er.bin"), "");
  for (const char* uri :
       {"../secret.bin", "textures/../../secret.bin", "%2e%2e/secret.bin", "..%2Fsecret.bin", "/etc/passwd",
        "%2Fetc%2Fpasswd", "file:///etc/passwd", "http://example.com/a.bin", "https:inside.bin",
        "..\\secret.bin", "textures/../inside.bin"}) {
    EXPECT_THAT(RefusalOfBuffer(uri), HasSubstr("outside the model's folder")) << uri;
  }
  EXPECT_THAT(RefusalOfBuffer((folder_ / "model" / "inside.bin").string()),
              HasSubstr("outside the model's folder"));
  EXPECT_THAT(RefusalOfBuffer("missing.bin"), HasSubstr("which does not exist"));
  EXPECT_THAT(RefusalOfBuffer("a%00b"), HasSubstr("not a file name"));
  EXPECT_THAT(RefusalOfBuffer("a%2"), HasSubstr("not a file name"));
}

TEST_F(HostileFiles, LinksAreResolvedBeforeTheFolderIsChecked) {
  std::filesystem::create_symlink(folder_ / "secret.bin", folder_ / "model" / "link.bin");
  EXPECT_THAT(RefusalOfBuffer("link.bin"), HasSubstr("by a link"));
  Write("model/inside.bin", std::string(64, 'i'));
  std::filesystem::create_symlink("inside.bin", folder_ / "model" / "good.bin");
  EXPECT_EQ(RefusalOfBuffer("good.bin"), "");
}

TEST_F(HostileFiles, OnlyRegularFilesAreRead) {
  EXPECT_THAT(RefusalOfBuffer("textures"), HasSubstr("is not a file"));
  EXPECT_THROW(ImportAsset(folder_ / "model"), Error);
  EXPECT_THROW(ImportAsset("/dev/zero"), Error);
  EXPECT_THROW(ImportAsset(folder_ / "nothing.glb"), Error);
}

TEST_F(HostileFiles, AnAssetOfALibraryMustBeSelfContained) {
  nlohmann::json json = {{"asset", {{"version", "2.0"}}}};
  json["buffers"] = {{{"uri", "inside.bin"}, {"byteLength", 36}}};
  EXPECT_THROW(AssetFromBytes("test.glb", MakeGlb(json.dump(), {})), Error);
}

TEST(HostileGltf, TooManyVerticesAreRejectedBeforeAllocation) {
  GltfFile file = TriangleFile();
  file.json["accessors"][0]["count"] = 1'000'000'000;
  EXPECT_THAT(file.Refusal(), HasSubstr("claims 1000000000 elements of 12 bytes"));
  file.json["accessors"][0].erase("bufferView");
  EXPECT_THAT(file.Refusal(), HasSubstr("more than the whole file has bytes"));
}

TEST(HostileGltf, OverflowingProductsAreRejected) {
  for (const std::uint64_t count : {0x5555555555555556ull, 0x8000000000000000ull, 0xFFFFFFFFFFFFFFFFull}) {
    GltfFile file = TriangleFile();
    file.json["accessors"][0]["count"] = count;
    EXPECT_NE(file.Refusal(), "") << count;
  }
  for (const char* member : {"byteOffset", "byteLength"}) {
    GltfFile file = TriangleFile();
    file.json["bufferViews"][0][member] = 0xFFFFFFFFFFFFFFF0ull;
    EXPECT_NE(file.Refusal(), "") << member;
    file.json["bufferViews"][0][member] = 9007199254740000ull;
    EXPECT_NE(file.Refusal(), "") << member;
  }
  GltfFile file = TriangleFile();
  file.json["accessors"][0]["byteOffset"] = -4;
  EXPECT_NE(file.Refusal(), "");
}

TEST(HostileGltf, AGlbTruncatedAnywhereIsRejected) {
  const std::vector<std::uint8_t> whole = TriangleFile().Glb();
  for (std::size_t length = 0; length < whole.size(); ++length) {
    const std::vector<std::uint8_t> part(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(length));
    EXPECT_THROW(AssetFromBytes("cut.glb", part), Error) << length;
  }
  EXPECT_NO_THROW(AssetFromBytes("whole.glb", whole));
}

TEST(HostileGltf, AnyDamagedByteThrowsOrLoads) {
  const std::vector<std::uint8_t> whole = TriangleFile().Glb();
  int refused = 0, loaded = 0;
  for (std::size_t at = 0; at < whole.size(); ++at) {
    for (const int flip : {0x01, 0x20, 0x80, 0xFF}) {
      std::vector<std::uint8_t> damaged = whole;
      damaged[at] = static_cast<std::uint8_t>(damaged[at] ^ flip);
      // An exception that is not an Error fails the test.
      ++(ErrorOf([&] { AssetFromBytes("damaged.glb", damaged); }).empty() ? loaded : refused);
    }
  }
  EXPECT_GT(refused, 100) << "most bytes matter";
  EXPECT_GT(loaded, 10) << "a coordinate may have any finite value";
}

TEST(HostileGltf, JsonBombsStopAtTheirLimits) {
  const std::string deep = std::string(100'000, '[') + std::string(100'000, ']');
  const auto refusal = [](const std::string& text) {
    return ErrorOf([&] { LoadGltf("bomb.gltf", {text.begin(), text.end()}, std::nullopt); });
  };
  EXPECT_THAT(refusal("{\"extras\":" + deep + "}"), HasSubstr("nested deeper"));
  std::string wide = "{\"extras\":[0";
  for (int i = 0; i < 2'100'000; ++i) wide += ",0";
  EXPECT_THAT(refusal(wide + "]}"), HasSubstr("values"));
  EXPECT_THAT(refusal("{\"asset\":"), HasSubstr("not valid JSON"));
  EXPECT_THAT(refusal("hello"), HasSubstr("neither"));
  EXPECT_THAT(refusal(""), HasSubstr("empty"));
}

TEST(HostileGltf, NodesMustBeATree) {
  GltfFile circle = TriangleFile();
  circle.json["nodes"] = {{{"children", {1}}}, {{"children", {0}}}};
  EXPECT_THAT(circle.Refusal(), HasSubstr("its own ancestor"));
  GltfFile self = TriangleFile();
  self.json["nodes"] = {{{"children", {0}}}};
  EXPECT_THAT(self.Refusal(), HasSubstr("its own ancestor"));
  GltfFile shared = TriangleFile();
  shared.json["nodes"] = {{{"children", {2}}}, {{"children", {2}}}, nlohmann::json::object()};
  EXPECT_THAT(shared.Refusal(), HasSubstr("child of two nodes"));
  GltfFile missing = TriangleFile();
  missing.json["nodes"] = {{{"children", {7}}}};
  EXPECT_THAT(missing.Refusal(), HasSubstr("nodes[0].children[0] is 7, and the file has 1 nodes"));
}

TEST(HostileGltf, ALongChainOfNodesDoesNotOverflowTheStack) {
  GltfFile file = TriangleFile();
  constexpr int kNodes = 100'000;
  nlohmann::json nodes = nlohmann::json::array();
  for (int i = 0; i + 1 < kNodes; ++i) nodes.push_back({{"children", {i + 1}}});
  nodes.push_back({{"mesh", 0}});
  file.json["nodes"] = nodes;
  EXPECT_EQ(file.Load()->nodes.size(), static_cast<std::size_t>(kNodes));
}

TEST(HostileGltf, NonFiniteNumbersAreRejected) {
  for (const float value :
       {std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN()}) {
    GltfFile file = TriangleFile();
    std::memcpy(file.bin.data() + 16, &value, sizeof(value));
    EXPECT_THAT(file.Refusal(), HasSubstr("not finite"));
  }
  GltfFile far = TriangleFile();
  far.json["nodes"] = {{{"mesh", 0}, {"scale", {3e38, 1, 1}}, {"translation", {3e38, 0, 0}}}};
  EXPECT_THAT(far.Refusal(), HasSubstr("range of floating-point numbers"));
}

TEST(HostileGltf, IndicesBeyondTheVerticesAreRejected) {
  GltfFile file = TriangleFile();
  file.json["meshes"][0]["primitives"][0]["indices"] = file.AddIndices({0, 1, 3});
  EXPECT_THAT(file.Refusal(), HasSubstr("refers to vertex 3 of 3"));
}

TEST(HostileGltf, SmallFilesThatUnrollToHugeMeshesExceedTheLimits) {
  GltfFile file = TriangleFile();
  nlohmann::json& primitives = file.json["meshes"][0]["primitives"];
  while (primitives.size() < 100) primitives.push_back(primitives[0]);
  LoadLimits limits;
  limits.max_vertices = 250;
  EXPECT_THAT(file.Refusal(limits), HasSubstr("limit of 250 vertices"));
  limits = {};
  limits.max_indices = 90;
  EXPECT_THAT(file.Refusal(limits), HasSubstr("limit of 30 triangles"));
  limits = {};
  limits.max_drawn_indices = 270;
  EXPECT_THAT(file.Refusal(limits), HasSubstr("more than 90 triangles"));
  EXPECT_EQ(file.Refusal(), "");
}

TEST(HostileGltf, PrimitivesWithoutAWholeTriangleAreLeftOut) {
  GltfFile file;
  const int position = file.AddFloats({0, 0, 0}, "VEC3", 1);
  nlohmann::json primitives = nlohmann::json::array();
  for (int i = 0; i < 100; ++i) primitives.push_back({{"attributes", {{"POSITION", position}}}});
  file.Add("meshes", {{"primitives", primitives}});
  file.Add("nodes", {{"mesh", 0}});
  const auto model = file.Load();
  ASSERT_EQ(model->meshes.size(), 1u);
  EXPECT_TRUE(model->meshes[0].primitives.empty());
}

TEST(HostileGltf, NodesThatShowVeryManyPrimitivesAreRefused) {
  GltfFile file = TriangleFile();
  nlohmann::json& primitives = file.json["meshes"][0]["primitives"];
  while (primitives.size() < 1'000) primitives.push_back(primitives[0]);
  EXPECT_EQ(file.Refusal(), "");
  nlohmann::json& shown = file.json["scenes"][0]["nodes"];
  while (shown.size() < 1'000) shown.push_back(file.Add("nodes", {{"mesh", 0}}));
  EXPECT_THAT(file.Refusal(), HasSubstr("nodes show more than 200000 primitives"));
}

TEST(HostileGltf, ManyExtensionsAreNotSearchedForEachOfManyPrimitives) {
  constexpr int kMany = 60'000;
  nlohmann::json root;
  root["accessors"] = {{{"componentType", 5126}, {"type", "VEC3"}, {"count", 3}}};
  root["extensionsUsed"] = nlohmann::json::array();
  nlohmann::json primitives = nlohmann::json::array();
  for (int i = 0; i < kMany; ++i) {
    root["extensionsUsed"].push_back("KHR_mesh_" + std::to_string(i));
    primitives.push_back({{"attributes", {{"POSITION", 0}}}});
  }
  root["meshes"] = nlohmann::json::array();
  root["meshes"].push_back({{"primitives", std::move(primitives)}});
  const double begin_s = ProcessorTime_s();
  CheckMeshes("test.glb", root);
  EXPECT_LT(ProcessorTime_s() - begin_s, 5);
}

TEST(HostileGltf, AnImageIsAveragedOnceForManyMaterials) {
  const std::vector<Image> images = {{64, 64, std::vector<std::uint8_t>(std::size_t{64} * 64 * 4, 128)}};
  Texture texture;
  texture.image = 0;
  const tinygltf::Value info(tinygltf::Value::Object{{"index", tinygltf::Value(0)}});
  tinygltf::Material material;
  material.extensions["KHR_materials_pbrSpecularGlossiness"] =
      tinygltf::Value(tinygltf::Value::Object{{"diffuseTexture", info}, {"specularGlossinessTexture", info}});
  tinygltf::Model source;
  source.materials.assign(40'000, material);
  std::vector<std::string> warnings;
  const double begin_s = ProcessorTime_s();
  const std::vector<Material> materials = ReadMaterials(source, {texture}, images, &warnings);
  EXPECT_LT(ProcessorTime_s() - begin_s, 3);
  EXPECT_FLOAT_EQ(materials.front().roughness, 1 - 128.0f / 255);
  EXPECT_FLOAT_EQ(materials.back().roughness, 1 - 128.0f / 255);
}

TEST(HostileGltf, UnsupportedRequiredExtensionsAreNamed) {
  GltfFile file = TriangleFile();
  file.json["extensionsUsed"] = file.json["extensionsRequired"] = {"KHR_draco_mesh_compression"};
  EXPECT_THAT(file.Refusal(), HasSubstr("KHR_draco_mesh_compression"));
  GltfFile old = TriangleFile();
  old.json["asset"]["version"] = "1.0";
  EXPECT_THAT(old.Refusal(), HasSubstr("glTF 1.0"));
}

TEST(HostileGltf, AnImageThatIsTooLargeIsRejectedFromItsHeader) {
  // A PNG header of 20000 x 4 pixels without image data.
  std::vector<std::uint8_t> png = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n', 0,    0, 0,
                                   13,   'I', 'H', 'D', 'R',  0,    0,    0x4E, 0x20, 0, 0,
                                   0,    4,   8,   6,   0,    0,    0,    0,    0,    0, 0};
  const auto size = ReadImageSize(png);
  ASSERT_TRUE(size.has_value());
  EXPECT_EQ(size->width_px, 20000);
  EXPECT_EQ(size->height_px, 4);
  LoadLimits limits;
  std::uint64_t pixels_left = 1'000'000;
  const auto refusal = [&]() {
    return ErrorOf([&] { EXPECT_FALSE(DecodeImage("a.glb", "images[0]", png, limits, &pixels_left)); });
  };
  EXPECT_THAT(refusal(), HasSubstr("20000 x 4"));
  limits.max_image_side_px = 30000;
  pixels_left = 79'999;
  EXPECT_THAT(refusal(), HasSubstr("takes the model's images over the limit of"));
  pixels_left = 80'000;
  EXPECT_EQ(refusal(), "") << "the header alone is damaged and no image";
}

TEST(HostileGltf, SkinsMustHaveTheJointsThatVerticesUse) {
  GltfFile file = TriangleFile();
  nlohmann::json& attributes = file.json["meshes"][0]["primitives"][0]["attributes"];
  attributes["JOINTS_0"] =
      file.AddAccessor<std::uint8_t>({0, 9, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0}, 5121, "VEC4", 3);
  attributes["WEIGHTS_0"] = file.AddFloats({1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}, "VEC4", 3);
  file.json["nodes"] = {{{"mesh", 0}, {"skin", 0}}, nlohmann::json::object()};
  file.json["skins"] = {{{"joints", {1}}}};
  EXPECT_THAT(file.Refusal(), HasSubstr("joint 1 of a skin with 1"));
  file.json["skins"] = {{{"joints", {1, 0}}}};
  EXPECT_EQ(file.Refusal(), "") << "joint 9 has no weight and does not count";
}

TEST(HostileGltf, ManySetsOfJointsOnTheSameAccessorsAreRefused) {
  GltfFile file = TriangleFile();
  const int joints = file.AddAccessor<std::uint8_t>(std::vector<std::uint8_t>(12, 0), 5121, "VEC4", 3);
  const int weights = file.AddFloats(std::vector<float>(12, 0.25f), "VEC4", 3);
  nlohmann::json& attributes = file.json["meshes"][0]["primitives"][0]["attributes"];
  for (int i = 0; i < 2'000; ++i) {
    attributes["JOINTS_" + std::to_string(i)] = joints;
    attributes["WEIGHTS_" + std::to_string(i)] = weights;
  }
  EXPECT_EQ(file.Refusal(), "") << "the whole file is small";
  LoadLimits limits;
  limits.max_vertices = 100;
  EXPECT_THAT(file.Refusal(limits), HasSubstr("meshes[0].primitives[0] has too many sets of joints"));
}

}  // namespace
}  // namespace docent::content
