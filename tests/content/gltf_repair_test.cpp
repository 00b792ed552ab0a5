// SPDX-License-Identifier: Apache-2.0
// Unusual but valid files must load, and faults that can be repaired must be, with one sentence that says so.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <string>
#include <string_view>

#include "content/asset.h"
#include "tests/content/make_gltf.h"

namespace docent::content {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// A PNG of one pixel.
constexpr std::string_view kPixelPng =
    "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAA"
    "AABJRU5ErkJggg==";

std::vector<std::uint8_t> TextOf(const nlohmann::json& json) {
  const std::string text = json.dump();
  return {text.begin(), text.end()};
}

// A triangle whose material shows these images as base colour and normal map.
GltfFile TexturedTriangle(std::string_view color_uri, std::string_view normal_uri) {
  GltfFile file = TriangleFile();
  file.Add("images", {{"uri", color_uri}});
  file.Add("images", {{"uri", normal_uri}});
  file.Add("textures", {{"source", 0}});
  file.Add("textures", {{"source", 1}});
  file.Add("materials", {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}},
                         {"normalTexture", {{"index", 1}}}});
  file.json["meshes"][0]["primitives"][0]["material"] = 0;
  return file;
}

GltfFile SkinnedTriangle(const std::vector<std::uint8_t>& joints, const std::vector<float>& weights) {
  GltfFile file = TriangleFile();
  nlohmann::json& attributes = file.json["meshes"][0]["primitives"][0]["attributes"];
  attributes["JOINTS_0"] = file.AddAccessor<std::uint8_t>(std::vector<std::uint8_t>(12, 0), 5121, "VEC4", 3);
  attributes["WEIGHTS_0"] = file.AddFloats({.1f, 0, 0, 0, .1f, 0, 0, 0, .1f, 0, 0, 0}, "VEC4", 3);
  attributes["JOINTS_1"] = file.AddAccessor<std::uint8_t>(joints, 5121, "VEC4", 3);
  attributes["WEIGHTS_1"] = file.AddFloats(weights, "VEC4", 3);
  file.json["nodes"] = {{{"mesh", 0}, {"skin", 0}}, nlohmann::json::object(), nlohmann::json::object()};
  file.json["scenes"] = {{{"nodes", {0, 1, 2}}}};
  file.json["skins"] = {{{"joints", {1, 2}}}};
  return file;
}

TEST(GltfRepair, AFileForALaterReaderOfGltf2LoadsWithAWarning) {
  GltfFile file = TriangleFile();
  file.json["asset"] = {{"version", "2.1"}, {"minVersion", "2.1"}};
  EXPECT_THAT(file.Load()->warnings, ElementsAre(HasSubstr("reader of glTF 2.1")));
  file.json["asset"]["minVersion"] = "3.0";
  EXPECT_THAT(file.Refusal(), HasSubstr("newer reader"));
}

TEST(GltfRepair, IndicesWithoutAViewAreZerosThatASparsePartReplaces) {
  GltfFile file = TriangleFile();
  file.json["meshes"][0]["primitives"][0]["indices"] =
      file.Add("accessors", {{"componentType", 5123}, {"type", "SCALAR"}, {"count", 3}});
  EXPECT_THAT(file.Load()->meshes[0].primitives[0].indices.size(), 3u);
  EXPECT_EQ(file.Load()->bounds_max.x, 0) << "all three corners are vertex 0";
  const int places = file.AddView<std::uint8_t>({1, 2});
  const int values = file.AddView<std::uint16_t>({1, 2});
  file.json["accessors"].back()["sparse"] = {{"count", 2},
                                             {"indices", {{"bufferView", places}, {"componentType", 5121}}},
                                             {"values", {{"bufferView", values}}}};
  EXPECT_EQ(file.Load()->bounds_max, glm::vec3(1, 1, 0));
}

TEST(GltfRepair, ABufferThatNamesNoDataIsZerosInATextButRefusedInAGlbWithoutItsChunk) {
  nlohmann::json json = TriangleFile().json;
  json["buffers"] = {{{"byteLength", 36}}};
  const auto model = LoadGltf("test.gltf", TextOf(json), std::nullopt).model;
  EXPECT_THAT(model->warnings, ElementsAre(HasSubstr("read as zeros")));
  EXPECT_EQ(model->bounds_max, glm::vec3(0));
  EXPECT_THAT(ErrorOf([&] { AssetFromBytes("test.glb", MakeGlb(json.dump(), {})); }),
              HasSubstr("no BIN chunk"));
  json["buffers"][0]["byteLength"] = 1'000'000;
  EXPECT_THAT(ErrorOf([&] { LoadGltf("test.gltf", TextOf(json), std::nullopt); }),
              HasSubstr("more bytes than the whole file"));
}

TEST(GltfRepair, ABufferOnAnotherMachineIsRefusedOnlyIfItIsUsed) {
  GltfFile file = TriangleFile();
  nlohmann::json json = file.json;
  json["buffers"] = {{{"byteLength", file.bin.size()}}, {{"uri", "http://example.com/a"}, {"byteLength", 4}}};
  const auto load = [&] { return LoadGltf("test.glb", MakeGlb(json.dump(), file.bin), "."); };
  EXPECT_THAT(load().model->warnings, ElementsAre(HasSubstr("which nothing uses, is left out")));
  EXPECT_NO_THROW(AssetFromBytes("packed.glb", load().glb)) << "the packed file does not name it";
  json["bufferViews"].push_back({{"buffer", 1}, {"byteLength", 4}});
  EXPECT_THAT(ErrorOf(load), HasSubstr("outside the model's folder"));
}

TEST(GltfRepair, AnAccessorOfAnUnknownTypeIsRefusedOnlyIfItIsUsed) {
  GltfFile file = TriangleFile();
  const int unknown = file.Add("accessors", {{"componentType", 5126}, {"type", "VEC9"}, {"count", 3}});
  EXPECT_THAT(file.Load()->warnings, ElementsAre(HasSubstr("does not have")));
  nlohmann::json& primitive = file.json["meshes"][0]["primitives"][0];
  primitive["attributes"]["NORMAL"] = unknown;
  EXPECT_THAT(file.Refusal(), HasSubstr("not allowed for this attribute"));
  primitive["attributes"].erase("NORMAL");
  primitive["indices"] = unknown;
  EXPECT_THAT(file.Refusal(), HasSubstr("not an accessor of unsigned integers"));
}

TEST(GltfRepair, NonFiniteNumbersThatNothingUsesAreRefused) {
  for (const float bad : {std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN()}) {
    GltfFile file = TriangleFile();
    file.AddFloats({0, bad, 0}, "VEC3", 1);
    EXPECT_THAT(file.Refusal(), HasSubstr("accessors[1] holds a number that is not finite"));
  }
}

TEST(GltfRepair, OverlappingAccessorsCannotMakeAFileSlowToCheck) {
  GltfFile file;
  const int positions = file.AddFloats(std::vector<float>(3'000, 0.0f), "VEC3", 1'000);
  for (int i = 0; i < 100; ++i) {
    nlohmann::json copy = file.json["accessors"][static_cast<std::size_t>(positions)];
    file.Add("accessors", std::move(copy));
  }
  EXPECT_EQ(file.Refusal(), "");
  LoadLimits limits;
  limits.max_file_bytes = 100'000;  // The accessors claim 1.2 megabytes of the same 12 000 bytes.
  EXPECT_THAT(file.Refusal(limits), HasSubstr("over the limit of 100000 bytes"));
}

TEST(GltfRepair, JointsAndWeightsOfEverySetAreChecked) {
  const std::vector<std::uint8_t> joints = {1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 9, 1};
  std::vector<float> weights(12, 0.1f);
  EXPECT_THAT(SkinnedTriangle(joints, weights).Refusal(), HasSubstr("joint 9 of a skin with 2"));
  weights[10] = 0;
  EXPECT_EQ(SkinnedTriangle(joints, weights).Refusal(), "") << "joint 9 has no weight";
  weights[2] = -0.5f;
  EXPECT_THAT(SkinnedTriangle(joints, weights).Refusal(), HasSubstr("negative weight"));
  GltfFile points = SkinnedTriangle(joints, weights);
  points.json["meshes"][0]["primitives"][0]["mode"] = 0;
  EXPECT_THAT(points.Refusal(), HasSubstr("negative weight")) << "points are not shown but checked";
}

TEST(GltfRepair, TheFourLargestWeightsOfAllSetsCount) {
  const std::vector<std::uint8_t> joints = {1, 0, 1, 0, 1, 1, 1, 1, 1, 1, 1, 1};
  std::vector<float> weights(12, 0.0f);
  weights[0] = 0.4f, weights[1] = 0.2f, weights[2] = 0.3f, weights[3] = 0.05f;
  const auto model = SkinnedTriangle(joints, weights).Load();
  // Of 0.1 (joint 0), 0.4 (1), 0.2 (0), 0.3 (1) and 0.05 (0), the last is left out; the sum of the others
  // is 1.
  const Vertex& vertex = model->meshes[0].primitives[0].vertices[0];
  float of_joint[2] = {0, 0};
  for (int k = 0; k < 4; ++k) of_joint[vertex.joints[k]] += vertex.weights[k];
  EXPECT_NEAR(of_joint[0], 0.3f, 1e-6);
  EXPECT_NEAR(of_joint[1], 0.7f, 1e-6);
  EXPECT_THAT(model->warnings, ElementsAre(HasSubstr("four joints of largest weight")));
}

TEST(GltfRepair, TheLastRowOfAnInverseBindMatrixIsReplaced) {
  GltfFile file = SkinnedTriangle(std::vector<std::uint8_t>(12, 0), std::vector<float>(12, 0.0f));
  std::vector<float> matrices(32, 0.0f);
  for (const std::size_t i : {0u, 5u, 10u, 15u, 16u, 21u, 26u, 31u}) matrices[i] = 1;
  file.json["skins"][0]["inverseBindMatrices"] = file.AddFloats(matrices, "MAT4", 2);
  EXPECT_THAT(file.Load()->warnings, IsEmpty());
  matrices[3] = 5, matrices[31] = 4;
  file.json["skins"][0]["inverseBindMatrices"] = file.AddFloats(matrices, "MAT4", 2);
  const auto model = file.Load();
  EXPECT_THAT(model->warnings, ElementsAre(HasSubstr("is not 0 0 0 1")));
  EXPECT_EQ(model->skins[0].inverse_bind[0], glm::mat4(1));
  EXPECT_EQ(model->skins[0].inverse_bind[1], glm::mat4(1));
}

TEST(GltfRepair, AnImageThatCannotBeShownCostsItsTexturesOnly) {
  const std::string cut(kPixelPng.substr(0, kPixelPng.size() - 16));
  for (const std::string& uri :
       {std::string("missing.png"), std::string("../outside.png"), std::string("http://example.com/a.png"),
        std::string("data:image/png;base64,*"), std::string("data:image/gif;base64,R0lGODlh"), cut}) {
    const GltfFile file = TexturedTriangle(uri, kPixelPng);
    const LoadedGltf loaded = LoadGltf("test.glb", file.Glb(), "/nowhere");
    const Model& model = *loaded.model;
    ASSERT_THAT(model.warnings, ElementsAre(HasSubstr("textures are left out"))) << uri;
    EXPECT_EQ(model.materials[0].base_color_texture.texture, -1) << uri;
    ASSERT_GE(model.materials[0].normal_texture.texture, 0) << uri;
    EXPECT_EQ(model.images.size(), 1u) << uri;
    // The packed file needs nothing else and shows the same.
    const Asset again = AssetFromBytes("again.glb", loaded.glb);
    EXPECT_EQ(again.model->materials[0].base_color_texture.texture, -1) << uri;
    EXPECT_EQ(again.model->images.size(), 1u) << uri;
  }
}

TEST(GltfRepair, ADamagedImageThatNothingShowsIsNamed) {
  GltfFile file = TriangleFile();
  file.Add("images", {{"uri", kPixelPng.substr(0, kPixelPng.size() - 16)}});
  EXPECT_THAT(file.Load()->warnings, ElementsAre("images[0] is an image that is cut off, and is left out."));
}

TEST(GltfRepair, AWebpImageBesideItsPngCostsNoTexture) {
  GltfFile file = TexturedTriangle(kPixelPng, kPixelPng);
  const int webp = file.Add("images", {{"uri", "data:image/webp;base64,UklGRg=="}});
  file.json["textures"][0]["extensions"]["EXT_texture_webp"]["source"] = webp;
  file.json["extensionsUsed"] = {"EXT_texture_webp"};
  const auto model = file.Load();
  EXPECT_THAT(model->warnings, ElementsAre(HasSubstr("EXT_texture_webp is not supported"),
                                           "images[2] is neither a PNG nor a JPEG image, and is left out."));
  EXPECT_EQ(model->materials[0].base_color_texture.texture, 0);
  EXPECT_EQ(model->images.size(), 2u);
}

TEST(GltfRepair, ExtensionsThatAreLeftOutAreNamedOnce) {
  GltfFile file = TriangleFile();
  file.json["extensionsUsed"] = {"KHR_lights_punctual", "KHR_materials_unlit", "KHR_materials_sheen",
                                 "KHR_materials_variants"};
  file.json["extensionsRequired"] = {"KHR_lights_punctual", "KHR_materials_variants"};
  EXPECT_THAT(file.Load()->warnings,
              ElementsAre(HasSubstr("KHR_lights_punctual"), HasSubstr("KHR_materials_sheen"),
                          HasSubstr("default materials are shown")));
  file.json["extensionsUsed"] = nlohmann::json::array();
  for (int i = 0; i < 1'000; ++i) file.json["extensionsUsed"].push_back("X_" + std::to_string(i));
  file.json.erase("extensionsRequired");
  const auto model = file.Load();
  EXPECT_EQ(model->warnings.size(), 17u);
  EXPECT_EQ(model->warnings.back(), "984 further extensions are not supported.");
}

// The named edge cases of the shared folder: a part of the sentence that refuses or repairs each.
TEST(GltfRepair, DangerousEdgeCasesAreRefusedOrRepairedWithASentence) {
  const std::filesystem::path folder = std::filesystem::path(DOCENT_SOURCE_DIR) / ".." / "shared" / "assets" /
                                       "gltf-edge-cases" / "khronos_validator" / "test" / "base" / "data";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "the validator's cases are missing";
  const std::array<std::array<const char*, 2>, 3> refused = {{
      {"accessor_data/invalid_elements_float.gltf", "is not finite"},
      {"mesh_data/joints_weights_complex.gltf", "meshes[0]"},
      {"buffer/no_bin_chunk.glb", "no BIN chunk"},
  }};
  for (const auto& [file, words] : refused) {
    EXPECT_THAT(ErrorOf([&, name = file] { ImportAsset(folder / name); }), HasSubstr(words)) << file;
  }
  const std::array<std::array<const char*, 2>, 3> repaired = {{
      {"skin_data/invalid_ibm.gltf", "is not 0 0 0 1"},
      {"image/png_eos.gltf", "left out"},
      {"image/not_found.gltf", "left out"},
  }};
  for (const auto& [file, words] : repaired) {
    EXPECT_THAT(ImportAsset(folder / file).model->warnings, ElementsAre(HasSubstr(words))) << file;
  }
}

}  // namespace
}  // namespace docent::content
