// SPDX-License-Identifier: Apache-2.0
// Contents of valid files: expected values were computed by hand from the standard.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "content/gltf/material.h"
#include "content/gltf/resources.h"
#include "tests/content/make_gltf.h"

namespace docent::content {
namespace {

using ::testing::ElementsAre;

void ExpectNear(const glm::vec3& a, const glm::vec3& b, float tolerance = 1e-5f) {
  EXPECT_LT(glm::length(a - b), tolerance)
      << a.x << " " << a.y << " " << a.z << " is not " << b.x << " " << b.y << " " << b.z;
}

// Five points in a row above two others, so that each corner is identified by its x.
GltfFile FiveVertices(int mode) {
  GltfFile file;
  const int positions = file.AddFloats({0, 0, 0, 1, 1, 0, 2, 0, 0, 3, 1, 0, 4, 0, 0}, "VEC3", 5);
  const int normals = file.AddFloats({0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1}, "VEC3", 5);
  file.Add("meshes", {{"primitives",
                       {{{"attributes", {{"POSITION", positions}, {"NORMAL", normals}}}, {"mode", mode}}}}});
  file.Add("nodes", {{"mesh", 0}});
  return file;
}

std::vector<int> Corners(const Model& model) {
  std::vector<int> corners;
  const Primitive& primitive = model.meshes[0].primitives[0];
  for (const std::uint32_t index : primitive.indices) {
    corners.push_back(static_cast<int>(primitive.vertices[index].position.x));
  }
  return corners;
}

TEST(GltfContent, TrianglesStripsAndFansAreUnrolledInTheStandardsOrder) {
  EXPECT_THAT(Corners(*FiveVertices(4).Load()), ElementsAre(0, 1, 2));
  EXPECT_THAT(Corners(*FiveVertices(5).Load()), ElementsAre(0, 1, 2, 1, 3, 2, 2, 3, 4));
  EXPECT_THAT(Corners(*FiveVertices(6).Load()), ElementsAre(1, 2, 0, 2, 3, 0, 3, 4, 0));
}

TEST(GltfContent, PointsAndLinesAreLeftOutWithAWarning) {
  for (int mode = 0; mode < 4; ++mode) {
    const auto model = FiveVertices(mode).Load();
    EXPECT_TRUE(model->meshes[0].primitives.empty());
    EXPECT_THAT(model->warnings, ElementsAre("Points and lines are left out."));
  }
}

TEST(GltfContent, MissingNormalsBecomeThoseOfTheTriangles) {
  GltfFile file;
  // Two triangles that share an edge at a right angle.
  const int positions = file.AddFloats({0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}, "VEC3", 4);
  const int indices = file.AddIndices({0, 1, 2, 0, 3, 1});
  file.Add("meshes", {{"primitives", {{{"attributes", {{"POSITION", positions}}}, {"indices", indices}}}}});
  const auto model = file.Load();
  const Primitive& primitive = model->meshes[0].primitives[0];
  ASSERT_EQ(primitive.vertices.size(), 6u);
  for (int i = 0; i < 3; ++i) ExpectNear(primitive.vertices[static_cast<std::size_t>(i)].normal, {0, 0, 1});
  for (int i = 3; i < 6; ++i) ExpectNear(primitive.vertices[static_cast<std::size_t>(i)].normal, {0, 1, 0});
}

TEST(GltfContent, MissingTangentsFollowTheTextureCoordinates) {
  for (const float handedness : {1.0f, -1.0f}) {
    GltfFile file = TriangleFile();
    nlohmann::json& primitive = file.json["meshes"][0]["primitives"][0];
    // u grows along y, v along x (or against it).
    primitive["attributes"]["TEXCOORD_0"] = file.AddFloats({0, 0, 0, -handedness, 1, 0}, "VEC2", 3);
    primitive["material"] = 0;
    file.Add("materials", {{"normalTexture", {{"index", 0}}}});
    file.Add("textures", {{"source", 0}});
    const std::string uri =
        "data:image/"
        "png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5E"
        "rkJggg==";
    file.Add("images", {{"uri", uri}});
    const auto model = file.Load();
    for (const Vertex& vertex : model->meshes[0].primitives[0].vertices) {
      ExpectNear(glm::vec3(vertex.tangent), {0, 1, 0});
      // The bitangent cross(normal, tangent) * w points in the direction of increasing v.
      ExpectNear(glm::cross(vertex.normal, glm::vec3(vertex.tangent)) * vertex.tangent.w,
                 {-handedness, 0, 0});
    }
    ASSERT_EQ(model->images.size(), 1u);
    EXPECT_EQ(model->images[0].rgba.size(), 4u);
  }
}

TEST(GltfContent, NormalizedIntegersAreFractions) {
  GltfFile file = TriangleFile();
  nlohmann::json& attributes = file.json["meshes"][0]["primitives"][0]["attributes"];
  const int uv = file.AddAccessor<std::uint16_t>({0, 65535, 32768, 0, 0, 13107}, 5123, "VEC2", 3);
  file.json["accessors"][static_cast<std::size_t>(uv)]["normalized"] = true;
  attributes["TEXCOORD_0"] = uv;
  const int color = file.AddAccessor<std::uint8_t>({255, 0, 51, 0, 0, 0, 0, 0, 0, 0, 0, 0}, 5121, "VEC3", 3);
  file.json["accessors"][static_cast<std::size_t>(color)]["normalized"] = true;
  file.json["bufferViews"][static_cast<std::size_t>(color)]["byteStride"] = 4;
  attributes["COLOR_0"] = color;
  const auto model = file.Load();
  const Primitive& primitive = model->meshes[0].primitives[0];
  EXPECT_FLOAT_EQ(primitive.vertices[0].uv0.y, 1.0f);
  EXPECT_FLOAT_EQ(primitive.vertices[1].uv0.x, 32768.0f / 65535.0f);
  EXPECT_FLOAT_EQ(primitive.vertices[2].uv0.y, 0.2f);
  EXPECT_EQ(primitive.vertices[0].color, glm::vec4(1, 0, 0.2f, 1));
}

TEST(GltfContent, SparseAccessorsReplaceTheirElements) {
  GltfFile file = TriangleFile();
  const int indices = file.AddView<std::uint16_t>({2});
  const int values = file.AddView<float>({0, 5, 0});
  file.json["accessors"][0]["sparse"] = {{"count", 1},
                                         {"indices", {{"bufferView", indices}, {"componentType", 5123}}},
                                         {"values", {{"bufferView", values}}}};
  EXPECT_FLOAT_EQ(file.Load()->bounds_max.y, 5.0f);
  file.json["accessors"][0]["sparse"]["count"] = 2;
  EXPECT_NE(file.Refusal(), "");
  const int beyond = file.AddView<std::uint16_t>({3});
  file.json["accessors"][0]["sparse"]["count"] = 1;
  file.json["accessors"][0]["sparse"]["indices"]["bufferView"] = beyond;
  EXPECT_NE(file.Refusal(), "");
}

TEST(GltfContent, ParentNodesComeFirstAndOnlyTheSceneIsVisible) {
  GltfFile file = TriangleFile();
  file.json["nodes"] = {{{"name", "leaf"}, {"mesh", 0}, {"translation", {0, 2, 0}}},
                        {{"name", "root"}, {"children", {0}}, {"scale", {2, 2, 2}}},
                        {{"name", "hidden"}, {"mesh", 0}, {"translation", {100, 0, 0}}}};
  file.json["scenes"] = {{{"nodes", {2}}}, {{"nodes", {1}}}};
  file.json["scene"] = 1;
  const auto model = file.Load();
  ASSERT_EQ(model->roots.size(), 1u);
  EXPECT_EQ(model->nodes[static_cast<std::size_t>(model->roots[0])].name, "root");
  for (std::size_t i = 0; i < model->nodes.size(); ++i)
    EXPECT_LT(model->nodes[i].parent, static_cast<int>(i));
  ExpectNear(model->bounds_min, {0, 4, 0});
  ExpectNear(model->bounds_max, {2, 6, 0});
}

TEST(GltfContent, DecomposedMatricesGiveTheSameTransform) {
  GltfFile file = TriangleFile();
  // Columns: 90 degrees about z, scaled by (2, 3, -4), translated by (5, 6, 7).
  const std::vector<float> matrix = {0, 2, 0, 0, -3, 0, 0, 0, 0, 0, -4, 0, 5, 6, 7, 1};
  file.json["nodes"] = {{{"mesh", 0}, {"matrix", matrix}}};
  const auto model = file.Load();
  const glm::mat4 read = NodeMatrices(*model, -1, 0)[0];
  for (int i = 0; i < 16; ++i) EXPECT_NEAR(read[i / 4][i % 4], matrix[static_cast<std::size_t>(i)], 1e-5);
}

GltfFile AnimatedFile(const char* path, const char* interpolation, const std::vector<float>& values,
                      int components) {
  GltfFile file = TriangleFile();
  const int times = file.AddFloats({1, 3}, "SCALAR", 2);
  const std::size_t count = values.size() / static_cast<std::size_t>(components);
  const int output = file.AddFloats(values, components == 4 ? "VEC4" : "VEC3", count);
  file.Add("animations",
           {{"channels", {{{"sampler", 0}, {"target", {{"node", 0}, {"path", path}}}}}},
            {"samplers", {{{"input", times}, {"output", output}, {"interpolation", interpolation}}}}});
  return file;
}

TEST(GltfContent, AnimationsUseStepAndLinearInterpolation) {
  const auto step = AnimatedFile("translation", "STEP", {1, 0, 0, 5, 0, 0}, 3).Load();
  const auto linear = AnimatedFile("translation", "LINEAR", {1, 0, 0, 5, 0, 0}, 3).Load();
  const auto x_at = [](const Model& model, double seconds) {
    return NodeMatrices(model, 0, seconds)[0][3].x;
  };
  EXPECT_FLOAT_EQ(linear->animations[0].duration, 3.0f);
  EXPECT_FLOAT_EQ(x_at(*step, 0.5), 1);
  EXPECT_FLOAT_EQ(x_at(*step, 2.9), 1);
  EXPECT_FLOAT_EQ(x_at(*linear, 0.5), 1);
  EXPECT_FLOAT_EQ(x_at(*linear, 2.0), 3);
  EXPECT_NEAR(x_at(*linear, 2.999), 5, 0.01);
  EXPECT_FLOAT_EQ(x_at(*linear, 5.0), 3) << "it repeats after its three seconds";
  EXPECT_FLOAT_EQ(x_at(*linear, -1.0), 3);
  EXPECT_FLOAT_EQ(NodeMatrices(*linear, -1, 2.0)[0][3].x, 0) << "rest pose";
  EXPECT_FLOAT_EQ(NodeMatrices(*linear, 7, 2.0)[0][3].x, 0) << "no such animation";
}

TEST(GltfContent, RotationsTakeTheShorterArc) {
  const float h = std::sqrt(0.5f);
  for (const float sign : {1.0f, -1.0f}) {
    // From no rotation to 90 degrees about z; the second quaternion may have either sign.
    const auto model = AnimatedFile("rotation", "LINEAR", {0, 0, 0, 1, 0, 0, sign * h, sign * h}, 4).Load();
    const glm::vec3 x_axis(NodeMatrices(*model, 0, 2.0)[0][0]);
    ExpectNear(x_axis, {h, h, 0});
  }
}

TEST(GltfContent, CubicSplinesAreHermitePolynomials) {
  // p(s) on [1, 3] with value 1 and slope 0.5 at the left end and value 2 and slope -1 at the right end.
  const std::vector<float> values = {0, 0, 0, 1, 0, 0, 0.5f, 0, 0, -1, 0, 0, 2, 0, 0, 0, 0, 0};
  const auto model = AnimatedFile("translation", "CUBICSPLINE", values, 3).Load();
  const auto hermite = [](double t) {
    const double t2 = t * t, t3 = t2 * t;
    return (2 * t3 - 3 * t2 + 1) * 1 + 2 * (t3 - 2 * t2 + t) * 0.5 + (-2 * t3 + 3 * t2) * 2 +
           2 * (t3 - t2) * -1;
  };
  for (const double seconds : {1.0, 1.3, 2.0, 2.7}) {
    EXPECT_NEAR(NodeMatrices(*model, 0, seconds)[0][3].x, hermite((seconds - 1) / 2), 1e-5) << seconds;
  }
  const double step = 1e-2;
  const double slope =
      (NodeMatrices(*model, 0, 1 + step)[0][3].x - NodeMatrices(*model, 0, 1.0)[0][3].x) / step;
  EXPECT_NEAR(slope, 0.5, 0.02);
}

TEST(GltfContent, SkinnedBoundsFollowTheJoints) {
  GltfFile file = TriangleFile();
  nlohmann::json& attributes = file.json["meshes"][0]["primitives"][0]["attributes"];
  attributes["JOINTS_0"] = file.AddAccessor<std::uint8_t>(std::vector<std::uint8_t>(12, 0), 5121, "VEC4", 3);
  attributes["WEIGHTS_0"] = file.AddFloats({2, 0, 0, 0, 2, 0, 0, 0, 2, 0, 0, 0}, "VEC4", 3);
  file.json["nodes"] = {{{"mesh", 0}, {"skin", 0}, {"translation", {50, 0, 0}}},
                        {{"translation", {0, 0, 10}}}};
  file.json["scenes"] = {{{"nodes", {0, 1}}}};
  file.json["skins"] = {{{"joints", {1}}}};
  const auto model = file.Load();
  EXPECT_FLOAT_EQ(model->meshes[0].primitives[0].vertices[0].weights.x, 1.0f)
      << "weights are normalized to sum 1";
  ExpectNear(model->bounds_min, {0, 0, 10});
  ExpectNear(model->bounds_max, {1, 1, 10});
}

TEST(GltfContent, MaterialsAndTheirExtensionsAreRead) {
  GltfFile file = TriangleFile();
  file.json["meshes"][0]["primitives"][0]["material"] = 0;
  file.json["extensionsUsed"] = {"KHR_materials_unlit", "KHR_texture_transform"};
  file.Add("images",
           {{"uri",
             "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9Q"
             "DwADhgGAWjR9awAAAABJRU5ErkJggg=="}});
  file.Add("samplers", {{"wrapS", 33071}, {"wrapT", 33648}, {"magFilter", 9728}});
  file.Add("textures", {{"source", 0}, {"sampler", 0}});
  const nlohmann::json transform = {
      {"offset", {0.5, 0.25}}, {"rotation", std::numbers::pi / 2}, {"scale", {2, 3}}, {"texCoord", 1}};
  file.Add("materials",
           {{"pbrMetallicRoughness",
             {{"baseColorFactor", {0.1, 0.2, 0.3, 0.4}},
              {"metallicFactor", 0.25},
              {"baseColorTexture", {{"index", 0}, {"extensions", {{"KHR_texture_transform", transform}}}}}}},
            {"alphaMode", "MASK"},
            {"alphaCutoff", 0.75},
            {"doubleSided", true},
            {"emissiveFactor", {0, 0.5, 1}},
            {"extensions", {{"KHR_materials_unlit", nlohmann::json::object()}}}});
  const auto model = file.Load();
  const Material& material = model->materials[0];
  EXPECT_EQ(material.base_color, glm::vec4(0.1f, 0.2f, 0.3f, 0.4f));
  EXPECT_FLOAT_EQ(material.metallic, 0.25f);
  EXPECT_FLOAT_EQ(material.roughness, 1.0f);
  EXPECT_EQ(material.alpha, Material::Alpha::kMask);
  EXPECT_FLOAT_EQ(material.alpha_cutoff, 0.75f);
  EXPECT_TRUE(material.double_sided);
  EXPECT_TRUE(material.unlit);
  EXPECT_EQ(material.base_color_texture.texture, 0);
  EXPECT_EQ(material.base_color_texture.uv_set, 1);
  // KHR_texture_transform: offset + R(rotation) * (scale * uv), with a counter-clockwise rotation in the uv
  // plane, which takes (1, 0) to (0, -1) because v points down.
  ExpectNear(material.base_color_texture.uv_transform * glm::vec3(1, 0, 1), {0.5f, 0.25f - 2, 1});
  ExpectNear(material.base_color_texture.uv_transform * glm::vec3(0, 1, 1), {0.5f + 3, 0.25f, 1});
  EXPECT_FALSE(model->textures[0].repeat_u);
  EXPECT_TRUE(model->textures[0].repeat_v && model->textures[0].mirror_v && model->textures[0].nearest);
}

TEST(GltfContent, SpecularGlossinessKeepsItsReflectance) {
  for (const float metallic : {0.0f, 0.3f, 0.8f, 1.0f}) {
    const glm::vec3 base(0.9f, 0.6f, 0.3f);
    const glm::vec3 diffuse = base * (1 - metallic), specular = 0.04f * (1 - metallic) + base * metallic;
    const MetallicBase converted = MetallicFromSpecular(diffuse, specular);
    EXPECT_NEAR(converted.metallic, metallic, 1e-4);
    ExpectNear(converted.base_color, base, 1e-4f);
  }
  EXPECT_FLOAT_EQ(MetallicFromSpecular(glm::vec3(0.5f), glm::vec3(0)).metallic, 0.0f);
}

TEST(GltfContent, DataUrisAreDecodedAccordingToTheirStandards) {
  const auto text = [](const char* uri) -> std::optional<std::string> {
    const auto bytes = DecodeDataUri(uri);
    if (!bytes) return std::nullopt;
    return std::string(bytes->begin(), bytes->end());
  };
  // RFC 4648, section 10.
  EXPECT_EQ(text("data:;base64,"), "");
  EXPECT_EQ(text("data:;base64,Zg=="), "f");
  EXPECT_EQ(text("data:;base64,Zm8="), "fo");
  EXPECT_EQ(text("data:application/octet-stream;base64,Zm9vYmFy"), "foobar");
  EXPECT_EQ(text("data:text/plain,a%20b"), "a b");
  EXPECT_EQ(text("data:;base64,Z"), std::nullopt);
  EXPECT_EQ(text("data:;base64,Zg*="), std::nullopt);
  EXPECT_EQ(text("data:nothing"), std::nullopt);
}

}  // namespace
}  // namespace docent::content
