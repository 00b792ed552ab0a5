// SPDX-License-Identifier: Apache-2.0
// Material extensions of glTF, from the file to the drawn colours, which follow from the standard.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <numbers>
#include <opencv2/imgcodecs.hpp>
#include <span>
#include <string>
#include <vector>

#include "content/asset.h"
#include "engine/base/base64.h"
#include "tests/ui/ui_testing.h"

namespace docent::ui {
namespace {

using MaterialTest = OffscreenTest;

std::string DataUri(std::span<const std::uint8_t> bytes) {
  return "data:application/octet-stream;base64," + EncodeBase64(bytes);
}

// A square of one metre that faces +z with u to the right and v downwards, as a glTF text. `material` is the
// inside of its JSON object, `rest` further members of the root.
std::shared_ptr<const content::Model> Square(const std::string& material, const std::string& rest = "") {
  const std::array<float, 30> values = {-.5f, -.5f, 0, .5f, -.5f, 0, .5f, .5f, 0, -.5f, .5f, 0,  // positions
                                        0,    0,    1, 0,   0,    1, 0,   0,   1, 0,    0,   1,  // normals
                                        0,    1,    1, 1,   1,    0};                            // u, v
  std::vector<std::uint8_t> bytes(32 * sizeof(float), 0);  // The last corner's u and v are 0.
  std::memcpy(bytes.data(), values.data(), sizeof values);
  for (const std::uint8_t index : {0, 1, 2, 0, 2, 3}) bytes.push_back(index);
  const std::string text =
      R"({"asset":{"version":"2.0"},"nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":{"POSITION":0,)"
      R"("NORMAL":1,"TEXCOORD_0":2},"indices":3,"material":0}]}],"accessors":[)"
      R"({"bufferView":0,"componentType":5126,"type":"VEC3","count":4},)"
      R"({"bufferView":0,"byteOffset":48,"componentType":5126,"type":"VEC3","count":4},)"
      R"({"bufferView":0,"byteOffset":96,"componentType":5126,"type":"VEC2","count":4},)"
      R"({"bufferView":1,"componentType":5121,"type":"SCALAR","count":6}],)"
      R"("bufferViews":[{"buffer":0,"byteLength":128},{"buffer":0,"byteOffset":128,"byteLength":6}],)"
      R"("buffers":[{"byteLength":134,"uri":")" +
      DataUri(bytes) + R"("}],"materials":[{)" + material + "}]" + rest + "}";
  return content::AssetFromBytes("square.gltf", {text.begin(), text.end()}).model;
}

// Two by two texels, red and green above blue and white, without filtering.
std::string FourTexels() {
  cv::Mat image(2, 2, CV_8UC3);
  image.at<cv::Vec3b>(0, 0) = {0, 0, 255};
  image.at<cv::Vec3b>(0, 1) = {0, 255, 0};
  image.at<cv::Vec3b>(1, 0) = {255, 0, 0};
  image.at<cv::Vec3b>(1, 1) = {255, 255, 255};
  std::vector<std::uint8_t> png;
  cv::imencode(".png", image, png);
  return R"(,"images":[{"uri":")" + DataUri(png) +
         R"("}],"samplers":[{"magFilter":9728}],"textures":[{"source":0,"sampler":0}])";
}

engine::CameraModel Pinhole() {
  return {engine::LensModel::kRadialTangential, {640, 480, 400, 400, 320, 240}, {0, 0, 0, 0, 0}};
}

// Two metres before the camera the square spans 200 pixels around (320, 240).
cv::Mat DrawOver(const std::shared_ptr<const content::Model>& model, const cv::Scalar& video) {
  Renderer renderer;
  content::Scene scene;
  content::Entity entity = Facing(model, {0, 0, 2});
  // The model's x, y and z axes are right, up and towards the camera.
  entity.model.map_from_model.rotation = engine::Rotation3::Exp({std::numbers::pi, 0, 0});
  scene.entities.push_back(entity);
  return DrawImage(&renderer, Tracked(cv::Mat(480, 640, CV_8UC3, video)), Pinhole(), scene);
}

cv::Vec3b MiddleOver(const std::shared_ptr<const content::Model>& model,
                     const cv::Scalar& video = {0, 0, 0}) {
  return DrawOver(model, video).at<cv::Vec3b>(240, 320);
}

// IEC 61966-2-1.
double Srgb(double linear) {
  return 255 * (linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055);
}

void ExpectLinearRgb(const cv::Vec3b& drawn, double red, double green, double blue) {
  EXPECT_NEAR(drawn[2], Srgb(red), 1.5);
  EXPECT_NEAR(drawn[1], Srgb(green), 1.5);
  EXPECT_NEAR(drawn[0], Srgb(blue), 1.5);
}

const std::string kUnlit = R"("extensions":{"KHR_materials_unlit":{}})";

TEST_F(MaterialTest, UnlitMaterialsShowTheirColorUnchanged) {
  const auto model = Square(R"("pbrMetallicRoughness":{"baseColorFactor":[0.5,0.25,0.1,1]},)" + kUnlit);
  ExpectLinearRgb(MiddleOver(model), 0.5, 0.25, 0.1);
}

TEST_F(MaterialTest, TextureTransformsScaleRotateAndMoveTheTexture) {
  struct Transform {
    double angle, scale, u, v;
  };
  for (const Transform& t : {Transform{0, 1, 0, 0}, Transform{0, 0.4, 0.55, 0.05}, Transform{0, 1, 0.5, 0},
                             Transform{std::numbers::pi / 2, 1, 0, 0}, Transform{0.3, 0.3, 0.1, 0.7}}) {
    const std::string transform = R"({"rotation":)" + std::to_string(t.angle) + R"(,"scale":[)" +
                                  std::to_string(t.scale) + "," + std::to_string(t.scale) +
                                  R"(],"offset":[)" + std::to_string(t.u) + "," + std::to_string(t.v) + "]}";
    const auto model = Square(
        R"("pbrMetallicRoughness":{"baseColorTexture":{"index":0,"extensions":{"KHR_texture_transform":)" +
            transform + "}}}," + kUnlit,
        FourTexels());
    const cv::Mat drawn = DrawOver(model, {0, 0, 0});
    for (const double u : {0.25, 0.75}) {
      for (const double v : {0.25, 0.75}) {
        // The extension's matrices: translation * rotation * scale, with v downwards.
        const double su = t.scale * u, sv = t.scale * v;
        const double x = t.u + std::cos(t.angle) * su + std::sin(t.angle) * sv;
        const double y = t.v - std::sin(t.angle) * su + std::cos(t.angle) * sv;
        const bool right = x - std::floor(x) >= 0.5, low = y - std::floor(y) >= 0.5;
        const cv::Vec3b expected = low ? (right ? cv::Vec3b(255, 255, 255) : cv::Vec3b(255, 0, 0))
                                       : (right ? cv::Vec3b(0, 255, 0) : cv::Vec3b(0, 0, 255));
        const cv::Vec3b seen =
            drawn.at<cv::Vec3b>(static_cast<int>(140 + 200 * v), static_cast<int>(220 + 200 * u));
        EXPECT_LE(cv::norm(seen, expected, cv::NORM_INF), 2)
            << t.angle << " " << t.scale << " " << u << " " << v;
      }
    }
  }
}

TEST_F(MaterialTest, EmissiveStrengthMultipliesTheEmittedLight) {
  // A black metal reflects nothing here, and colours below 0.75 are not compressed.
  const std::string black =
      R"("pbrMetallicRoughness":{"baseColorFactor":[0,0,0,1]},"emissiveFactor":[0.2,0.1,0.05])";
  ExpectLinearRgb(MiddleOver(Square(black)), 0.2, 0.1, 0.05);
  const std::string strong = R"(,"extensions":{"KHR_materials_emissive_strength":{"emissiveStrength":3}})";
  ExpectLinearRgb(MiddleOver(Square(black + strong)), 0.6, 0.3, 0.15);
}

TEST_F(MaterialTest, TransmissionReplacesDiffuseLightByWhatIsBehind) {
  const auto with = [](double transmission, int metallic) {
    return Square(R"("pbrMetallicRoughness":{"metallicFactor":)" + std::to_string(metallic) +
                  R"(},"extensions":{"KHR_materials_transmission":{"transmissionFactor":)" +
                  std::to_string(transmission) + "}}");
  };
  const cv::Scalar video(90, 60, 30);
  const cv::Vec3b opaque = MiddleOver(with(0, 0), video), clear = MiddleOver(with(1, 0));
  const cv::Vec3b full = MiddleOver(with(1, 0), video), half = MiddleOver(with(0.5, 0), video);
  EXPECT_EQ(opaque, MiddleOver(with(0, 0))) << "nothing passes without transmission";
  for (int k = 0; k < 3; ++k) {
    EXPECT_GT(clear[k], 5) << "the reflection of the room stays";
    EXPECT_GT(opaque[k], clear[k] + 60) << "a white surface is brighter than its reflection";
    EXPECT_NEAR(full[k], clear[k] + video[k], 1.5);
    EXPECT_NEAR(half[k], 0.5 * opaque[k] + 0.5 * clear[k] + 0.5 * video[k], 1.5);
  }
  EXPECT_EQ(MiddleOver(with(1, 1), video), MiddleOver(with(0, 1), video)) << "metals let no light pass";
}

TEST_F(MaterialTest, SpecularGlossinessTakesThePlaceOfItsFallback) {
  // A specular factor of 0.04 is that of every dielectric, so that the diffuse factor is the base colour.
  const auto model = Square(
      R"("pbrMetallicRoughness":{"baseColorFactor":[1,0,0,1]},"extensions":{"KHR_materials_unlit":{},)"
      R"("KHR_materials_pbrSpecularGlossiness":{"diffuseFactor":[0.1,0.5,0.25,1],"specularFactor":[0.04,0.04,0.04]}})");
  ExpectLinearRgb(MiddleOver(model), 0.1, 0.5, 0.25);
}

TEST_F(MaterialTest, ATextureThatIsMissingLeavesTheColorOfItsMaterial) {
  const auto model = Square(
      R"("pbrMetallicRoughness":{"baseColorFactor":[0.5,0.25,0.1,1],"baseColorTexture":{"index":0}},)" +
          kUnlit,
      R"(,"images":[{"uri":"data:image/png;base64,iVBORw0KGgo="}],"textures":[{"source":0}])");
  ASSERT_EQ(model->warnings.size(), 1u);
  ExpectLinearRgb(MiddleOver(model), 0.5, 0.25, 0.1);
}

TEST_F(MaterialTest, VariantsShowTheDefaultMaterial) {
  const auto model = Square(R"("pbrMetallicRoughness":{"baseColorFactor":[0.5,0.25,0.1,1]},)" + kUnlit,
                            R"(,"extensionsUsed":["KHR_materials_unlit","KHR_materials_variants"],)"
                            R"("extensions":{"KHR_materials_variants":{"variants":[{"name":"other"}]}})");
  ASSERT_EQ(model->warnings.size(), 1u);
  ExpectLinearRgb(MiddleOver(model), 0.5, 0.25, 0.1);
}

}  // namespace
}  // namespace docent::ui
